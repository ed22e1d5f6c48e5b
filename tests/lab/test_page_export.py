"""A live laboratory in one file: Python's bits in the browser, and all that a reader can do there."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Error, Page, expect

from baldwinlab import papers
from baldwinlab.experiment import Experiment
from baldwinlab.experiment.base import added_choices
from baldwinlab.lab.export import live_page
from baldwinlab.lab.history import ancestor_line
from baldwinlab.papers import presets
from baldwinlab.papers.paper import STANDARD
from baldwinlab.simulation.simulate import simulate
from tests.axe import find_violations
from tests.lab.test_page_history import rows_of

TYPES = {"food_eaten": np.int32, "energy": np.float64, "parents": np.int32, "genome": np.float32}
SIMULATE = """async (wanted) => {
  const arrays = await window.baldwinlab.simulate(wanted);
  return Object.fromEntries(Object.entries(arrays).map(([name, array]) => [name, Array.from(new Uint8Array(array.buffer))]));
}"""


def quick(experiment: Experiment, **changes: Any) -> Experiment:
    """Short lives, which begin where the food does, so that something is eaten."""
    food = experiment.world.food[0]
    start = {"x": food.x[0], "y": sum(food.y) / 2}
    return experiment.replace(
        lifetime={"steps": 150}, evolution={"generations": 3}, world={"start": start}
    ).replace(**changes)


def all_presets() -> list[Experiment]:
    """Every preset that the shipped modules live, and every variant of the one that uses most of the model."""
    paper = papers.load()
    variants = [variant for variant in paper.names("variants") if variant != STANDARD]
    every = [
        *map(paper.experiment, paper.experiment_names()),
        *(paper.experiment("evo+self-taught/A", each) for each in variants),
    ]
    return [experiment for experiment in every if not list(added_choices(experiment))]


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("export") / "laboratory.html"
    path.write_bytes(live_page([quick(presets.load("evo+self-taught/A"))]))
    return path


@pytest.fixture
def page(offline_page: Page, file: Path) -> Page:
    offline_page.goto(file.as_uri())
    offline_page.get_by_test_id("start").wait_for()
    return offline_page


def start(page: Page, runs: int = 2, pace: str = "0") -> None:
    page.get_by_test_id("setup-runs").fill(str(runs))
    page.get_by_test_id("pace").select_option(pace)
    page.get_by_test_id("start").click()


def same_bits(page: Page, experiment: Experiment, seed: int, run: int) -> bool:
    here = simulate(experiment, seed=seed, run=run)
    there = page.evaluate(SIMULATE, {"seed": seed, "run": run, "experiment": experiment.to_dict()})
    assert here.food_eaten.sum() > 0, experiment.name
    return {name: bytes(there[name]) for name in TYPES} == {
        name: here[name].values.tobytes() for name in TYPES
    }


def test_every_preset_has_python_s_bits(page: Page) -> None:
    for number, experiment in enumerate(all_presets()):
        assert same_bits(page, quick(experiment), seed=3 + number, run=number % 4), (
            experiment.name,
            number,
        )


def test_settings_that_no_preset_has_have_python_s_bits_too(page: Page) -> None:
    near, far = (
        {"x": [380, 420], "y": [120, 200], "count": 400},
        {"x": [0, 640], "y": [500, 640], "count": 30, "energy": 2.5},
    )
    changes: list[dict[str, Any]] = [
        {
            "world": {"food": [near, far]},
            "senses": {"visual_radius": 8},
        },  # items in cells, and seen from all sides of the map
        {"world": {"food": []}, "population": {"size": 3}, "network": {"hidden": []}},
        {
            "network": {"hidden": [5, 4], "biases": True},
            "population": {"size": 7},
            "learning": {"steps": 60},
        },
        {
            "evolution": {"selection": "neutral", "lamarckian_share": 0.5},
            "learning": {"cost_per_change": 0.1},
        },
        {"evolution": {"inheritance": "none"}, "learning": {"rule": "none"}},
    ]
    for number, change in enumerate(changes):
        experiment = quick(presets.load("evo+self-taught/A"), **change)
        if experiment.world.food:
            assert same_bits(page, experiment, seed=7, run=number), change
        else:
            genome = bytes(
                page.evaluate(SIMULATE, {"seed": 7, "experiment": experiment.to_dict()})["genome"]
            )
            assert genome == simulate(experiment, seed=7).genome.values.tobytes()


def test_what_is_left_out_is_the_page_s_own(page: Page, file: Path) -> None:
    experiment = quick(presets.load("evo+self-taught/A"), learning={"rate": 0.05})
    given = {"seed": 2, "generations": 2, "experiment": {"learning": {"rate": 0.05}}}
    there = bytes(page.evaluate(SIMULATE, given)["energy"])
    assert (
        there
        == simulate(
            experiment.replace(evolution={"generations": 2}), seed=2
        ).energy.values.tobytes()
    )


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        (
            {"seed": 1, "experiment": {"learning": {"rate": 11}}},
            "learning.rate = 11: input should be less than or equal to 10",
        ),
        (
            {"seed": 1, "experiment": {"lifetime": {"steps": 1.5}}},
            "lifetime.steps = 1.5: input should be a whole number",
        ),
        (
            {"seed": 1, "experiment": {"lifetime": {"step": 1}}},
            "lifetime.step: there is no such field; there are: steps, update",
        ),
        (
            {"seed": 1, "experiment": {"world": {"width": 300}}},
            "world.start.x = 400: agents are born on the map",
        ),
        (
            {"seed": 1, "experiment": {"senses": {"kinds": ["smell"]}}},
            "for which this page was made",
        ),
        ({"seed": -1}, "seed = -1: input should be greater than or equal to 0"),
        (
            {"seed": 1, "generations": 0},
            "evolution.generations = 0: input should be greater than or equal to 1",
        ),
    ],
)
def test_a_script_that_asks_for_what_cannot_be_gets_a_sentence(
    page: Page, given: dict[str, Any], sentence: str
) -> None:
    with pytest.raises(Error, match=re.escape(sentence)):
        page.evaluate(SIMULATE, given)


def test_memory_that_is_refused_is_a_sentence(page: Page) -> None:
    huge = {"population": {"size": 1_000_000}, "network": {"hidden": [1000, 1000]}}
    with pytest.raises(
        Error, match="The browser did not provide enough memory for this experiment"
    ):
        page.evaluate(SIMULATE, {"seed": 1, "experiment": huge})


def test_a_browser_without_simd_is_told(offline_page: Page, file: Path) -> None:
    text = file.read_text(encoding="utf-8").replace(
        'id="worker">', 'id="worker">WebAssembly.validate = () => false;\n'
    )
    old = file.with_name("old.html")
    old.write_text(text)
    offline_page.goto(old.as_uri())
    offline_page.get_by_test_id("start").click()
    expect(offline_page.get_by_test_id("live-fault")).to_contain_text(
        "This browser does not support WebAssembly with SIMD"
    )


def test_runs_live_side_by_side_to_their_last_generation_and_any_world_of_theirs_plays(
    page: Page,
) -> None:
    start(page, runs=3)
    expect(page.get_by_test_id("live-state")).to_have_text("Done")
    expect(page.get_by_test_id("live-count")).to_have_text("3 of 3 generations")
    expect(page.get_by_test_id("live-fitness")).to_contain_text("mean of 3 runs with 95 % interval")
    page.get_by_test_id("live-run").select_option("2")
    expect(page.get_by_test_id("live-caption")).to_have_text("Generation 2")
    eaten = simulate(quick(presets.load("evo+self-taught/A")), seed=0, run=2).food_eaten[2]
    for _ in range(15):
        page.get_by_test_id("live-canvas").press("Shift+ArrowRight")
    expect(page.get_by_test_id("live-canvas-count")).to_have_text(
        f"{int(eaten.sum())} eaten · {int((eaten > 0).sum())} of 20 ate"
    )


def test_it_says_what_one_sees_at_the_first_visit_and_when_it_is_asked(page: Page) -> None:
    guide = page.get_by_test_id("guide")
    expect(guide).to_contain_text("evo+self-taught/A: the map")
    expect(guide).to_contain_text("20 agents are born in the dashed circle")
    page.get_by_test_id("close-guide").click()
    expect(guide).to_be_hidden()
    page.reload()
    expect(page.get_by_test_id("start")).to_be_visible()
    expect(guide).to_be_hidden()
    page.get_by_test_id("about").click()
    expect(guide).to_be_visible()
    expect(page.get_by_test_id("about")).to_have_attribute("aria-expanded", "true")


def test_each_run_can_be_shown_as_a_line_and_leads_to_its_world(page: Page) -> None:
    start(page, runs=3)
    expect(page.get_by_test_id("live-state")).to_have_text("Done")
    page.get_by_test_id("each-run").check()
    plot, told = (
        page.get_by_test_id("live-fitness").locator(where)
        for where in (".chart-plot", "[role=status]")
    )
    plot.press("End")
    best = {
        run: int(
            simulate(quick(presets.load("evo+self-taught/A")), seed=0, run=run).energy[2].max()
        )
        for run in range(3)
    }
    highest = max(best, key=lambda run: best[run])
    for _ in range(8):
        plot.press("ArrowUp")
    expect(told).to_have_text(f"best agent, run {highest}, generation 2: {brief(best[highest])}")
    plot.press("Home")
    while not re.match(r"best agent, run 1,", told.inner_text()):
        plot.press("ArrowUp")
    plot.press("Enter")
    expect(page.get_by_test_id("live-caption")).to_have_text("Generation 0")
    expect(page.get_by_test_id("live-run")).to_have_value("1")
    page.reload()
    expect(page.get_by_test_id("each-run")).to_be_checked()


def brief(number: int) -> str:
    """As a chart tells it."""
    return str(number) if number == 0 or number >= 100 else f"{number:.1f}"


def test_a_run_can_be_paused_and_lived_generation_by_generation(page: Page) -> None:
    start(
        page, runs=1, pace="5"
    )  # seconds a generation, so that it is not over before it can be paused
    page.get_by_test_id("pause").click()
    expect(page.get_by_test_id("live-state")).to_have_text("Paused")
    before = int(page.get_by_test_id("live-count").inner_text().split()[0])
    page.get_by_test_id("one-more").click()
    expect(page.get_by_test_id("live-count")).to_have_text(f"{before + 1} of 3 generations")
    page.get_by_test_id("pause").click()
    expect(page.get_by_test_id("live-state")).to_have_text("Done")


def test_a_run_stops_in_mid_life_and_another_begins(page: Page) -> None:
    page.get_by_test_id("group-lifetime").locator("summary").click()
    page.get_by_test_id("field-lifetime.steps").fill("100000000")
    start(page, runs=1)
    expect(page.get_by_test_id("live-state")).to_have_text("Running")
    page.get_by_test_id("stop").click()
    expect(page.get_by_test_id("live-state")).to_have_text("Stopped")
    expect(page.get_by_test_id("live-count")).to_have_text("0 of 3 generations")
    page.get_by_test_id("field-lifetime.steps").fill("100")
    page.get_by_test_id("start").click()
    expect(page.get_by_test_id("live-state")).to_have_text("Done")


def test_inside_an_agent_are_its_networks_and_its_kin(page: Page) -> None:
    start(page, runs=1)
    expect(page.get_by_test_id("live-state")).to_have_text("Done")
    expect(page.get_by_test_id("live-caption")).to_have_text("Generation 2")
    page.get_by_test_id("live-canvas-agent").select_option("4")
    expect(page.get_by_test_id("agent")).to_have_text("Agent 4")
    run = simulate(quick(presets.load("evo+self-taught/A")), seed=0)
    parents = list(dict.fromkeys(run.parents.values[2, 4].tolist()))
    expect(page.get_by_test_id("parent")).to_have_text([f"agent {parent}" for parent in parents])
    items = int(run.food_eaten[2, 4])
    expect(page.locator(".inspector header")).to_contain_text(f"{items} items eaten")
    assert find_violations(page) == []


def test_ancestors_are_listed_back_to_the_first_generation_and_each_opens_its_life(
    page: Page,
) -> None:
    page.set_viewport_size({"width": 390, "height": 844})
    start(page, runs=2)
    expect(page.get_by_test_id("live-state")).to_have_text("Done")
    page.get_by_test_id("live-run").select_option("1")
    expect(page.get_by_test_id("live-caption")).to_have_text("Generation 2")
    page.get_by_test_id("live-canvas-agent").select_option("4")
    page.get_by_test_id("ancestors-of").click()
    run = simulate(quick(presets.load("evo+self-taught/A")), seed=0, run=1)
    line = ancestor_line(2, 4, run.parents.values, run.food_eaten.values)
    rows = page.get_by_test_id("ancestors").locator("tbody tr")
    expect(rows).to_have_count(2)
    assert [
        [cell.text_content() for cell in row.locator("th, td").all()] for row in rows.all()
    ] == rows_of(line)
    assert find_violations(page) == []
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
    page.get_by_test_id("ancestor").last.click()
    expect(page.get_by_test_id("live-caption")).to_have_text("Generation 0")
    expect(page.get_by_test_id("ancestors")).to_contain_text(
        "This agent has no parents: its weights are random."
    )


def test_the_form_says_what_is_wrong_and_does_not_start(page: Page) -> None:
    page.get_by_test_id("group-learning").locator("summary").click()
    page.get_by_test_id("field-learning.rate").fill("11")
    expect(page.get_by_test_id("setup-fault")).to_contain_text(
        "learning.rate = 11: input should be less than or equal to 10"
    )
    expect(page.get_by_test_id("start")).to_be_disabled()


def test_a_link_brings_the_same_run_and_the_same_parameters(page: Page, file: Path) -> None:
    page.get_by_test_id("group-learning").locator("summary").click()
    page.get_by_test_id("field-learning.rate").fill("0.5")
    start(page, runs=1)
    expect(page.get_by_test_id("live-state")).to_have_text("Done")
    page.get_by_test_id("share").click()
    link = page.get_by_test_id("share-link").input_value()
    page.goto("about:blank")
    page.goto(link)
    expect(page.get_by_test_id("live-state")).to_have_text("Done")
    expect(page.get_by_test_id("field-learning.rate")).to_have_value("0.5")


def test_a_damaged_link_is_a_sentence(offline_page: Page, file: Path) -> None:
    offline_page.goto(f"{file.as_uri()}#/live?id=eyJleHBl")
    expect(offline_page.get_by_test_id("live-empty")).to_contain_text("This link is damaged")


def test_a_page_with_several_conditions_lives_the_one_that_is_chosen(
    offline_page: Page, file: Path
) -> None:
    both = [quick(presets.load(name)) for name in ("evo+self-taught/A", "evo/A")]
    path = file.with_name("both.html")
    path.write_bytes(live_page(both, seed=4))
    offline_page.goto(path.as_uri())
    offline_page.get_by_test_id("preset").select_option("evo/A")
    start(offline_page, runs=1)
    expect(offline_page.get_by_test_id("live-state")).to_have_text("Done")
    expect(offline_page.get_by_test_id("live-head")).to_contain_text("evo/A")
    expect(offline_page.get_by_test_id("live-head")).to_contain_text("seed 4")
    energy = bytes(
        offline_page.evaluate(SIMULATE, {"seed": 4, "experiment": {"name": "evo/A"}})["energy"]
    )
    assert energy == simulate(both[1], seed=4).energy.values.tobytes()


def test_on_a_phone_nothing_is_wider_than_the_screen(page: Page) -> None:
    page.set_viewport_size({"width": 360, "height": 740})
    start(page, runs=1)
    expect(page.get_by_test_id("live-state")).to_have_text("Done")
    assert page.evaluate("document.documentElement.scrollWidth") <= 360
