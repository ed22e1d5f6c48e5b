"""Tests of an exported page: its simulations are bit-identical to Python, and its controls work."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Error, Page, expect

from baldwinlab import papers
from baldwinlab.experiment import Experiment
from baldwinlab.experiment.added_parts import added_choices
from baldwinlab.lab.pages.export import render_live_page
from baldwinlab.papers import presets
from baldwinlab.papers.paper import STANDARD_VARIANT
from baldwinlab.simulation.simulate import simulate
from tests.axe import find_violations
from tests.lab.test_page_live import count_generations

TYPES = {"food_eaten": np.int32, "energy": np.float64, "parents": np.int32, "genome": np.float32}
# Return the bytes of each array of a run.
SIMULATE = """async (request) => {
  const arrays = await window.baldwinlab.simulate(request);
  const bytes = array => Array.from(new Uint8Array(array.buffer));
  const entries = Object.entries(arrays).map(([name, array]) => [name, bytes(array)]);
  return Object.fromEntries(entries);
}"""


def shorten(experiment: Experiment, **changes: Any) -> Experiment:
    """Return an experiment with short lifetimes that start near food, so that agents eat."""
    food = experiment.world.food[0]
    start = {"x": food.x[0], "y": sum(food.y) / 2}
    return experiment.replace(
        lifetime={"steps": 150}, evolution={"generations": 3}, world={"start": start}
    ).replace(**changes)


def all_presets() -> list[Experiment]:
    """Return the presets of the packaged modules, and the variants of `evo+self-taught/A`."""
    paper = papers.load()
    variants = [variant for variant in paper.names("variants") if variant != STANDARD_VARIANT]
    experiments = [
        *map(paper.experiment, paper.experiment_names()),
        *(paper.experiment("evo+self-taught/A", variant) for variant in variants),
    ]
    return [experiment for experiment in experiments if not list(added_choices(experiment))]


@pytest.fixture(scope="module")
def exported_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Export a page with one condition."""
    path = tmp_path_factory.mktemp("export") / "laboratory.html"
    path.write_bytes(render_live_page([shorten(presets.load("evo+self-taught/A"))]))
    return path


@pytest.fixture
def page(offline_page: Page, exported_file: Path) -> Page:
    offline_page.goto(exported_file.as_uri())
    offline_page.get_by_test_id("start").wait_for()
    return offline_page


def test_an_embedded_page_plays_without_a_press_and_only_in_sight(
    offline_page: Page, exported_file: Path
) -> None:
    host = exported_file.parent / "host.html"
    frame = f'<iframe src="{exported_file.name}" width="900" height="700"></iframe>'
    host.write_text(f'<div style="height: 3000px"></div>{frame}<div style="height: 3000px"></div>')
    offline_page.goto(host.as_uri())
    laboratory = offline_page.frame_locator("iframe")
    play = laboratory.get_by_test_id("contrast-play")
    expect(play).to_have_attribute("aria-label", "Play")
    offline_page.locator("iframe").scroll_into_view_if_needed()
    expect(play).to_have_attribute("aria-label", "Pause")
    offline_page.evaluate("scrollTo(0, 0)")
    expect(play).to_have_attribute("aria-label", "Play")
    # A pause of the reader remains.
    offline_page.locator("iframe").scroll_into_view_if_needed()
    expect(play).to_have_attribute("aria-label", "Pause")
    play.click()
    offline_page.evaluate("scrollTo(0, 0)")
    offline_page.locator("iframe").scroll_into_view_if_needed()
    expect(play).to_have_attribute("aria-label", "Play")


def start_run(page: Page, runs: int = 2, pace: str = "0") -> None:
    page.get_by_test_id("setup-runs").fill(str(runs))
    page.get_by_test_id("pace").select_option(pace)
    page.get_by_test_id("start").click()


def is_bit_identical(page: Page, experiment: Experiment, seed: int, run: int) -> bool:
    expected = simulate(experiment, seed=seed, run=run)
    actual = page.evaluate(SIMULATE, {"seed": seed, "run": run, "experiment": experiment.to_dict()})
    assert expected.food_eaten.sum() > 0, experiment.name
    return {name: bytes(actual[name]) for name in TYPES} == {
        name: expected[name].values.tobytes() for name in TYPES
    }


@pytest.mark.nightly
def test_every_preset_is_bit_identical_to_python(page: Page) -> None:
    require_bit_identical(page, all_presets())


def test_a_preset_of_each_learner_is_bit_identical_to_python(page: Page) -> None:
    require_bit_identical(page, [presets.load(name) for name in ("evo/A", "evo+self-taught/B")])


def require_bit_identical(page: Page, experiments: list[Experiment]) -> None:
    for number, experiment in enumerate(experiments):
        assert is_bit_identical(page, shorten(experiment), seed=3 + number, run=number % 4), (
            experiment.name,
            number,
        )


