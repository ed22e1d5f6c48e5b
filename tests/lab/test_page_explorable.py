"""Tests of the explorable in a browser: its pictures, the reader's own map, and a translation."""

from __future__ import annotations

import re
import shlex
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest
import tomlkit
from playwright.sync_api import Browser, Locator, Page, expect

from baldwinlab.experiment import Experiment, assign
from baldwinlab.lab.pages import explorable
from baldwinlab.lab.pages.explorable import STRINGS_FILE, render_explorable
from baldwinlab.papers import presets
from baldwinlab.simulation.simulate import simulate
from tests.axe import find_violations
from tests.lab.client import draw_frames, read_box, repeat_until
from tests.lab.essays import RECORDINGS, STRINGS, drag, open_essay, read_value, show

# Return the number of pixels of a canvas that differ from its first pixel.
COUNT_PIXELS = """canvas => {
  const { width, height } = canvas;
  const { data } = canvas.getContext("2d").getImageData(0, 0, width, height);
  const pixels = new Uint32Array(data.buffer);
  return pixels.filter(pixel => pixel !== pixels[0]).length;
}"""
READ_PICTURE = "canvas => canvas.toDataURL()"


@pytest.fixture
def page(browser: Browser, essay: Path) -> Iterator[Page]:
    """Yield the explorable in a browser without a network."""
    with open_essay(browser, essay) as opened:
        yield opened


def test_an_agent_moves_and_eats_without_a_click(browser: Browser, essay: Path) -> None:
    with open_essay(browser, essay, 390, 844) as page:
        canvas = page.locator("#agent canvas")
        picture = canvas.evaluate(READ_PICTURE)
        page.wait_for_function(
            "picture => document.querySelector('#agent canvas').toDataURL() !== picture",
            arg=picture,
        )
        expect(page.locator('[data-value="ring_items"]')).not_to_have_text(re.compile("^[…0]$"))


SHARE_IN_REGION = """async name => {
  const { RecordedSource } = await import("lab/explorable/source.js");
  const data = JSON.parse(document.getElementById("data").textContent);
  const [left, right, upper, lower] = data.region;
  const { arrays: { x, y } } = await new RecordedSource(data).loadLife(name);
  const inside = x.filter((value, index) =>
    value >= left && value <= right && y[index] >= upper && y[index] <= lower);
  return inside.length / x.length;
}"""


def test_maps_show_the_part_with_the_agents(page: Page) -> None:
    """Steps 1 and 2 have the same part of the map, and the reader draws on all of it."""
    for name in ("learning", "alone"):
        assert page.evaluate(SHARE_IN_REGION, name) > 0.98
    _, right, _, lower = explorable.REGION
    shapes = {"agent": right / lower, "evolution": right / lower, "yours": 1}
    for step, shape in shapes.items():
        box = read_box(page.locator(f"#{step} canvas").first)
        assert box["width"] / box["height"] == pytest.approx(shape, rel=0.02)
    width = explorable.make_scenes()["learning"].world.width
    expect(page.locator("#agent figcaption")).to_contain_text(f"{width:g} units")


COLORS = """names => names.map((name) =>
  getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim())"""


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_a_color_has_one_meaning(
    browser: Browser, essay: Path, scheme: Literal["light", "dark"]
) -> None:
    with open_essay(browser, essay, color_scheme=scheme) as page:
        meanings = [*explorable.MEANINGS[:-1], "good", "poison", "text"]
        colors = dict(zip(meanings, page.evaluate(COLORS, meanings), strict=True))
        assert len(set(colors.values())) == len(colors)
        # Sensed food, agents, walls and poison of the maps.
        maps = page.evaluate(COLORS, ["lit", "agent", "gray", "vermilion"])
        assert maps == [colors[name] for name in ("good", "text", "text", "poison")]


def test_the_puzzle_shows_its_end_and_keeps_earlier_runs(page: Page) -> None:
    section = show(page, "puzzle")
    button = section.get_by_role("button", name=STRINGS["labels"]["end"])
    button.click()
    expect(section.locator(".play")).to_have_text("Start again")
    assert read_value(section, "generation") == explorable.PUZZLE_GENERATIONS - 1
    assert read_value(section, "right") > read_value(section, "open") + 30
    assert section.locator("canvas").evaluate(COUNT_PIXELS) > 100
    expect(section.locator(".earlier")).to_have_count(0)
    # Without guesses, nothing happens. The run before is still visible, as pale lines.
    drag(section, "trials", 0)
    expect(section.locator('[data-value="run"]')).to_have_text("2")
    expect(section.locator(".earlier")).to_have_count(4)
    button.click()
    expect(section.locator(".play")).to_have_text("Start again")
    assert read_value(section, "right") < 35


