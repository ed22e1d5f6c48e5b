"""Tests of comparisons: the dialog, the progress and the result, for presets and for values."""

from __future__ import annotations

import json
import re
import shlex
import shutil
import tomllib
from collections.abc import Iterator
from urllib.parse import urlencode

import pytest
from playwright.sync_api import Browser, Page, expect

import baldwinlab as bl
from baldwinlab.lab.sources.experiment_form import CHOICES
from baldwinlab.studies.store import StudyStore
from tests.axe import find_violations
from tests.lab.client import LabServer, get_json, read_box

CHANGES = {"lifetime.steps": 200, "evolution.generations": 2, "world.start.x": 400}
PRESETS = ["evo/A", "evo+drift/A"]
FOOD = [{"x": [300, 340], "y": [80, 480], "count": 9}]


@pytest.fixture
def folder(lab_server: LabServer) -> Iterator[str]:
    """Yield the folder of the studies that a test creates."""
    yield "compared"
    shutil.rmtree(lab_server.root / "compared", ignore_errors=True)


def test_ticked_presets_are_compared_with_the_changes_of_the_form(
    page: Page, lab_server: LabServer, folder: str
) -> None:
    changes = {"evolution.generations": 3, "lifetime.steps": 300, "world.food": FOOD}
    page.goto(f"/#/live?{urlencode({'preset': 'evo/A', 'runs': 2, 'set': json.dumps(changes)})}")
    page.get_by_test_id("compare-open").click()
    dialog = page.get_by_test_id("compare-dialog")
    start = page.get_by_test_id("compare-start")
    # One preset cannot be compared.
    selection = page.get_by_test_id("compare-selection")
    expect(selection).to_have_text("Ticked: Agents that do not learn")
    expect(start).to_be_disabled()
    # Four presets in words are visible, and all others are folded.
    choices = dialog.locator(".compare-tick:visible").all_inner_texts()
    assert {text.partition("\n")[0] for text in choices} == set(CHOICES.values())
    page.get_by_test_id("compare-all").locator("> summary").click()
    page.get_by_test_id("compare-search").fill("drift quarter")
    expect(dialog.get_by_label("evo+lamarckian/A")).to_be_hidden()
    dialog.get_by_label("evo+drift/A").check()
    expect(page.get_by_test_id("compare-size")).to_contain_text("2 conditions, 4 runs in total: ")
    expect(page.get_by_test_id("compare-note")).to_have_text(
        "No verdict is possible. With 2 runs and 2 tests, the smallest corrected p-value is 0.67."
        " At least 5 runs are needed. Set the number of runs to 5."
    )
    page.get_by_test_id("setup-compare-runs").fill("5")
    expect(page.get_by_test_id("compare-note")).to_have_text("")
    command = page.get_by_test_id("compare-command")
    expect(command).to_contain_text("baldwinlab run evo/A evo+drift/A --runs 5 --seed 0 --set ")
    assignments = shlex.split(command.inner_text())[9:]
    assert "world.food.0.y=[80.0, 480.0]" in assignments
    expect(page.get_by_test_id("compare-changes")).to_have_text(
        f"Each condition has the changes of the form: {', '.join(assignments)}."
    )
    expect(page).to_have_url(re.compile(r"compare=.*evo/A.*drift/A"))
    assert find_violations(page) == []
    page.get_by_test_id("compare-name").fill(f"{folder}/presets")
    start.click()
    expect(page.get_by_test_id("compare-state")).to_have_text("Done")
    expect(page).to_have_url(re.compile(rf"comparison={folder}/presets$"))
    study = bl.open_study(lab_server.root / folder / "presets")
    stored = StudyStore(study.directory).experiments.values()
    assert [experiment.world.food[0].y for experiment in stored] == [(80, 480), (80, 480)]
    rows = study.compare()
    # The curve and the verdict are side by side.
    (summary,) = get_json(lab_server.address, "results", study=f"{folder}/presets")["comparison"][
        "summary"
    ]
    expect(page.get_by_test_id("compare-answer")).to_have_text(summary)
    curve, verdict = (
        read_box(page.get_by_test_id(f"compare-{part}")) for part in ("curve", "answer")
    )
    assert curve["x"] + curve["width"] <= verdict["x"]
    assert curve["y"] <= verdict["y"] <= curve["y"] + curve["height"]
    comparison = page.get_by_role("region", name="Comparison of conditions")
    table = comparison.locator("tbody tr")
    expect(table.locator(".badge")).to_have_text(rows["verdict"].tolist())
    expect(table.first).to_contain_text("evo+drift/Aaverage agent")
    assert find_violations(page) == []
    page.get_by_test_id("compare-results").click()
    expect(page.get_by_test_id("curves").locator(".chart-key")).to_have_text(PRESETS)
    answer = page.get_by_test_id("answer").text_content()
    page.go_back()
    expect(page.get_by_test_id("compare-answer")).to_have_text(answer or "")


