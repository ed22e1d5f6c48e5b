"""Tests of charts: downloads as CSV and PNG, and curves of single runs."""

from __future__ import annotations

import csv
import json
import re
import shutil
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import urlencode

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import Browser, Page, ViewportSize, expect

from baldwinlab.api.publish import lab_results
from baldwinlab.studies.assays.results import encode_assay
from baldwinlab.studies.store import StudyStore
from tests.analysis.assays.artificial_assays import assign_to_study, reaction
from tests.axe import find_violations
from tests.lab.client import SMALL, LabServer, every_window, get_json, read_box
from tests.lab.conftest import run_server
from tests.lab.test_page_live import QUICK, expect_state, start_live_run
from tests.lab.test_page_results import open_results, read_query

# CSS pixels of a line of the legend in a picture.
LINE_HEIGHT = 22
BEST = "Items eaten by the best agent"
EVO_BEST = ("evo/A", "best")
EXCESS_WIDTHS = """[document.getElementById("view"), document.documentElement]
    .map(element => element.scrollWidth - element.clientWidth)"""


def click_save(page: Page, name: str) -> None:
    """Press an entry of the menu of a chart, or a button outside a menu."""
    button = page.get_by_test_id(f"download-{name}")
    menu = page.locator("details.menu", has=button)
    if menu.count():
        menu.locator("summary").click()
    button.click()


def download_text(page: Page, name: str) -> str:
    with page.expect_download() as download:
        click_save(page, name)
    return str(download.value.path().read_text("utf-8"))


def download_rows(page: Page, name: str) -> list[dict[str, str]]:
    return list(csv.DictReader(download_text(page, name).splitlines()))


def download_picture(page: Page, name: str) -> Image.Image:
    with page.expect_download() as download:
        click_save(page, name)
    picture = Image.open(download.value.path())
    assert picture.format == "PNG"
    return picture.convert("RGB")


def test_downloaded_curves_have_the_numbers_and_the_visible_lines(
    page: Page, lab_server: LabServer
) -> None:
    open_results(page, "study=small&runs=each&measure=best")
    expect(page.get_by_test_id("download-run-curves.csv")).to_be_visible()
    curves = get_json(lab_server.address, "results", study="small")["curves"]
    rows = download_rows(page, "curves.csv")
    medians = [float(row["value"]) for row in rows if row["curve"] == "evo/A"]
    assert medians == curves["evo/A"]["best"]["center"]
    everything = download_picture(page, "curves.png")
    plot = read_box(page.get_by_test_id("curves").locator("canvas"))
    # The title is above the plot. The legend and the note are below.
    assert everything.width > plot["width"]
    assert everything.height > plot["height"] + 4 * LINE_HEIGHT
    assert len(np.unique(np.asarray(everything).reshape(-1, 3), axis=0)) > 50
    page.get_by_test_id("curves").get_by_role("button", name="evo/A").click()
    one_curve = download_picture(page, "curves.png")
    assert one_curve.height == everything.height - LINE_HEIGHT


def test_save_figure_gives_the_figure_of_the_report_in_four_formats(
    page: Page, lab_server: LabServer
) -> None:
    open_results(page)
    page.get_by_test_id("save-fitness").locator("summary").click()
    signatures = {"svg": b"<?xml", "pdf": b"%PDF", "png": b"\x89PNG", "csv": b"condition,measure"}
    for name, signature in signatures.items():
        with page.expect_download() as download:
            page.get_by_test_id(f"save-fitness-{name}").click()
        assert download.value.suggested_filename == f"small-fitness-2-runs.{name}"
        content = download.value.path().read_bytes()
        assert content.startswith(signature)
        if name == "svg":
            # Text is text, and the only panel is the one on the screen.
            texts = re.findall(r"<text[^>]*>([^<]*)<", content.decode())
            assert [text for text in texts if "agent" in text][:1] == ["Your map, best agent"]
            assert {"evo", "evo+", "self-taught"} <= {*texts}
            assert "Map A, average agent" not in texts
    rows = [*csv.DictReader(content.decode().splitlines())]
    # Only the measure that is on the screen is saved.
    assert {row["measure"] for row in rows} == {"best"}
    medians = [
        float(row["median"]) for row in rows if (row["condition"], row["measure"]) == EVO_BEST
    ]
    curves = get_json(lab_server.address, "results", study="small")["curves"]
    assert medians == pytest.approx(curves["evo/A"]["best"]["center"])
    assert {row["runs"] for row in rows} == {"2"}