# Return pairs of labels of a chart that overlap. The box of a text is higher than its letters.
LIST_OVERLAPS = """svg => {
  const labels = [...svg.querySelectorAll(".direct-label, .run-label")];
  const boxes = labels.map(label => label.getBoundingClientRect());
  const overlap = (a, b) => a.left < b.right && b.left < a.right
    && a.top + 4 < b.bottom && b.top + 4 < a.bottom;
  return boxes.flatMap((box, index) => boxes.slice(0, index)
    .filter(other => overlap(box, other)).map(() => labels[index].textContent));
}"""


def finish_run(section: Locator) -> None:
    """Show the end of the run, unless it has ended."""
    end = section.get_by_role("button", name=STRINGS["labels"]["end"])
    end.evaluate("button => button.click()")
    expect(section.locator(".play")).to_have_text(STRINGS["labels"]["restart"])
    # Charts are drawn in the next frame.
    draw_frames(section.page)


def change_run(section: Locator, dial: str, value: float, run: int) -> None:
    """Change a dial, and show the end of the run of this number that then starts."""
    drag(section, dial, value)
    expect(section.locator('[data-value="run"]')).to_have_text(str(run))
    finish_run(section)


def test_pale_lines_name_how_their_runs_differ_from_the_current_one(page: Page) -> None:
    section = show(page, "changing")
    finish_run(section)
    labels = section.locator(".run-label")
    change_run(section, "cost", 0, run=2)
    expect(labels).to_have_text(["cost 1"])
    change_run(section, "period", 6, run=3)
    assert sorted(labels.all_text_contents()) == [
        "change every 10",
        "change every 10",
        "cost 1",
    ]
    chart = section.locator("svg.trend")
    description = chart.get_attribute("aria-label") or ""
    assert re.search(
        r"\. cost 1, change every 10: open [\d.]+\. change every 10: open", description
    )
    # Runs with equal settings differ in their random numbers, so labels are their numbers.
    section.locator(".play").click()
    expect(section.locator('[data-value="run"]')).to_have_text("4")
    finish_run(section)
    expect(labels.filter(has_text="run 3")).to_have_count(1)


@pytest.mark.parametrize(("width", "height"), [(390, 844), (844, 390), (1280, 900)])
def test_labels_of_runs_are_readable_in_every_window(
    browser: Browser, essay: Path, width: int, height: int
) -> None:
    with open_essay(browser, essay, width, height) as page:
        section = show(page, "puzzle")
        finish_run(section)
        for run, trials in enumerate([0, 1, 3], 2):
            change_run(section, "trials", trials, run)
        charts = section.locator("svg.trend")
        for chart in charts.all():
            assert chart.evaluate(LIST_OVERLAPS) == []
            # The labels of the newest earlier run.
            assert "100 guesses" in chart.locator(".run-label").all_text_contents()
            box = read_box(chart)
            for label in chart.locator(".run-label").all():
                label_box = read_box(label)
                assert label_box["x"] >= box["x"]
                assert label_box["x"] + label_box["width"] <= box["x"] + box["width"]
        assert page.evaluate(SMALLEST_TEXT) >= 11
        page.emulate_media(media="print")
        assert page.evaluate(SMALLEST_TEXT) >= 11


# Hold the result of generation 4 of the next run with another learning rate until `release`.
HOLD_GENERATION = """async () => {
  const { LiveSource } = await import("lab/explorable/source.js");
  const { start } = LiveSource.prototype;
  window.held = new Promise(show => {
    window.release = show;
    LiveSource.prototype.start = async function (scene, changes, runs) {
      const population = await start.call(this, scene, changes, runs);
      if (!("learning.rate" in changes)) return population;
      LiveSource.prototype.start = start;
      const next = population.next.bind(population);
      population.next = async () => {
        const means = await next();
        if (population.generation === 5) {
          document.documentElement.dataset.held = "";
          await window.held;
        }
        return means;
      };
      return population;
    };
  });
}"""