def test_values_are_planned_downloaded_started_and_opened_in_results(
    page: Page, folder: str
) -> None:
    query = {"preset": "evo+self-taught/A", "runs": 2, "set": json.dumps(CHANGES)}
    page.goto(f"/#/live?{urlencode(query)}")
    page.get_by_test_id("compare-open").click()
    page.get_by_test_id("compare-kind-fields").check()
    field = page.get_by_test_id("compare-field-0")
    values = page.get_by_test_id("compare-values-0")
    start = page.get_by_test_id("compare-start")
    size = page.get_by_test_id("compare-size")
    expect(start).to_be_disabled()
    # The values of a choice are ticks. One value cannot be compared.
    field.select_option("learning.rule")
    expect(size).to_have_text("")
    page.get_by_test_id("compare-ticks-0").get_by_label("hebb", exact=True).check()
    expect(page).to_have_url(re.compile(r"compare=.*fields.*self-taught.*hebb"))
    field.select_option("learning.rate")
    expect(values).to_have_value("0.005, 0.01, 0.02")
    expect(size).to_contain_text("3 conditions, 6 runs in total: ")
    values.fill("0.01, 11")
    expect(page.get_by_test_id("compare-fault")).to_contain_text("learning.rate = 11")
    expect(start).to_be_disabled()
    values.fill("0.01, 0.1")
    expect(size).to_contain_text("2 conditions, 4 runs in total: ")
    expect(page.get_by_test_id("compare-note")).to_contain_text("No verdict is possible.")
    # The address contains the plan.
    expect(page).to_have_url(re.compile(r"compare=.*learning\.rate.*0\.01,0\.1"))
    page.reload()
    expect(values).to_have_value("0.01, 0.1")
    expect(start).to_be_enabled()
    with page.expect_download() as download:
        page.get_by_test_id("download-sweep.toml").click()
    plan = tomllib.loads(download.value.path().read_text())
    assert plan["fields"] == {"learning.rate": [0.01, 0.1]}
    page.get_by_test_id("compare-name").fill(f"{folder}/rates")
    start.click()
    expect(page.get_by_test_id("compare-dialog")).to_have_count(0)
    expect(page.get_by_test_id("compare-state")).to_have_text("Done")
    expect(page.get_by_test_id("compare-count")).to_have_text("4 of 4 runs")
    expect(page.get_by_test_id("compare-answer")).to_contain_text(
        "The runs are too few to compare agents with learning.rate = 0.1 and agents with "
        "learning.rate = 0.01"
    )
    page.get_by_test_id("compare-results").click()
    expect(page.get_by_test_id("curves").locator(".chart-key")).to_have_text(["0.01", "0.1"])
    page.goto("/#/live?comparison=compared/gone")
    expect(page.get_by_test_id("live-empty")).to_contain_text("This comparison has ended")
    expect(page.get_by_role("link", name="compared/rates, 4 of 4 runs, done")).to_be_visible()


def test_the_keyboard_ticks_presets_and_escape_removes_the_plan(page: Page) -> None:
    page.goto("/#/live?preset=evo/A")
    button = page.get_by_test_id("compare-open")
    button.focus()
    page.keyboard.press("Enter")
    page.get_by_test_id("compare-all").locator("> summary").press("Enter")
    search = page.get_by_test_id("compare-search")
    search.focus()
    page.keyboard.type("evo+drift/A")
    # The summary of the paper, then the found preset.
    for _ in range(6):
        page.keyboard.press("Tab")
        focused = page.evaluate("document.activeElement.value ?? ''")
        if focused == "evo+drift/A":
            break
    page.keyboard.press("Space")
    expect(page.get_by_test_id("compare-selection")).to_have_text(
        re.compile("Ticked: Agents that do not learn; Control: weights change at random")
    )
    expect(page).to_have_url(re.compile("compare="))
    page.keyboard.press("Escape")
    expect(page.get_by_test_id("compare-dialog")).to_have_count(0)
    expect(button).to_be_focused()
    expect(page).not_to_have_url(re.compile("compare="))


def test_results_open_the_dialog_with_the_presets_of_the_study(page: Page) -> None:
    page.goto("/#/results?study=small")
    page.get_by_test_id("compare-link").click()
    # With 10 runs, a verdict is possible.
    expect(page.get_by_test_id("setup-compare-runs")).to_have_value("10")
    expect(page.get_by_test_id("compare-selection")).to_have_text(
        "Ticked: Agents that do not learn; Agents that learn"
    )


@pytest.mark.parametrize("width", [320, pytest.param(390, marks=pytest.mark.nightly)])
def test_the_dialog_fits_into_a_narrow_window(
    browser: Browser, lab_server: LabServer, width: int
) -> None:
    viewport = {"width": width, "height": 640}
    with lab_server.open_page(browser, viewport=viewport) as page:
        page.goto(f"/#/live?{urlencode({'compare': json.dumps({'presets': PRESETS})})}")
        expect(page.get_by_test_id("compare-start")).to_be_enabled()
        for kind in ("presets", "fields"):
            page.get_by_test_id(f"compare-kind-{kind}").check()
            dialog = page.get_by_test_id("compare-dialog")
            assert (
                dialog.evaluate("({ scrollWidth, clientWidth }) => scrollWidth - clientWidth") == 0
            )
            box = read_box(dialog)
            assert box["x"] >= 0 and box["x"] + box["width"] <= width
        page.get_by_test_id("compare-start").scroll_into_view_if_needed()
        expect(page.get_by_test_id("compare-start")).to_be_in_viewport(ratio=1)
