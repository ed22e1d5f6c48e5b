"""Tests of the reader's own map in the explorable: drawing, keyboard, link, command and bits."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, Page, expect

from baldwinlab.experiment import Experiment, assign
from baldwinlab.lab.pages import explorable
from baldwinlab.papers import presets
from baldwinlab.simulation.simulate import simulate
from tests.lab.client import read_box
from tests.lab.essays import STRINGS, open_essay, show


@pytest.fixture
def page(essay_page: Page) -> Page:
    return essay_page


def make_own_map() -> dict[str, Any]:
    return {
        "food": [[300, 400, 80, 240], [40, 120, 400, 500]],
        "wall": [[250, 270, 100, 140], [600, 640, 0, 640]],
        "poison": [[420, 500, 80, 240]],
        "learning": True,
        "rate": 0.02,
        "agents": 12,
        "mutation_rate": 5,
        "seed": 3,
    }


RUN_MAP = """async settings => {
  const { applyMap, adaptProgram } = await import("lab/explorable/map_settings.js");
  const { findProgram } = await import("lab/engine/program_table.js");
  const data = JSON.parse(document.getElementById("data").textContent);
  const { WorkerPool } = await import("lab/engine/worker_pool.js");
  const pool = new WorkerPool(document.getElementById("worker").textContent, []);
  const experiment = applyMap(data.scenes.map.experiment, settings);
  experiment.evolution.generations = 3;
  const program = adaptProgram(findProgram(data.programs, experiment), settings, experiment);
  const { food_eaten, energy } = await pool.simulate(program, experiment, settings.seed, 0);
  return [Array.from(food_eaten), Array.from(energy)];
}"""
FORMAT_COMMAND = """async settings =>
  (await import("lab/explorable/map_settings.js")).formatCommand(settings)"""


# Python compiles walls and patches, which takes half a minute.
@pytest.mark.parametrize(
    "changes",
    [
        pytest.param({"wall": [], "poison": []}, id="food only"),
        pytest.param({}, id="all shapes", marks=pytest.mark.nightly),
        pytest.param({"wall": []}, id="no wall", marks=pytest.mark.nightly),
        pytest.param(
            {"learning": False, "poison": []}, id="no learning", marks=pytest.mark.nightly
        ),
    ],
)
def test_the_command_of_a_map_gives_the_same_bits(page: Page, changes: dict[str, Any]) -> None:
    settings = make_own_map() | changes
    command = page.evaluate(FORMAT_COMMAND, settings)
    experiment = parse_command(command).replace(
        lifetime={"steps": explorable.STEPS}, evolution={"generations": 3}
    )
    run = simulate(experiment, seed=3, run=0)
    eaten, energy = page.evaluate(RUN_MAP, settings)
    assert energy == run.energy.values.ravel().tolist()
    assert sum(energy) > 0
    if not settings["poison"]:
        assert eaten == run.food_eaten.values.ravel().tolist()


def parse_command(command: str) -> Experiment:
    """Return the experiment of a command `baldwinlab run PRESET ... --set ASSIGNMENTS`."""
    words = shlex.split(command)
    assert words[:2] == ["baldwinlab", "run"]
    experiment = assign(presets.load(words[2]), words[words.index("--set") + 1 :])
    assert isinstance(experiment, Experiment)
    return experiment


def test_a_map_is_drawn_run_and_shared(browser: Browser, essay: Path) -> None:
    with open_essay(browser, essay) as page:
        section = show(page, "yours")
        box = read_box(section.locator("canvas").first)
        section.get_by_label("wall").check()
        page.mouse.move(box["x"] + box["width"] * 0.4, box["y"] + box["height"] * 0.4)
        page.mouse.down()
        page.mouse.move(box["x"] + box["width"] * 0.5, box["y"] + box["height"] * 0.6)
        page.mouse.up()
        expect(section.locator("pre")).to_contain_text("world.walls.boxes")
        section.get_by_role("button", name="Run").click()
        expect(section.locator("figcaption")).to_contain_text("Generation 1")
        section.get_by_role("button", name=STRINGS["editor"]["link"]).click()
        fragment = page.evaluate("location.hash")
        command = section.locator("pre").inner_text()
    with open_essay(browser, essay, fragment=fragment) as page:
        expect(page.locator("#yours pre")).to_have_text(command)
    with open_essay(browser, essay, fragment="#map=damaged") as page:
        expect(page.locator("#yours")).to_contain_text(STRINGS["editor"]["damaged"])


def test_the_keyboard_adds_moves_and_removes_shapes(page: Page) -> None:
    section = show(page, "yours")
    section.get_by_label("poison").check()
    section.get_by_role("button", name="Add poison").press("Enter")
    section.get_by_text(STRINGS["editor"]["shapes"]).click()
    poison = section.get_by_role("group", name="poison 1")
    poison.get_by_label("left").fill("100")
    poison.get_by_label("left").press("Enter")
    expect(section.locator("pre")).to_contain_text(
        "world.patches.patches=[[100,360,280,360,20,-1]]"
    )
    poison.get_by_role("button").press("Enter")
    expect(section.locator("pre")).not_to_contain_text("patches")


def test_a_wall_over_the_start_cannot_run(browser: Browser, essay: Path) -> None:
    settings = make_own_map() | {"wall": [[100, 220, 100, 220]]}
    with open_essay(browser, essay) as page:
        encode = "async s => (await import('lab/explorable/map_settings.js')).encodeMap(s)"
        fragment = "#map=" + page.evaluate(encode, settings)
    with open_essay(browser, essay, fragment=fragment) as page:
        section = page.locator("#yours")
        expect(section).to_contain_text(STRINGS["editor"]["covered"])
        expect(section.get_by_role("button", name="Run")).to_be_disabled()