def test_a_generation_of_a_replaced_run_is_not_in_the_chart_of_the_next(page: Page) -> None:
    section = show(page, "foragers")
    page.evaluate(HOLD_GENERATION)
    drag(section, "rate", 0.05)
    expect(page.locator("html[data-held]")).to_be_attached()
    drag(section, "fork", 20)
    # The next run has begun.
    expect(section.locator(".run-label").filter(has_text="off at 60").first).to_be_attached()
    page.evaluate("release()")
    finish_run(section)
    for curve in section.locator("polyline.curve").all():
        points = (curve.get_attribute("points") or "").split()
        generations = [float(point.split(",")[0]) for point in points]
        assert generations == sorted(set(generations))


def test_the_theory_follows_the_dials(page: Page) -> None:
    section = show(page, "changing")
    share = read_value(section, "theory")
    drag(section, "cost", 0)
    theory = section.locator('[data-value="theory"]')
    expect(theory).not_to_have_text(f"{share:g} %")
    assert read_value(section, "theory") > share
    period = section.get_by_role("slider", name=STRINGS["dials"]["period"])
    period.focus()
    page.keyboard.press("End")
    expect(period).to_have_attribute("aria-valuetext", STRINGS["figures"]["never_changes"])


def test_the_fork_on_landscapes_shows_hiding_and_guiding(page: Page) -> None:
    section = show(page, "landscape")
    section.get_by_role("button", name=STRINGS["labels"]["end"]).click()
    expect(section.locator('[data-value="hidden"]')).to_have_text(re.compile(r"^−\d"))
    expect(section.locator('[data-value="guided"]')).to_have_text(re.compile(r"^\+\d"))


def test_the_lessons_move_weights_and_change_the_action(page: Page) -> None:
    section = show(page, "learning")
    read_value(section, "lesson")
    section.get_by_role("button", name=STRINGS["labels"]["end"]).click()
    expect(section.locator(".play")).to_have_text("Start again")
    assert read_value(section, "lesson") == explorable.STEPS
    before, after, target = (read_value(section, name) for name in ("before", "after", "target"))
    assert before < after < target
    assert section.locator(".moved").count() > 10
    ahead = STRINGS["figures"]["go_ahead"]
    cells = section.locator("tbody tr, table > tr").locator("td").all_inner_texts()
    assert cells[::2] == [ahead] * 4 and ahead not in cells[1::2]


def test_dragging_a_number_changes_it(page: Page) -> None:
    section = show(page, "agent")
    number = section.locator(".dial-value").first
    before = float(number.inner_text())
    box = read_box(number)
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 30, y)
    page.mouse.up()
    assert float(number.inner_text()) > before
    slider = section.get_by_role("slider").first
    assert float(slider.input_value()) == float(number.inner_text())
    # A press on the slider selects its value.
    box = read_box(slider)
    page.mouse.click(box["x"] + box["width"] - 2, box["y"] + box["height"] / 2)
    assert float(number.inner_text()) == explorable.DIALS["visual_radius"].maximum


def test_a_vertical_swipe_scrolls_and_changes_no_dial(browser: Browser, essay: Path) -> None:
    with open_essay(browser, essay, 390, 844, has_touch=True, is_mobile=True) as page:
        slider = page.get_by_role("slider").first
        before = slider.input_value()
        box = read_box(slider)
        swipe(page, box["x"] + box["width"] - 4, box["y"] + box["height"] / 2, 0, -200)
        page.wait_for_function("scrollY > 0")
        assert slider.input_value() == before

        def swipe_along_the_slider() -> None:
            # The page scrolls on after a swipe, so the next swipe starts on a new page.
            page.reload()
            slider.wait_for()
            box = read_box(slider)
            swipe(page, box["x"] + box["width"] / 2, box["y"] + box["height"] / 2, 40, 0)
            draw_frames(page)

        repeat_until(lambda: slider.input_value() != before, swipe_along_the_slider)


def swipe(page: Page, x: float, y: float, right: float, down: float) -> None:
    """Move a finger in ten steps."""
    session = page.context.new_cdp_session(page)
    for step in range(11):
        point = {"x": x + right * step / 10, "y": y + down * step / 10}
        kind = "touchMove" if step else "touchStart"
        session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": [point]})
    session.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})


