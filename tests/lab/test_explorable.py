"""Tests of the explorable in a browser: pictures, dials, questions, the own map, and its bits."""

from __future__ import annotations

import json
import re
import time
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest
from playwright.sync_api import Browser, Locator, Page, expect

from baldwinlab.analysis.theory.needle import balance_of_unset
from baldwinlab.experiment import Experiment, assign
from baldwinlab.lab.explorable import scenes
from baldwinlab.lab.explorable.page import (
    MAX_PAGE_BYTES,
    RECORDINGS_FILE,
    STRINGS_FILE,
    render_explorable,
)
from baldwinlab.papers import presets
from baldwinlab.simulation.simulate import simulate
from tests.axe import find_violations
from tests.commands import Command

STRINGS = tomllib.loads(STRINGS_FILE.read_text("utf-8"))
RECORDINGS = json.loads(RECORDINGS_FILE.read_text("utf-8"))
STEPS = [step["id"] for step in STRINGS["steps"]]
MAX_WORDS = 120
# Return the number of pixels of a canvas that differ from its first pixel.
COUNT_PIXELS = """canvas => {
  const { width, height } = canvas;
  const { data } = canvas.getContext("2d").getImageData(0, 0, width, height);
  const pixels = new Uint32Array(data.buffer);
  return pixels.filter(pixel => pixel !== pixels[0]).length;
}"""
READ_PICTURE = "canvas => canvas.toDataURL()"
SIMULATE = """async request => {
  const { food_eaten, genome } = await window.baldwinlab.simulate(request);
  return [Array.from(food_eaten), Array.from(new Uint8Array(genome.buffer))];
}"""


