"""Tests of an exported page with evolved networks, teachers, and births during life."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from playwright.sync_api import Page, expect

from baldwinlab.analysis.palette import resolve_color
from baldwinlab.evolution import GenerationKey
from baldwinlab.experiment import Experiment
from baldwinlab.lab.pages.export import render_live_page
from baldwinlab.lab.sources import binary_frames
from baldwinlab.lab.sources.life_query import Life, Span, StartData
from baldwinlab.lab.sources.recording import record_life
from baldwinlab.papers import presets
from baldwinlab.simulation.simulate import simulate
from tests.lab.test_page_export import is_bit_identical, shorten, start_run

# The compilation of a custom module takes half a minute, and needs a linker.
pytestmark = pytest.mark.nightly
LAST = 2
# Record the arrays from workers, and the dashed lines on canvases.
RECORDER = """
    // The last array of each name.
    window.received = {};
    window.drawn = { shades: [] };
    window.Worker = class extends Worker {
        constructor(...values) {
            super(...values);
            this.addEventListener("message", ({ data }) => {
                Object.assign(received, data.answer?.arrays);
            });
        }
    };
    const { stroke } = CanvasRenderingContext2D.prototype;
    CanvasRenderingContext2D.prototype.stroke = function () {
        if (this.getLineDash().length) drawn.shades.push(this.strokeStyle);
        stroke.apply(this);
    };
"""


def open_finished_run(page: Page, experiment: Experiment, folder: Path) -> None:
    """Simulate a run on a new page, and move to a step at which agents have eaten."""
    path = folder / "laboratory.html"
    path.write_bytes(render_live_page([experiment]))
    page.add_init_script(RECORDER)
    page.goto(path.as_uri())
    start_run(page, runs=1)
    expect(page.get_by_test_id("live-state")).to_have_text("Done")
    expect(page.get_by_test_id("live-caption")).to_have_text(f"Generation {LAST}")
    for _ in range(15):
        page.get_by_test_id("live-canvas").press("Shift+ArrowRight")
    eaten = simulate(experiment, seed=0).food_eaten[LAST]
    expect(page.get_by_test_id("live-canvas-count")).to_contain_text(f"{int(eaten.sum())} eaten")


def make_last_life(experiment: Experiment) -> tuple[Life, Span]:
    """Return the last generation of a run, and the span of its steps."""
    run = simulate(experiment, seed=0)
    past = StartData(run.genome.values[LAST], run.energy)
    life = Life(experiment, GenerationKey(0, 0, LAST), lambda: past)
    return life, Span(0, experiment.lifetime.steps)


def received_array(page: Page, name: str) -> npt.NDArray[Any]:
    return np.array(page.evaluate("name => Array.from(received[name] ?? [])", name))


def test_an_evolved_topology_is_simulated_as_in_python(offline_page: Page, tmp_path: Path) -> None:
    evolution = {"variation": "neat", "selection": "species", "neat": {"add_node_rate": 1.0}}
    experiment = shorten(
        presets.load("evo/A"), network={"kind": "neat", "hidden": [40]}, evolution=evolution
    )
    open_finished_run(offline_page, experiment, tmp_path)


def test_teachers_are_drawn_and_named_in_the_legend(offline_page: Page, tmp_path: Path) -> None:
    social = shorten(presets.load("evo/A"), learning={"rule": "imitation"})
    open_finished_run(offline_page, social, tmp_path)
    expect(offline_page.get_by_test_id("legend").get_by_text("learns from")).to_be_visible()
    teacher = binary_frames.unpack(record_life(*make_last_life(social), {}))[1]["teacher"]
    assert (teacher != np.arange(20)).any(), "no agent learns"
    assert np.array_equal(received_array(offline_page, "teacher").reshape(-1, 20), teacher)
    assert resolve_color("lesson") in offline_page.evaluate("drawn.shades")


@pytest.mark.parametrize("selection", ["roulette", "neutral"])
def test_births_and_deaths_during_life_are_bit_identical_to_python(
    offline_page: Page, tmp_path: Path, selection: str
) -> None:
    short_lives = {
        "births_and_deaths": {"initial_energy": 0.5, "cost_per_step": 0.01, "max_age": 60}
    }
    experiment = shorten(presets.load("evo+self-taught/births-and-deaths")).replace(
        world=short_lives
    )
    path = tmp_path / "laboratory.html"
    path.write_bytes(render_live_page([experiment]))
    offline_page.goto(path.as_uri())
    offline_page.get_by_test_id("start").wait_for()
    changed = experiment.replace(
        evolution={"selection": selection, "elite": 0 if selection == "neutral" else 20}
    )
    assert simulate(changed, seed=4)["born"].sum() > 100
    assert is_bit_identical(offline_page, changed, seed=4, run=0)
