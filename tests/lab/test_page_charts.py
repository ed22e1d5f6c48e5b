"""Every chart can be taken along, as the numbers and as the picture; and what a mean hides can be shown, run by run."""

from __future__ import annotations

import csv
import json
import re
import shutil
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import urlencode
from xml.etree import ElementTree

import pytest
from playwright.sync_api import Browser, Page, ViewportSize, expect

from baldwinlab.api.publish import lab_results
from baldwinlab.core.netcdf import to_bytes
from baldwinlab.studies.store import StudyStore
from tests.analysis.assays.assayed import of_study, reaction
from tests.axe import find_violations
from tests.lab.client import SMALL, WINDOWS, LabServer, get_json
from tests.lab.conftest import run_server
from tests.lab.test_page_live import QUICK, begin, state_is
from tests.lab.test_page_results import hash_of, open_results

SVG = "{http://www.w3.org/2000/svg}"
BEST = "Fitness of the best agent, generation by generation"


def saved(page: Page, name: str) -> str:
    with page.expect_download() as download:
        page.get_by_test_id(f"download-{name}").click()
    return str(download.value.path().read_text("utf-8"))


def rows(page: Page, name: str) -> list[dict[str, str]]:
    return list(csv.DictReader(saved(page, name).splitlines()))


def picture(page: Page, name: str) -> ElementTree.Element:
    """A picture that needs nothing else: no style, no class, no link, no file elsewhere."""
    found = ElementTree.fromstring(saved(page, name))
    assert found.tag == f"{SVG}svg"
    assert not [
        one.tag
        for one in found.iter()
        if one.tag in (f"{SVG}style", f"{SVG}image", f"{SVG}a") or "class" in one.attrib
    ]
    return found


def words(drawn: ElementTree.Element) -> list[str]:
    return [text.text or "" for text in drawn.iter(f"{SVG}text")]


def test_the_curves_are_saved_with_title_axes_legend_bands_and_lines_as_they_are_shown(
    page: Page, lab_server: LabServer
) -> None:
    open_results(page)
    curves = get_json(lab_server.address, "results", study="small")["curves"]
    found = rows(page, "curves.csv")
    means = [float(row["mean"]) for row in found if row["curve"] == "evo/A"]
    assert means == curves["evo/A"]["best"]["mean"]
    drawn = picture(page, "curves.svg")
    assert words(drawn)[0] == BEST
    assert {"generation", "fitness (energy)", "0", "1", "2", "evo/A", "evo+self-taught/A"} <= set(
        words(drawn)
    )
    bands = [path for path in drawn.iter(f"{SVG}path") if path.get("fill-opacity")]
    lines = [path for path in drawn.iter(f"{SVG}path") if path.get("stroke-width") == "2"]
    assert len(bands) == len(lines) == 2
    assert all(len(re.findall(r"[\d.]+ [\d.]+", line.get("d") or "")) == 3 for line in lines)
    page.get_by_test_id("curves").get_by_role("button", name="evo/A").click()
    assert "evo/A" not in words(picture(page, "curves.svg"))


def test_the_boxes_are_saved_with_a_row_and_a_point_a_run(
    page: Page, lab_server: LabServer
) -> None:
    open_results(page)
    final = get_json(lab_server.address, "results", study="small")["final"]
    found = rows(page, "final-mean.csv")
    assert [float(row["value"]) for row in found] == final["evo/A"]["mean"] + final[
        "evo+self-taught/A"
    ]["mean"]
    drawn = picture(page, "final-mean.svg")
    assert len([*drawn.iter(f"{SVG}circle")]) == 4
    assert words(drawn)[0] == "Average agent at the end of each run, fitness (energy)"