@pytest.fixture(scope="module")
def essay(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("explorable") / "baldwin.html"
    path.write_bytes(render_explorable())
    return path


@contextmanager
def open_essay(
    browser: Browser, essay: Path, width: int = 1280, height: int = 900, **options: Any
) -> Iterator[Page]:
    """Yield the page without a network. The test fails if it logs a message or makes a request."""
    script = options.pop("script", "")
    fragment = options.pop("fragment", "")
    context = browser.new_context(
        offline=True, viewport={"width": width, "height": height}, **options
    )
    page = context.new_page()
    page.add_init_script(script)
    messages = list[str]()
    requests = list[str]()
    page.on("console", lambda message: messages.append(message.text))
    page.on("pageerror", lambda error: messages.append(str(error)))
    page.on("request", lambda request: requests.append(request.url))
    page.goto(essay.as_uri() + fragment)
    yield page
    context.close()
    assert not messages
    assert not [url for url in requests if not url.startswith(("data:", "blob:", "file:"))]


@pytest.fixture
def page(browser: Browser, essay: Path) -> Iterator[Page]:
    with open_essay(browser, essay) as opened:
        yield opened


def show(page: Page, step: str) -> Locator:
    """Scroll to a step and return its section."""
    section = page.locator(f"#{step}")
    section.locator(".picture").evaluate("element => element.scrollIntoView({block: 'center'})")
    return section


def read_value(section: Locator, name: str) -> float:
    value = section.locator(f'[data-value="{name}"]')
    expect(value).to_have_text(re.compile(r"^[\d.]+"))
    return float(re.sub(r"[^\d.]", "", value.inner_text()))


def drag(section: Locator, dial: str, value: float) -> None:
    section.get_by_test_id(re.compile(f"-{dial}$")).fill(str(value))


def test_the_command_writes_one_small_file(command: Command, tmp_path: Path) -> None:
    out = tmp_path / "baldwin.html"
    assert command("explorable", "--out", str(out)).code == 0
    page = out.read_text("utf-8")
    assert len(page.encode()) <= MAX_PAGE_BYTES
    assert not re.findall(r'(?:src|href)="(?!data:)[^"]*"', page)
    out.write_text("mine", "utf-8")
    refused = command("explorable", "--out", str(out))
    assert refused.code != 0
    assert "was not written by this command" in refused.err
    assert out.read_text("utf-8") == "mine"


@pytest.mark.parametrize("step", STRINGS["steps"], ids=STEPS)
def test_a_step_is_short_and_has_a_question(step: dict[str, Any]) -> None:
    question = step["question"]
    texts = [step["title"], *step["text"], step["notice"], question["text"], *question["options"]]
    assert len(" ".join(texts).split()) <= MAX_WORDS
    assert 0 <= question["answer"] < len(question["options"])
    assert question["right"] and question["wrong"]


def test_the_texts_about_the_runs_are_true() -> None:
    last = slice(scenes.FORK_GENERATION - scenes.LAST_GENERATIONS, scenes.FORK_GENERATION)
    curves = {name: np.array(runs) for name, runs in RECORDINGS["curves"].items()}
    means = {name: curve[:, last].mean(axis=1) for name, curve in curves.items()}
    assert all(len(runs) == scenes.RUNS for runs in means.values())
    # Step 4: learners are ahead in each of the runs, and in the mean after a few generations.
    assert (means["learning"] > 2 * means["alone"]).all()
    assert (curves["learning"].mean(axis=0) > curves["alone"].mean(axis=0))[5:].all()
    # Step 5: noise helps a little, and learning helps more.
    for control in ("random", "yoked"):
        assert means["alone"].mean() < means[control].mean() < means["learning"].mean()
    # Step 6: the skill disappears at the fork and does not return.
    forked = curves["forked"][:, scenes.FORK_GENERATION :]
    assert (forked < means["learning"][:, None] / 2).all()
    assert forked[:, -scenes.LAST_GENERATIONS :].mean() < means["alone"].mean()


def test_the_texts_about_the_needle_are_true() -> None:
    # [cost, period]
    shares = np.array(RECORDINGS["needle"]).mean(axis=2)
    assert (np.diff(shares[:, [0, -1]], axis=1) < 0).all(), "more stays open if the target changes"
    assert (np.diff(shares[[0, -1]], axis=0) < 0).all(), "less stays open if guesses cost more"
    theory = [
        [balance_of_unset(cost_of_trials=cost, period=period) for period in scenes.NEEDLE_PERIODS]
        for cost in scenes.NEEDLE_COSTS
    ]
    assert np.abs(shares - theory).max() < 0.1
    assert np.abs(shares - theory).mean() < 0.04


def test_a_recorded_curve_is_that_of_the_engine() -> None:
    run = simulate(scenes.make_scenes()["alone"], seed=scenes.SEED, run=1)
    recorded = RECORDINGS["curves"]["alone"][1]
    assert run.food_eaten.mean("agent").values.tolist() == recorded


@pytest.mark.nightly
def test_all_recordings_are_those_of_the_engine() -> None:
    from scripts.explorable_recordings import make_recordings

    message = "run `python -m scripts.explorable_recordings`"
    assert json.loads(json.dumps(make_recordings())) == RECORDINGS, message


def test_an_agent_moves_and_eats_soon_after_opening(browser: Browser, essay: Path) -> None:
    start = time.monotonic()
    with open_essay(browser, essay, 390, 844) as page:
        canvas = page.locator("#agent canvas")
        picture = canvas.evaluate(READ_PICTURE)
        page.wait_for_function(
            "picture => document.querySelector('#agent canvas').toDataURL() !== picture",
            arg=picture,
        )
        # 1.5 s on an idle machine. Tests share their machine.
        assert time.monotonic() - start < 5
        expect(page.locator('[data-value="ring_items"]')).not_to_have_text(re.compile("^[…0]$"))


@pytest.mark.parametrize("scene", ["alone", "learning", "random"])
def test_a_live_run_is_bit_identical_to_python(page: Page, scene: str) -> None:
    changes = {"evolution.generations": 3, "lifetime.steps": 400}
    experiment = assign(
        scenes.make_scenes()[scene], [f"{path}={value}" for path, value in changes.items()]
    )
    run = simulate(experiment, seed=scenes.SEED, run=2)
    food, genome = page.evaluate(SIMULATE, {"scene": scene, "changes": changes, "run": 2})
    assert food == run.food_eaten.values.ravel().tolist()
    assert sum(food) > 0
    assert bytes(genome) == run.genome.values.tobytes()


def test_the_curves_are_those_of_the_engine(page: Page) -> None:
    section = show(page, "both")
    drag(section, "runs", 1)
    expect(section.locator(".play")).to_have_text("Start again", timeout=60_000)
    last = scenes.FORK_GENERATION - 1
    for name in ("alone", "learning"):
        expected = RECORDINGS["curves"][name][0][last]
        assert read_value(section, name) == pytest.approx(expected, rel=0.01)


def test_the_fork_continues_as_a_schedule_does(page: Page) -> None:
    section = show(page, "innate")
    expect(section.locator(".play")).to_have_text("Start again", timeout=90_000)
    forked = np.array(RECORDINGS["curves"]["forked"]).mean(axis=0)
    expected = {
        "before": forked[scenes.FORK_GENERATION - 1],
        "after": forked[scenes.FORK_GENERATION],
        "learning": forked[-scenes.LAST_GENERATIONS :].mean(),
    }
    for name, value in expected.items():
        assert read_value(section, name) == pytest.approx(value, rel=0.01)


THEORY_SETTINGS = ("loci", "trials", "cost", "mutationRate", "period", "redrawnLoci")
THEORY_CASES = (
    (20, 1000, 1.0, 0.01, 10, 2),
    (20, 1000, 0.25, 0.01, 2, 2),
    (20, 1000, 2.0, 0.01, 100, 2),
    (12, 300, 0.7, 0.03, 7, 3),
    (20, 1000, 0.0, 0.01, 5, 2),
    (20, 1000, 1.0, 0.0, 20, 1),
)


def test_the_theory_in_the_page_is_that_of_python(page: Page) -> None:
    compute = """async settings => {
      const { computeBalance } = await import("lab/explorable/needle_theory.js");
      return settings.map(computeBalance);
    }"""
    settings = [dict(zip(THEORY_SETTINGS, case, strict=True)) for case in THEORY_CASES]
    # The order of the settings is that of the arguments.
    expected = [balance_of_unset(*case) for case in THEORY_CASES]
    assert page.evaluate(compute, settings) == pytest.approx(expected, abs=1e-9)


def test_the_line_and_the_points_follow_the_dials(page: Page) -> None:
    section = show(page, "needle")
    line = section.locator("polyline")
    before = line.get_attribute("points")
    share = read_value(section, "theory")
    drag(section, "cost", 0)
    expect(line).not_to_have_attribute("points", before or "")
    assert read_value(section, "theory") > share
    period = section.get_by_role("slider", name=STRINGS["dials"]["period"])
    period.focus()
    page.keyboard.press("Home")
    expect(period).to_have_attribute("aria-valuetext", str(scenes.NEEDLE_PERIODS[0]))


def test_learning_on_and_off_start_equal_and_end_apart(page: Page) -> None:
    section = show(page, "learning")
    expect(section.locator('[data-value="on"]')).not_to_have_text("…")
    page.wait_for_function(
        """() => Number(document.querySelector('#learning [data-value="on"]').textContent) >
          100 + Number(document.querySelector('#learning [data-value="off"]').textContent)"""
    )


def test_a_question_gives_feedback(page: Page) -> None:
    question = page.get_by_role("group", name=STRINGS["steps"][0]["question"]["text"])
    feedback = question.get_by_role("status")
    options = STRINGS["steps"][0]["question"]["options"]
    question.get_by_label(options[0]).check()
    expect(feedback).to_have_text(STRINGS["steps"][0]["question"]["wrong"])
    page.keyboard.press("ArrowDown")
    expect(feedback).to_have_text(STRINGS["steps"][0]["question"]["right"])


def test_only_the_picture_in_sight_plays(page: Page) -> None:
    canvas = page.locator("#agent canvas")
    expect(page.locator("#agent .play")).to_have_text("Pause")
    show(page, "needle")
    page.wait_for_timeout(300)
    picture = canvas.evaluate(READ_PICTURE)
    page.wait_for_timeout(500)
    assert canvas.evaluate(READ_PICTURE) == picture


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
  const { findProgram } = await import("lab/program_table.js");
  const data = JSON.parse(document.getElementById("data").textContent);
  const { WorkerPool } = await import("lab/worker_pool.js");
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
        lifetime={"steps": scenes.STEPS}, evolution={"generations": 3}
    )
    run = simulate(experiment, seed=3, run=0)
    eaten, energy = page.evaluate(RUN_MAP, settings)
    assert energy == run.energy.values.ravel().tolist()
    assert sum(energy) > 0
    if not settings["poison"]:
        assert eaten == run.food_eaten.values.ravel().tolist()