@pytest.mark.nightly
def test_the_keyboard_opens_the_run_of_a_line(page: Page, lab_server: LabServer) -> None:
    open_results(page)
    page.get_by_test_id("factors").locator("summary").click()
    page.get_by_test_id("each-run").check()
    expect(page).to_have_url(re.compile("runs=each"))
    expect(page.get_by_test_id("each-run")).to_be_focused()
    page.reload()
    # The button exists as soon as the lines are drawn.
    rows = download_rows(page, "run-curves.csv")
    runs = get_json(
        lab_server.address, "results/runs", study="small", condition="evo/A", measure="best"
    )
    run_rows = [row for row in rows if (row["curve"], row["run"]) == ("evo/A", "1")]
    assert [float(row["value"]) for row in run_rows] == runs["1"]
    assert len(run_rows) == 3
    assert len(rows) == 4 * len(run_rows)
    plot = page.get_by_role("group", name=BEST)
    status = page.get_by_test_id("curves").get_by_role("status")
    plot.press("Home")
    expect(status).to_have_text(re.compile("^evo/A, generation 0: "))
    typical = get_json(lab_server.address, "results", study="small")["typical_run"]["evo/A"]
    # Move to the highest line, and then down to the lowest line.
    for key in ["ArrowUp"] * 6 + ["ArrowDown"] * 6:
        if (status.text_content() or "").startswith(f"evo/A, run {1 - typical}, generation 0: "):
            break
        plot.press(key)
    plot.press("Enter")
    expect(page.get_by_test_id("share")).to_be_visible()
    expected = {"condition": "evo/A", "run": str(1 - typical), "generation": "0"}
    assert expected.items() <= read_query(page).items()


def test_a_click_on_a_line_opens_its_run(page: Page, lab_server: LabServer) -> None:
    curves = {
        (name, run): curve[1]
        for name in ("evo/A", "evo+self-taught/A")
        for run, curve in get_json(
            lab_server.address, "results/runs", study="small", condition=name, measure="best"
        ).items()
    }
    name, run = max(curves, key=lambda key: curves[key])
    open_results(page, "study=small&runs=each&measure=best")
    expect(page.get_by_test_id("download-run-curves.csv")).to_be_visible()
    plot = page.get_by_test_id("curves").locator(".u-over")
    box = read_box(plot)
    # This is the position of generation 1, where the highest line is nearest.
    plot.click(position={"x": box["width"] / 2, "y": 1})
    expect(page.get_by_test_id("share")).to_be_visible()
    expected = {"condition": name, "run": run, "generation": "1"}
    assert expected.items() <= read_query(page).items()