def test_other_settings_are_bit_identical_to_python(page: Page) -> None:
    near = {"x": [380, 420], "y": [120, 200], "count": 400}
    far = {"x": [0, 640], "y": [500, 640], "count": 30, "energy": 2.5}
    changes: list[dict[str, Any]] = [
        # The engine stores items in cells. Agents sense them across all edges of the map.
        {"world": {"food": [near, far]}, "senses": {"visual_radius": 8}},
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
        experiment = shorten(presets.load("evo+self-taught/A"), **change)
        if experiment.world.food:
            assert is_bit_identical(page, experiment, seed=7, run=number), change
        else:
            request = {"seed": 7, "experiment": experiment.to_dict()}
            genome = bytes(page.evaluate(SIMULATE, request)["genome"])
            assert genome == simulate(experiment, seed=7).genome.values.tobytes()


def test_missing_settings_are_those_of_the_page(page: Page, exported_file: Path) -> None:
    experiment = shorten(presets.load("evo+self-taught/A"), learning={"rate": 0.05})
    request = {"seed": 2, "generations": 2, "experiment": {"learning": {"rate": 0.05}}}
    energy = bytes(page.evaluate(SIMULATE, request)["energy"])
    expected = simulate(experiment.replace(evolution={"generations": 2}), seed=2)
    assert energy == expected.energy.values.tobytes()


@pytest.mark.parametrize(
    ("request_data", "message"),
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
            "lifetime.step: there is no such field; there are: steps, repeats, update",
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
def test_an_invalid_request_of_a_script_is_rejected_with_a_message(
    page: Page, request_data: dict[str, Any], message: str
) -> None:
    with pytest.raises(Error, match=re.escape(message)):
        page.evaluate(SIMULATE, request_data)


def test_insufficient_memory_shows_a_message(page: Page) -> None:
    huge = {"population": {"size": 1_000_000}, "network": {"hidden": [1000, 1000]}}
    with pytest.raises(
        Error, match="The browser did not provide enough memory for this experiment"
    ):
        page.evaluate(SIMULATE, {"seed": 1, "experiment": huge})


def test_a_browser_without_simd_shows_a_message(offline_page: Page, exported_file: Path) -> None:
    text = exported_file.read_text(encoding="utf-8").replace(
        'id="worker">', 'id="worker">WebAssembly.validate = () => false;\n'
    )
    old = exported_file.with_name("old.html")
    old.write_text(text)
    offline_page.goto(old.as_uri())
    offline_page.get_by_test_id("start").click()
    expect(offline_page.get_by_test_id("live-fault")).to_contain_text(
        "This browser does not support WebAssembly with SIMD"
    )


@pytest.mark.nightly
def test_simultaneous_runs_end_and_the_world_of_every_run_plays(
    page: Page,
) -> None:
    start_run(page, runs=3)
    expect(page.get_by_test_id("live-state")).to_have_text("Done")
    expect(page.get_by_test_id("live-count")).to_have_text("3 of 3 generations")
    expect(page.get_by_test_id("live-fitness")).to_contain_text("mean of 3 runs with 95 % interval")
    page.get_by_test_id("live-run").select_option("2")
    expect(page.get_by_test_id("live-caption")).to_have_text("Generation 2")
    eaten = simulate(shorten(presets.load("evo+self-taught/A")), seed=0, run=2).food_eaten[2]
    for _ in range(15):
        page.get_by_test_id("live-canvas").press("Shift+ArrowRight")
    expect(page.get_by_test_id("live-canvas-count")).to_have_text(
        f"{int(eaten.sum())} eaten · {int((eaten > 0).sum())} of 20 ate"
    )


@pytest.mark.nightly
def test_the_guide_describes_the_preset(page: Page) -> None:
    page.get_by_test_id("about").click()
    expect(page.get_by_test_id("about")).to_have_attribute("aria-expanded", "true")
    guide = page.get_by_test_id("guide")
    guide.locator("summary").click()
    expect(guide).to_contain_text("evo+self-taught/A: the map")
    expect(guide).to_contain_text("20 agents are born in the dashed circle")


@pytest.mark.nightly
def test_each_run_is_a_line_that_opens_its_world(page: Page) -> None:
    start_run(page, runs=3)
    expect(page.get_by_test_id("live-state")).to_have_text("Done")
    page.get_by_test_id("each-run").check()
    chart = page.get_by_test_id("live-fitness")
    plot = chart.locator(".chart-plot")
    status = chart.locator("[role=status]")
    plot.press("End")
    experiment = shorten(presets.load("evo+self-taught/A"))
    best = [int(simulate(experiment, seed=0, run=run).energy[2].max()) for run in range(3)]
    highest = best.index(max(best))
    for _ in range(8):
        plot.press("ArrowUp")
    expect(status).to_have_text(f"best agent, run {highest}, generation 2: {best[highest]}")
    plot.press("Home")
    while not re.match(r"best agent, run 1,", status.inner_text()):
        plot.press("ArrowUp")
    plot.press("Enter")
    expect(page.get_by_test_id("live-caption")).to_have_text("Generation 0")
    expect(page.get_by_test_id("live-run")).to_have_value("1")
    # The page writes its state to the address after at most 400 ms.
    expect(page).to_have_url(re.compile("lines=each"))
    page.reload()
    expect(page.get_by_test_id("each-run")).to_be_checked()


@pytest.mark.nightly
def test_a_paused_run_continues_generation_by_generation(page: Page) -> None:
    # A generation takes 5 seconds, so that the test can pause the run before its end.
    start_run(page, runs=1, pace="5")
    page.get_by_test_id("pause").click()
    expect(page.get_by_test_id("live-state")).to_have_text("Paused")
    before = count_generations(page)
    page.get_by_test_id("one-more").click()
    expect(page.get_by_test_id("live-count")).to_have_text(f"{before + 1} of 3 generations")
    page.get_by_test_id("pause").click()
    expect(page.get_by_test_id("live-state")).to_have_text("Done")


def test_a_run_stops_during_a_lifetime_and_a_new_run_starts(page: Page) -> None:
    page.get_by_test_id("group-lifetime").locator("summary").click()
    page.get_by_test_id("field-lifetime.steps").fill("100000000")
    start_run(page, runs=1)
    expect(page.get_by_test_id("live-state")).to_have_text("Running")
    page.get_by_test_id("stop").click()
    expect(page.get_by_test_id("live-state")).to_have_text("Stopped")
    expect(page.get_by_test_id("live-count")).to_have_text("0 of 3 generations")
    page.get_by_test_id("field-lifetime.steps").fill("100")
    page.get_by_test_id("start").click()
    expect(page.get_by_test_id("live-state")).to_have_text("Done")


def test_a_selected_agent_is_marked_without_an_inspector(page: Page) -> None:
    start_run(page, runs=1)
    expect(page.get_by_test_id("live-state")).to_have_text("Done")
    expect(page.get_by_test_id("live-caption")).to_have_text("Generation 2")
    page.get_by_test_id("live-canvas-agent").select_option("4")
    expect(page.get_by_test_id("live-canvas-facts")).to_contain_text("Agent 4: ")
    expect(page.locator(".inspector")).to_have_count(0)
    assert find_violations(page) == []


def test_an_invalid_form_shows_a_message_and_disables_start(page: Page) -> None:
    page.get_by_test_id("group-learning").locator("summary").click()
    page.get_by_test_id("field-learning.rate").fill("11")
    expect(page.get_by_test_id("setup-fault")).to_contain_text(
        "learning.rate = 11: input should be less than or equal to 10"
    )
    expect(page.get_by_test_id("start")).to_be_disabled()


def test_a_link_reopens_the_run_with_its_settings(page: Page, exported_file: Path) -> None:
    page.get_by_test_id("group-learning").locator("summary").click()
    page.get_by_test_id("field-learning.rate").fill("0.5")
    start_run(page, runs=1)
    expect(page.get_by_test_id("live-state")).to_have_text("Done")
    page.get_by_test_id("share").click()
    link = page.get_by_test_id("share-link").input_value()
    page.goto("about:blank")
    page.goto(link)
    expect(page.get_by_test_id("live-state")).to_have_text("Done")
    expect(page.get_by_test_id("field-learning.rate")).to_have_value("0.5")


def test_an_earlier_run_stays_in_the_chart_under_a_name_with_its_changes(page: Page) -> None:
    start_run(page, runs=1)
    expect(page.get_by_test_id("live-state")).to_have_text("Done")
    page.get_by_test_id("field-learning.rule").select_option("none")
    page.get_by_test_id("start").click()
    head = page.get_by_test_id("live-head")
    expect(head.locator("h1")).to_have_text("evo+self-taught/A, rule: none")
    expect(page.get_by_test_id("live-fitness")).to_contain_text("evo+self-taught/A, seed 0")


def test_a_damaged_link_shows_a_message(offline_page: Page, exported_file: Path) -> None:
    offline_page.goto(f"{exported_file.as_uri()}#/live?id=eyJleHBl")
    expect(offline_page.get_by_test_id("live-empty")).to_contain_text("This link is damaged")


def test_a_page_with_several_conditions_simulates_the_selected_one(
    offline_page: Page, exported_file: Path
) -> None:
    experiments = [shorten(presets.load(name)) for name in ("evo+self-taught/A", "evo/A")]
    path = exported_file.with_name("both.html")
    path.write_bytes(render_live_page(experiments, seed=4))
    offline_page.goto(path.as_uri())
    offline_page.get_by_test_id("preset").select_option("evo/A")
    start_run(offline_page, runs=1)
    expect(offline_page.get_by_test_id("live-state")).to_have_text("Done")
    expect(offline_page.get_by_test_id("live-head")).to_contain_text("evo/A")
    expect(offline_page.get_by_test_id("live-head")).to_contain_text("seed 4")
    request = {"seed": 4, "experiment": {"name": "evo/A"}}
    energy = bytes(offline_page.evaluate(SIMULATE, request)["energy"])
    assert energy == simulate(experiments[1], seed=4).energy.values.tobytes()


def test_the_page_is_not_wider_than_a_phone(page: Page) -> None:
    page.set_viewport_size({"width": 360, "height": 740})
    start_run(page, runs=1)
    expect(page.get_by_test_id("live-state")).to_have_text("Done")
    assert page.evaluate("document.documentElement.scrollWidth") <= 360