def parse_command(command: str) -> Experiment:
    """Return the experiment of a command `baldwinlab run PRESET ... --set ASSIGNMENTS`."""
    import shlex

    words = shlex.split(command)
    assert words[:2] == ["baldwinlab", "run"]
    experiment = assign(presets.load(words[2]), words[words.index("--set") + 1 :])
    assert isinstance(experiment, Experiment)
    return experiment


def test_a_map_is_drawn_run_and_shared(browser: Browser, essay: Path) -> None:
    with open_essay(browser, essay) as page:
        section = show(page, "yours")
        box = section.locator("canvas").first.bounding_box()
        assert box is not None
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


def test_reduced_motion_shows_still_pictures_with_a_play_button(
    browser: Browser, essay: Path
) -> None:
    with open_essay(browser, essay, reduced_motion="reduce") as page:
        canvas = page.locator("#agent canvas")
        expect(page.locator("#agent .play")).to_have_text("Play")
        expect(page.locator('#both [data-value="learning"]')).not_to_have_text("…")
        picture = canvas.evaluate(READ_PICTURE)
        page.wait_for_timeout(500)
        assert canvas.evaluate(READ_PICTURE) == picture
        page.locator("#agent .play").click()
        page.wait_for_function(
            "picture => document.querySelector('#agent canvas').toDataURL() !== picture",
            arg=picture,
        )