def test_too_many_runs_for_lines_show_a_message(
    browser: Browser, lab_server: LabServer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(lab_results, "MAX_CURVE_VALUES", 5)
    shutil.copytree(lab_server.root / "small", tmp_path / "small")
    with run_server(tmp_path) as server, server.open_page(browser) as page:
        open_results(page, "study=small&runs=each&measure=best")
        expect(page.get_by_test_id("curves")).to_contain_text(
            "Curves of single runs are limited to 5 values per condition"
        )


@pytest.fixture
def reaction_assay(lab_server: LabServer) -> Iterator[None]:
    """Store the results of a reaction assay in the study `small`."""
    folder = lab_server.root / "small" / "assays"
    (folder / "reaction" / "evo").mkdir(parents=True)
    results = assign_to_study(reaction("evo/A", 60), StudyStore(lab_server.root / "small"), "evo/A")
    (folder / "reaction" / "evo" / "A.nc").write_bytes(encode_assay(results))
    yield
    shutil.rmtree(folder)


@pytest.mark.nightly
def test_reaction_norms_are_drawn_for_the_selected_field(page: Page, reaction_assay: None) -> None:
    open_results(page)
    section = page.get_by_test_id("reaction")
    section.locator("summary").click()
    section.get_by_test_id("norm").select_option("world.food.0.count")
    expect(page).to_have_url(re.compile(r"norm=world\.food\.0\.count"))
    page.reload()
    expect(section.get_by_test_id("norm")).to_have_value("world.food.0.count")
    # The study has another start than map A.
    rows = download_rows(page, "reaction-world.food.0.count-your-map.csv")
    assert [(row["condition"], row["value"]) for row in rows] == [
        ("evo/A", value) for value in ("10", "50", "100")
    ]
    download_picture(page, "reaction-world.food.0.count-your-map.png")
    assert find_violations(page) == []


@pytest.mark.nightly
def test_without_reaction_norms_the_page_shows_the_command(page: Page) -> None:
    open_results(page)
    page.get_by_test_id("reaction").locator("summary").click()
    expect(page.get_by_test_id("reaction")).to_contain_text(
        re.compile("baldwinlab assay .*small --assays reaction")
    )


@pytest.mark.nightly
def test_the_curves_of_a_live_run_are_downloaded(page: Page) -> None:
    start_live_run(page, QUICK, pace=0)
    expect_state(page, "Done")
    rows = download_rows(page, "fitness.csv")
    generations = [row["generation"] for row in rows if row["curve"] == "best agent"]
    assert generations == ["0", "1", "2", "3"]
    download_picture(page, "fitness.png")
    assert len(download_rows(page, "share.csv")) == 4
    with page.expect_download() as download:
        click_save(page, "share.png")
    # The file and its name state the experiment and the number of runs.
    name = re.compile(r"evo[+\w-]*-A-share-\d+-runs?\.png")
    assert name.fullmatch(download.value.suggested_filename)


def test_the_activity_of_an_agent_is_downloaded_step_by_step(page: Page) -> None:
    page.goto(f"/#/world?{urlencode(SMALL | {'agent': 3})}")
    expect(page.get_by_test_id("relatives")).to_contain_text("parents")
    eaten = download_rows(page, "items-eaten.csv")
    assert [row["step"] for row in eaten] == [str(step) for step in range(len(eaten))]
    assert len(eaten) >= 300
    weights = download_rows(page, "weight-changes.csv")
    assert len({row["line"] for row in weights}) > 1
    download_picture(page, "weight-changes.png")


@every_window
def test_charts_are_not_wider_than_the_window_and_controls_are_reachable(
    browser: Browser,
    lab_server: LabServer,
    reaction_assay: None,
    width: int,
    height: int,
    dots: int,
) -> None:
    size: ViewportSize = {"width": width, "height": height}
    touch = width < 1000
    with lab_server.open_page(
        browser, viewport=size, device_scale_factor=dots, has_touch=touch
    ) as page:
        open_results(page, "study=small&runs=each&norm=map")
        page.get_by_test_id("finals").locator("summary").first.click()
        page.get_by_test_id("save-final-fitness").locator("summary").click()
        page.get_by_test_id("saves-reaction-map-your-map").locator("summary").click()
        for control in (
            "each-run",
            "download-run-curves.csv",
            "save-final-fitness-csv",
            "norm",
            "download-reaction-map-your-map.png",
        ):
            page.get_by_test_id(control).scroll_into_view_if_needed()
            expect(page.get_by_test_id(control)).to_be_in_viewport(ratio=1)
        assert page.evaluate(EXCESS_WIDTHS) == [0, 0]
        fields = {"learning.rate": [0.1, 1], "population.size": [5, 10]}
        compared = json.dumps({"fields": fields})
        page.goto(f"/#/live?{urlencode({'compare': compared})}")
        # The size of the comparison moves the controls below it.
        expect(page.get_by_test_id("compare-size")).to_contain_text("4 conditions")
        for control in ("compare-values-1", "compare-name", "compare-start"):
            page.get_by_test_id(control).scroll_into_view_if_needed()
            # The dialog scrolls by whole pixels, and the heights of its lines have fractions.
            expect(page.get_by_test_id(control)).to_be_in_viewport(ratio=0.99)
        assert page.evaluate(EXCESS_WIDTHS) == [0, 0]
        dialog = page.get_by_test_id("compare-dialog")
        assert dialog.evaluate("dialog => dialog.scrollWidth - dialog.clientWidth") == 0
        cancel = page.get_by_role("button", name="Cancel")
        press = cancel.tap if touch else cancel.click
        press()
        expect(dialog).to_have_count(0)