def test_in_landscape_text_and_picture_share_the_screen(browser: Browser, essay: Path) -> None:
    with open_essay(browser, essay, 844, 390) as page:
        for step in (step["id"] for step in STRINGS["steps"]):
            page.locator(f"#{step}").evaluate("section => section.scrollIntoView()")
            words = read_box(page.locator(f"#{step} .words"))
            picture = read_box(page.locator(f"#{step} .picture"))
            assert words["x"] + words["width"] <= picture["x"]
            assert abs(words["y"] - picture["y"]) < 40 and picture["y"] < 390 / 2


def test_a_question_gives_feedback(page: Page) -> None:
    text = STRINGS["steps"][1]["question"]
    question = page.get_by_role("group", name=text["text"])
    feedback = question.get_by_role("status")
    question.get_by_label(text["options"][0]).check()
    expect(feedback).to_have_text(text["wrong"])
    page.keyboard.press("ArrowDown")
    expect(feedback).to_have_text(text["right"])


def test_only_the_picture_in_sight_plays(page: Page) -> None:
    canvas = page.locator("#agent canvas")
    expect(page.locator("#agent .play")).to_have_text("Pause")
    show(page, "landscape")
    draw_frames(page)
    picture = canvas.evaluate(READ_PICTURE)
    draw_frames(page)
    assert canvas.evaluate(READ_PICTURE) == picture


def test_reduced_motion_shows_still_pictures_with_a_play_button(
    browser: Browser, essay: Path
) -> None:
    with open_essay(browser, essay, reduced_motion="reduce") as page:
        canvas = page.locator("#agent canvas")
        expect(page.locator("#agent .play")).to_have_text("Play")
        expect(page.locator('#foragers [data-value="learning"]')).not_to_have_text("…")
        picture = canvas.evaluate(READ_PICTURE)
        draw_frames(page)
        assert canvas.evaluate(READ_PICTURE) == picture
        page.locator("#agent .play").click()
        page.wait_for_function(
            "picture => document.querySelector('#agent canvas').toDataURL() !== picture",
            arg=picture,
        )


def test_a_run_goes_to_its_end_out_of_sight(page: Page) -> None:
    section = show(page, "puzzle")
    section.get_by_role("button", name=STRINGS["labels"]["end"]).evaluate(
        "button => { button.click(); scrollTo(0, 0); }"
    )
    expect(section.locator(".play")).to_have_text("Start again")
    assert read_value(section, "generation") == explorable.PUZZLE_GENERATIONS - 1


def test_without_webassembly_the_page_shows_recorded_runs(browser: Browser, essay: Path) -> None:
    with open_essay(browser, essay, script="delete globalThis.WebAssembly") as page:
        expect(page.get_by_text(STRINGS["page"]["no_engine"])).to_be_visible()
        section = show(page, "foragers")
        section.get_by_role("button", name=STRINGS["labels"]["end"]).click()
        expect(section.locator(".play")).to_have_text("Start again")
        expected = np.mean(
            [run[explorable.FORK_GENERATION - 1] for run in RECORDINGS["curves"]["forked"]]
        )
        assert read_value(section, "learning") == pytest.approx(expected, rel=0.01)
        expect(section.locator("input[type=range]").first).to_be_disabled()
        for name in (STRINGS["editor"]["run"], STRINGS["labels"]["end"]):
            expect(page.locator("#yours").get_by_role("button", name=name)).to_be_disabled()
        # The strings need no WebAssembly.
        expect(page.locator("#puzzle input[type=range]")).to_be_enabled()


def test_without_scripts_the_texts_are_readable(browser: Browser, essay: Path) -> None:
    with open_essay(browser, essay, java_script_enabled=False) as page:
        for step in STRINGS["steps"]:
            expect(page.locator(f"#{step['id']} .notice")).to_be_visible()


# Return the size of the smallest text, in CSS pixels.
SMALLEST_TEXT = """() => {
  const elements = [...document.querySelectorAll("main *")].filter(({ childNodes }) =>
    [...childNodes].some(node => node.nodeType === Node.TEXT_NODE && node.data.trim()));
  return Math.min(...elements.map(element => parseFloat(getComputedStyle(element).fontSize)));
}"""


@pytest.mark.parametrize("width", [320, 390, 768, 1280, 1920, 3840])
def test_the_page_fits_its_window(browser: Browser, essay: Path, width: int) -> None:
    with open_essay(browser, essay, width, reduced_motion="reduce") as page:
        expect(page.locator('#foragers [data-value="learning"]')).not_to_have_text("…")
        assert page.evaluate("document.documentElement.scrollWidth") <= width
        assert page.evaluate(SMALLEST_TEXT) >= 11
        canvas = read_box(page.locator("#agent canvas"))
        assert canvas["width"] >= 0.4 * min(width, 1920) - 30


