"""Tests of an exported laboratory with built-in parts: links of evolved networks, teachers, and births during life."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from playwright.sync_api import Page, expect

from baldwinlab.analysis.palette import shade
from baldwinlab.evolution import GenerationKey
from baldwinlab.experiment import Experiment
from baldwinlab.lab import binary_frames
from baldwinlab.lab.agent_inspector import inspect_agent
from baldwinlab.lab.export import live_page
from baldwinlab.lab.life_query import Life, ParentGeneration, Span
from baldwinlab.lab.recording import record_life
from baldwinlab.papers import presets
from baldwinlab.simulation.simulate import simulate
from tests.lab.test_page_export import quick, same_bits, start

pytestmark = (
    pytest.mark.nightly
)  # a module of such parts takes half a minute to be compiled, and a linker
LAST, AGENT = 2, 4
WATCHED = """
    window.told = {};  // by workers: the last array of each name
    window.drawn = { words: [], shades: [] };
    window.Worker = class extends Worker {
        constructor(...given) {
            super(...given);
            this.addEventListener("message", ({ data }) => Object.assign(told, data.answer?.arrays));
        }
    };
    const { fillText, stroke } = CanvasRenderingContext2D.prototype;
    CanvasRenderingContext2D.prototype.fillText = function (...given) {
        drawn.words.push(given[0]);
        fillText.apply(this, given);
    };
    CanvasRenderingContext2D.prototype.stroke = function () {
        if (this.getLineDash().length) drawn.shades.push(this.strokeStyle);
        stroke.apply(this);
    };
"""


def opened(page: Page, experiment: Experiment, folder: Path) -> None:
    """Live a run of the experiment on a page of its own, to the end, and go on to where something has been eaten."""
    path = folder / "laboratory.html"
    path.write_bytes(live_page([experiment]))
    page.add_init_script(WATCHED)
    page.goto(path.as_uri())
    start(page, runs=1)
    expect(page.get_by_test_id("live-state")).to_have_text("Done")
    expect(page.get_by_test_id("live-caption")).to_have_text(f"Generation {LAST}")
    for _ in range(15):
        page.get_by_test_id("live-canvas").press("Shift+ArrowRight")
    eaten = simulate(experiment, seed=0).food_eaten[LAST]
    expect(page.get_by_test_id("live-canvas-count")).to_contain_text(f"{int(eaten.sum())} eaten")


def last_life(experiment: Experiment) -> tuple[Life, Span]:
    run = simulate(experiment, seed=0)
    past = ParentGeneration(run.genome.values[LAST], run.energy)
    return Life(experiment, GenerationKey(0, 0, LAST), lambda: past), Span(
        0, experiment.lifetime.steps
    )


def told(page: Page, name: str) -> npt.NDArray[Any]:
    return np.array(page.evaluate("name => Array.from(told[name] ?? [])", name))


def test_a_network_that_grew_is_drawn_with_its_links(offline_page: Page, tmp_path: Path) -> None:
    grows = {"variation": "neat", "selection": "species", "neat": {"add_node_rate": 1.0}}
    growing = quick(
        presets.load("evo/A"), network={"kind": "neat", "hidden": [40]}, evolution=grows
    )
    opened(offline_page, growing, tmp_path)
    offline_page.get_by_test_id("live-canvas-agent").select_option(str(AGENT))
    expect(offline_page.get_by_test_id("kin")).to_contain_text("parents, in generation 1")
    links = binary_frames.unpack(inspect_agent(*last_life(growing), AGENT))[1]["links"]
    assert 3 <= links[:, 1].min() < 43 <= links[:, 1].max(), "hidden units and outputs"
    assert np.array_equal(told(offline_page, "links").reshape(-1, 3), links)
    assert "bias" in offline_page.evaluate("drawn.words")


def test_from_whom_each_learns_is_drawn_and_said_in_the_legend(
    offline_page: Page, tmp_path: Path
) -> None:
    social = quick(presets.load("evo/A"), learning={"rule": "imitation"})
    opened(offline_page, social, tmp_path)
    expect(offline_page.get_by_test_id("legend").get_by_text("learns from")).to_be_visible()
    teacher = binary_frames.unpack(record_life(*last_life(social), {}))[1]["teacher"]
    assert (teacher != np.arange(20)).any(), "somebody learns"
    assert np.array_equal(told(offline_page, "teacher").reshape(-1, 20), teacher)
    assert shade("lesson") in offline_page.evaluate("drawn.shades")


@pytest.mark.parametrize("teacher", ["inherited", "shuffled"])
def test_elders_are_named_inside_an_agent(offline_page: Page, tmp_path: Path, teacher: str) -> None:
    of_elders = {"inheritance": "social-heredity", "generations": LAST + 1}
    heirs = quick(
        presets.load("evo+self-taught/A"), evolution=of_elders, learning={"teacher": teacher}
    )
    opened(offline_page, heirs, tmp_path)
    offline_page.get_by_test_id("live-canvas-agent").select_option(str(AGENT))
    taught = binary_frames.unpack(inspect_agent(*last_life(heirs), AGENT))[0]["teachers"]
    elders = " and ".join(map(str, dict.fromkeys(taught)))
    expect(offline_page.get_by_test_id("teachers")).to_contain_text(
        f"{elders} of generation {LAST - 1}."
    )


@pytest.mark.parametrize("selection", ["roulette", "neutral"])
def test_births_and_deaths_in_mid_life_have_python_s_bits(
    offline_page: Page, tmp_path: Path, selection: str
) -> None:
    brief = {"births_and_deaths": {"initial_energy": 0.5, "cost_per_step": 0.01, "max_age": 60}}
    experiment = quick(presets.load("evo+self-taught/births-and-deaths")).replace(world=brief)
    path = tmp_path / "laboratory.html"
    path.write_bytes(live_page([experiment]))
    offline_page.goto(path.as_uri())
    offline_page.get_by_test_id("start").wait_for()
    changed = experiment.replace(
        evolution={"selection": selection, "elite": 0 if selection == "neutral" else 20}
    )
    assert simulate(changed, seed=4)["born"].sum() > 100
    assert same_bits(offline_page, changed, seed=4, run=0)