def test_each_run_is_a_line_that_leads_to_its_own_life(page: Page, lab_server: LabServer) -> None:
    open_results(page)
    page.get_by_test_id("each-run").check()
    expect(page).to_have_url(re.compile("runs=each"))
    expect(page.get_by_test_id("each-run")).to_be_focused()
    page.reload()
    found = rows(page, "run-curves.csv")  # the button is there when the lines are
    runs = get_json(
        lab_server.address, "results/runs", study="small", condition="evo/A", measure="best"
    )
    assert [
        float(row["value"]) for row in found if (row["curve"], row["run"]) == ("evo/A", "1")
    ] == runs["1"]
    thin = [
        path
        for path in picture(page, "curves.svg").iter(f"{SVG}path")
        if path.get("stroke-opacity")
    ]
    assert len(thin) == 4
    plot, told = (
        page.get_by_role("group", name=BEST),
        page.get_by_test_id("curves").get_by_role("status"),
    )
    plot.press("Home")
    expect(told).to_have_text(re.compile("^evo/A, generation 0: "))
    typical = get_json(lab_server.address, "results", study="small")["typical_run"]["evo/A"]
    for key in ["ArrowUp"] * 6 + ["ArrowDown"] * 6:  # to the highest line, and down to the lowest
        if (told.text_content() or "").startswith(f"evo/A, run {1 - typical}, generation 0: "):
            break
        plot.press(key)
    plot.press("Enter")
    expect(page.get_by_test_id("share")).to_be_visible()
    assert hash_of(page) | {
        "condition": "evo/A",
        "run": str(1 - typical),
        "generation": "0",
    } == hash_of(page)


def test_a_click_on_a_run_s_line_opens_that_run(page: Page, lab_server: LabServer) -> None:
    curves = {
        (name, run): curve[1]
        for name in ("evo/A", "evo+self-taught/A")
        for run, curve in get_json(
            lab_server.address, "results/runs", study="small", condition=name, measure="best"
        ).items()
    }
    name, run = max(curves, key=lambda one: curves[one])
    open_results(page, "study=small&runs=each")
    expect(page.get_by_test_id("download-run-curves.csv")).to_be_visible()
    plot = page.get_by_test_id("curves").locator(".u-over")
    box = plot.bounding_box()
    assert box is not None
    plot.click(
        position={"x": box["width"] / 2, "y": 1}
    )  # generation 1; the highest line is nearest
    expect(page.get_by_test_id("share")).to_be_visible()
    assert (hash_of(page)["condition"], hash_of(page)["run"], hash_of(page)["generation"]) == (
        name,
        run,
        "1",
    )