@pytest.mark.parametrize("scheme", ["light", pytest.param("dark", marks=pytest.mark.nightly)])
def test_the_page_has_no_barriers(
    browser: Browser, essay: Path, scheme: Literal["light", "dark"]
) -> None:
    with open_essay(browser, essay, color_scheme=scheme, reduced_motion="reduce") as page:
        expect(page.locator('#foragers [data-value="learning"]')).not_to_have_text("…")
        page.locator("#yours summary").click()
        assert find_violations(page) == []


def test_the_printed_page_contains_the_pictures(browser: Browser, essay: Path) -> None:
    with open_essay(browser, essay) as page:
        # The map of step 1 plays, so the lifetimes are decoded.
        expect(page.locator('[data-value="ring_items"]')).not_to_have_text("…")
        assert page.pdf(format="A4").startswith(b"%PDF")
        for step in ("agent", "evolution", "puzzle", "changing"):
            canvas = page.locator(f"#{step} canvas").first
            assert canvas.evaluate(COUNT_PIXELS) > 100, step
        for step in ("evolution", "puzzle", "changing", "landscape", "foragers"):
            corners = page.locator(f"#{step} polyline.curve").last.get_attribute("points")
            assert len((corners or "").split()) > 20, step
        expect(page.locator("#learning .moved").first).to_be_attached()


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
        button = section.get_by_role("button", name=STRINGS["editor"]["link"])
        button.click()
        # The run goes on, and the reader learns that the address is that of a file.
        expect(section).to_contain_text(STRINGS["editor"]["copied_local"])
        expect(section.locator("figcaption")).to_contain_text("Generation 2")
        fragment = page.evaluate("location.hash")
        command = section.locator("pre").inner_text()
    with open_essay(browser, essay, fragment=fragment) as page:
        expect(page.locator("#yours pre")).to_have_text(command)
    with open_essay(browser, essay, fragment="#map=damaged") as page:
        expect(page.locator("#yours")).to_contain_text(STRINGS["editor"]["damaged"])


def test_a_run_with_learning_is_compared_with_one_without(page: Page) -> None:
    """The earlier run stays as a pale line with its name."""
    section = show(page, "yours")
    end = section.get_by_role("button", name=STRINGS["labels"]["end"])
    for learns in (True, False):
        section.get_by_label(STRINGS["editor"]["learning"]).set_checked(learns)
        section.get_by_role("button", name=STRINGS["editor"]["run"]).click()
        end.click()
        expect(section.locator(".play")).to_have_text(STRINGS["labels"]["restart"])
    expect(section.locator(".earlier")).to_have_count(1)
    names = [STRINGS["figures"][name] for name in ("alone", "learning")]
    assert sorted(section.locator(".direct-label").all_text_contents()) == names
    expect(section.locator(".run-label")).to_have_count(0)
    seed = section.get_by_label(STRINGS["editor"]["seed"])
    first_seed = seed.input_value()
    seed.fill("8")
    seed.press("Enter")
    section.get_by_role("button", name=STRINGS["editor"]["run"]).click()
    expect(section.locator(".run-label").first).to_have_text(f"seed {first_seed}")


@pytest.mark.parametrize(("host", "is_local"), [("localhost", True), ("baldwin.example", False)])
def test_a_link_to_this_computer_says_so(
    browser: Browser, essay: Path, host: str, is_local: bool
) -> None:
    page = browser.new_page()
    page.route("**/*", lambda route: route.fulfill(path=essay, content_type="text/html"))
    page.goto(f"http://{host}/")
    section = show(page, "yours")
    section.get_by_role("button", name=STRINGS["editor"]["link"]).click()
    status = section.locator(".picture [role=status]").first
    expect(status).to_have_text(re.compile(r"\w"))
    assert (STRINGS["editor"]["copied_local"] in status.inner_text()) == is_local
    page.close()