def test_without_webassembly_the_page_shows_recorded_runs(browser: Browser, essay: Path) -> None:
    with open_essay(browser, essay, script="delete globalThis.WebAssembly") as page:
        expect(page.get_by_text(STRINGS["page"]["no_engine"])).to_be_visible()
        section = show(page, "both")
        expect(section.locator(".play")).to_have_text("Start again")
        expected = np.mean(
            [run[scenes.FORK_GENERATION - 1] for run in RECORDINGS["curves"]["learning"]]
        )
        assert read_value(section, "learning") == pytest.approx(expected, rel=0.01)
        expect(page.locator("#both input[type=range]").first).to_be_disabled()


def test_without_scripts_the_texts_are_readable(browser: Browser, essay: Path) -> None:
    with open_essay(browser, essay, java_script_enabled=False) as page:
        for step in STRINGS["steps"]:
            expect(page.get_by_text(step["notice"])).to_be_visible()


@pytest.mark.parametrize("width", [320, 390, 768, 1280, 1920, 3840])
def test_the_page_fits_its_window(browser: Browser, essay: Path, width: int) -> None:
    with open_essay(browser, essay, width, reduced_motion="reduce") as page:
        expect(page.locator('#both [data-value="learning"]')).not_to_have_text("…")
        assert page.evaluate("document.documentElement.scrollWidth") <= width
        canvas = page.locator("#agent canvas").bounding_box()
        assert canvas is not None
        assert canvas["width"] >= 0.4 * min(width, 1920) - 30


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_the_page_has_no_barriers(
    browser: Browser, essay: Path, scheme: Literal["light", "dark"]
) -> None:
    with open_essay(browser, essay, color_scheme=scheme, reduced_motion="reduce") as page:
        expect(page.locator('#both [data-value="learning"]')).not_to_have_text("…")
        page.locator("#yours summary").click()
        assert find_violations(page) == []


def test_the_printed_page_contains_the_pictures(browser: Browser, essay: Path) -> None:
    with open_essay(browser, essay) as page:
        assert page.pdf(format="A4").startswith(b"%PDF")
        for step in ("agent", "evolution", "learning", "both", "controls", "innate"):
            canvas = page.locator(f"#{step} canvas").first
            assert canvas.evaluate(COUNT_PIXELS) > 100, step