def test_where_there_are_too_many_runs_for_lines_a_sentence_says_so(
    browser: Browser, lab_server: LabServer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(lab_results, "MAX_POINTS", 5)
    shutil.copytree(lab_server.root / "small", tmp_path / "small")
    with run_server(tmp_path) as server, server.context(browser) as context:
        page = context.new_page()
        open_results(page, "study=small&runs=each")
        expect(page.get_by_test_id("curves")).to_contain_text(
            "Curves of single runs are limited to 5 values per condition"
        )


@pytest.fixture
def assayed(lab_server: LabServer) -> Iterator[None]:
    folder = lab_server.root / "small" / "assays"
    (folder / "reaction" / "evo").mkdir(parents=True)
    made = of_study(reaction("evo/A", 60), StudyStore(lab_server.root / "small"), "evo/A")
    (folder / "reaction" / "evo" / "A.nc").write_bytes(to_bytes(made))
    yield
    shutil.rmtree(folder)


def test_reaction_norms_are_drawn_one_circumstance_at_a_time(page: Page, assayed: None) -> None:
    open_results(page)
    section = page.get_by_test_id("reaction")
    section.get_by_test_id("norm").select_option("world.food.0.count")
    expect(page).to_have_url(re.compile(r"norm=world\.food\.0\.count"))
    page.reload()
    expect(section.get_by_test_id("norm")).to_have_value("world.food.0.count")
    found = rows(page, "reaction-world.food.0.count-A.csv")
    assert [(row["condition"], row["value"]) for row in found] == [
        ("evo/A", value) for value in ("10", "50", "100")
    ]
    assert {"10", "(50)", "100", "evo/A"} <= set(
        words(picture(page, "reaction-world.food.0.count-A.svg"))
    )
    assert find_violations(page) == []


def test_where_there_are_none_a_sentence_says_how_they_are_made(page: Page) -> None:
    open_results(page)
    expect(page.get_by_test_id("reaction")).to_contain_text(
        "baldwinlab assay small --assays reaction"
    )


def test_the_curves_of_a_live_run_are_saved_as_far_as_they_are(page: Page) -> None:
    begin(page, QUICK, pace=0)
    state_is(page, "Done")
    found = rows(page, "fitness.csv")
    assert [row["generation"] for row in found if row["curve"] == "best agent"] == [
        "0",
        "1",
        "2",
        "3",
    ]
    assert {"best agent", "average agent", "generation"} <= set(words(picture(page, "fitness.svg")))
    assert len(rows(page, "share.csv")) == 4


def test_what_goes_on_inside_an_agent_is_saved_step_by_step(page: Page) -> None:
    page.goto(f"/#/world?{urlencode(SMALL | {'agent': 3})}")
    expect(page.get_by_test_id("kin")).to_contain_text("parents")
    eaten = rows(page, "items-eaten.csv")
    assert [row["step"] for row in eaten] == [str(step) for step in range(len(eaten))] and len(
        eaten
    ) >= 300
    weights = rows(page, "weight-changes.csv")
    drawn = picture(page, "weight-changes.svg")
    assert len([path for path in drawn.iter(f"{SVG}path") if path.get("stroke-opacity")]) == len(
        {row["line"] for row in weights}
    )
    assert {"step of the lifetime", "first layer"} <= set(words(drawn))


def test_ticks_lie_between_the_limits_at_whole_generations(page: Page) -> None:
    page.goto("/#/results")
    found = page.evaluate(
        """async () => {
            const { ticksBetween } = await import("/drawing.js");
            return [ticksBetween(0, 39, 1), ticksBetween(-0.5, 1, 0), ticksBetween(0, 2, 1), ticksBetween(0, 0.3)];
        }"""
    )
    assert found == [[0, 10, 20, 30], [-0.5, 0, 0.5, 1], [0, 1, 2], [0, 0.1, 0.2, 0.3]]


@pytest.mark.parametrize(("width", "height", "dots"), WINDOWS.values(), ids=WINDOWS)
def test_nothing_is_wider_than_the_window_and_every_control_can_be_reached(
    browser: Browser, lab_server: LabServer, assayed: None, width: int, height: int, dots: int
) -> None:
    size: ViewportSize = {"width": width, "height": height}
    touch = width < 1000
    with lab_server.context(
        browser, viewport=size, device_scale_factor=dots, has_touch=touch
    ) as context:
        page = context.new_page()
        wide = "[document.getElementById('view'), document.documentElement].map(one => one.scrollWidth - one.clientWidth)"
        open_results(page, "study=small&runs=each&norm=map")
        for control in (
            "each-run",
            "download-run-curves.csv",
            "download-final-best.svg",
            "norm",
            "download-reaction-map-A.svg",
        ):
            page.get_by_test_id(control).scroll_into_view_if_needed()
            expect(page.get_by_test_id(control)).to_be_in_viewport(ratio=1)
        assert page.evaluate(wide) == [0, 0]
        page.goto(
            f"/#/live?{urlencode({'fields': json.dumps({'learning.rate': [0.1, 1], 'population.size': [5, 10]})})}"
        )
        expect(page.get_by_test_id("sweep-size")).to_contain_text(
            "4 points", timeout=60_000
        )  # which moves what is below it
        for control in ("sweep-values-1", "sweep-name", "sweep-start"):
            page.get_by_test_id(control).scroll_into_view_if_needed()
            expect(page.get_by_test_id(control)).to_be_in_viewport(ratio=1)
        assert page.evaluate(wide) == [0, 0]
        dialog = page.get_by_test_id("sweep-dialog")
        assert dialog.evaluate("one => one.scrollWidth - one.clientWidth") == 0
        (
            page.get_by_role("button", name="Cancel").tap
            if touch
            else page.get_by_role("button", name="Cancel").click
        )()
        expect(dialog).to_have_count(0)