COUNT_INPUTS = """async settings => {
  const { applyMap, adaptProgram, createMapAppearance } =
    await import("lab/explorable/map_settings.js");
  const { findProgram } = await import("lab/engine/program_table.js");
  const { LiveSource } = await import("lab/explorable/source.js");
  const data = JSON.parse(document.getElementById("data").textContent);
  const source = new LiveSource(data, document.getElementById("worker").textContent);
  const { appearance, experiment: scene } = data.scenes.map;
  const experiment = applyMap(scene, settings);
  const program = adaptProgram(findProgram(data.programs, experiment), settings, experiment);
  const shown = createMapAppearance(appearance, settings);
  const population = await source.startExperiment(experiment, shown, [0], 3, program);
  await population.next();
  const life = await population.recordLife(0, 0);
  const { x, y } = life.arrays;
  let active = 0;
  for (let step = 0; step < life.last; step++)
    for (let agent = 0; agent < life.agents; agent++) {
      const index = step * life.agents + agent;
      if (x[index] > 380 || y[index] > 280) continue;
      for (let input = 0; input < life.inputs.length; input++)
        active += life.readInput(step, agent, input);
    }
  population.close();
  return active;
}"""


def test_poison_costs_energy_and_is_not_sensed(page: Page) -> None:
    """Step 8, with poison between the start and the food. The inputs are those near the poison."""
    settings = make_own_map() | {
        "food": [[460, 560, 80, 240]],
        "wall": [],
        "poison": [[250, 330, 80, 240]],
    }
    eaten, energy = page.evaluate(RUN_MAP, settings)
    assert 0 < sum(energy) < sum(eaten)
    assert page.evaluate(COUNT_INPUTS, settings) == 0
    food = {"food": settings["poison"], "poison": []}
    assert page.evaluate(COUNT_INPUTS, settings | food) > 0


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


# Return the visible texts, and the texts for screen readers and of tooltips.
TEXTS = """() => {
    const attributes = ["aria-label", "aria-valuetext", "title", "placeholder", "alt"];
    const elements = [...document.querySelectorAll("body *")];
    const texts = elements.flatMap(({ childNodes }) => [...childNodes]).filter(node => node.data);
    // The command is the same in all languages.
    const readable = texts.filter(node => !node.parentElement.closest("noscript, script, pre"));
    return [
        document.title,
        ...readable.map(({ data }) => data),
        ...elements.flatMap((element) => attributes.map((name) => element.getAttribute(name))),
    ].filter(Boolean);
}"""
PIECE = re.compile(r"\{\w+(?:\||\})|[^\W\d_]+")


def translate(value: Any) -> Any:
    """Return strings in which each word is another word. Placeholders and numbers stay."""
    if isinstance(value, dict):
        fixed = {"language": "de"} | ({"id": value["id"]} if "id" in value else {})
        return {key: fixed.get(key, translate(text)) for key, text in value.items()}
    if isinstance(value, list):
        return [translate(item) for item in value]
    if not isinstance(value, str):
        return value
    return PIECE.sub(lambda piece: piece[0] if piece[0].startswith("{") else "Ж", value)


def write_translation(folder: Path) -> Path:
    """Write the translated page."""
    strings = folder / "strings.toml"
    strings.write_text(tomlkit.dumps(translate(tomllib.loads(STRINGS_FILE.read_text("utf-8")))))
    page = folder / "baldwin.html"
    page.write_bytes(render_explorable(strings))
    return page


def list_english_words(page: Page) -> list[str]:
    words = set(re.findall(r"[A-Za-z]{2,}", "\n".join(page.evaluate(TEXTS))))
    return sorted(words - {"baldwinlab"})


def test_a_translated_file_leaves_no_english_word_or_number(
    browser: Browser, tmp_path: Path
) -> None:
    with open_essay(browser, write_translation(tmp_path)) as page:
        assert page.evaluate("document.documentElement.lang") == "de"
        for step in ("evolution", "puzzle", "changing", "landscape", "foragers"):
            section = show(page, step)
            expect(section.locator("[data-value]").first).not_to_have_text("Ж")
        puzzle = show(page, "puzzle")
        expect(puzzle.locator('[data-value="generation"]')).not_to_have_text(re.compile("^[01Ж]$"))
        drag(puzzle, "trials", 0)
        expect(puzzle.locator(".run-label").first).to_contain_text("Ж")
        page.locator("#puzzle input[type=radio]").first.check()
        lesson = show(page, "learning")
        # The browser is English.
        expect(lesson.locator(".dial-value", has_text="0,01")).to_have_count(1)
        expect(lesson.locator('[data-value="before"]')).to_have_text(re.compile(r"^0,\d{4}$"))
        editor = show(page, "yours")
        editor.locator("summary").click()
        editor.get_by_role("button").nth(1).click()
        assert list_english_words(page) == []
