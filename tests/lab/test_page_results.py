"""Tests of the Results tab: curves, box plots and claims, which open the World tab."""

from __future__ import annotations

import re
import shutil
from collections.abc import Iterator
from urllib.parse import parse_qsl

import numpy as np
import pytest
from playwright.sync_api import Locator, Page, expect

import baldwinlab as bl
from baldwinlab.experiment.conditions import Factors
from baldwinlab.experiment.toml import to_toml
from baldwinlab.simulation.simulate import simulate
from baldwinlab.studies.creation import create_study
from baldwinlab.studies.status import CLAIMS_FILE, write_claims
from baldwinlab.studies.store import StudyStore
from tests.lab.client import LabServer, get_json, read_box
from tests.small_studies import shorten_preset

CLAIM = {
    "id": "C1",
    "claim": "On map A, the best agent of evo+self-taught eats more than the best agent of evo.",
    "condition": "evo+self-taught/A",
    "comparison": "evo/A",
    "measure": "best",
    "effect": 282.4,
    "interval": [211.95, 293.2],
    "p": 3e-9,
    "p_holm": 2e-8,
    "a12": 0.95,
    "verdict": "holds",
    "paper": "about 40 items more",
    "missing": [],
    "comparisons": [{}],
}


@pytest.fixture
def stored_claims(lab_server: LabServer) -> Iterator[None]:
    """Store three claims in the study `small`, of which one is exploratory."""
    study = StudyStore(lab_server.root / "small")
    undecided = CLAIM | {"id": "C2", "verdict": "undecided"}
    write_claims(study, [CLAIM, undecided, CLAIM | {"id": "C3", "kind": "exploratory"}])
    yield
    (study.directory / CLAIMS_FILE).unlink()


def read_query(page: Page) -> dict[str, str]:
    """Return the query of the address."""
    return dict(parse_qsl(page.url.partition("?")[2]))


def open_results(page: Page, query: str = "study=small&measure=best") -> None:
    page.goto(f"/#/results?{query}")
    page.get_by_test_id("curves").locator("canvas").first.wait_for()


def open_section(page: Page, name: str) -> Locator:
    """Open a folded section, and return it."""
    section = page.get_by_test_id(name)
    section.locator("summary").first.click()
    return section


def test_a_click_on_a_curve_opens_that_generation_of_the_typical_run(
    page: Page, lab_server: LabServer
) -> None:
    results = get_json(lab_server.address, "results", study="small")
    name = max(
        results["conditions"],
        key=lambda condition: results["curves"][condition]["best"]["center"][1],
    )
    open_results(page)
    plot = page.get_by_test_id("curves").locator(".u-over")
    box = read_box(plot)
    # This is the position of generation 1 of 0 to 2, where the highest curve is nearest.
    plot.click(position={"x": box["width"] / 2, "y": 1})
    expect(page.get_by_test_id("share")).to_be_visible()
    query = read_query(page)
    assert query["condition"] == name
    assert query["generation"] == "1"
    assert query["run"] == str(results["typical_run"][name])


@pytest.mark.nightly
def test_the_keyboard_opens_a_generation_of_a_curve(page: Page) -> None:
    open_results(page)
    plot = page.get_by_role("group", name="Items eaten by the best agent")
    plot.press("Home")
    plot.press("ArrowRight")
    plot.press("Enter")
    expect(page).to_have_url(re.compile(r"#/world\?.*generation=1"))


@pytest.mark.nightly
def test_the_point_of_a_run_opens_its_last_generation(page: Page, lab_server: LabServer) -> None:
    open_results(page)
    open_section(page, "finals")
    points = page.get_by_test_id("final-best").locator("a.chart-point")
    expect(points).to_have_count(4)
    names = [points.nth(number).get_attribute("aria-label") for number in range(4)]
    row = get_json(lab_server.address, "results", study="small")["runs"]["rows"][3]
    name = f"{row['condition']}, run {row['run']}: {row['best']:.1f} items eaten"
    assert f"{name}. Open the last generation." in names
    points.nth(3).focus()
    page.keyboard.press("Enter")
    expect(page).to_have_url(re.compile(r"#/world\?study=small&condition=.*&run=1&generation=2"))


def test_a_point_keeps_the_focus_when_the_width_of_its_chart_changes(page: Page) -> None:
    page.set_viewport_size({"width": 1000, "height": 700})
    open_results(page)
    open_section(page, "finals")
    boxes = page.get_by_test_id("final-best")
    points = boxes.locator("a.chart-point")
    points.nth(3).focus()
    width = boxes.locator("svg").get_attribute("width")
    page.set_viewport_size({"width": 600, "height": 700})
    expect(boxes.locator("svg")).not_to_have_attribute("width", width or "")
    expect(points.nth(3)).to_be_focused()


def test_the_address_contains_the_selected_measure_and_conditions(page: Page) -> None:
    open_results(page)
    page.get_by_test_id("measure-share").click()
    key = page.get_by_test_id("curves").get_by_role("button", name="evo/A")
    key.click()
    expect(key).to_have_attribute("aria-pressed", "false")
    expect(page).to_have_url(re.compile(r"measure=share&hidden=evo/A"))
    page.reload()
    expect(key).to_have_attribute("aria-pressed", "false")
    expect(page.get_by_test_id("measure-share")).to_have_attribute("aria-pressed", "true")


@pytest.fixture(scope="module")
def large_study(lab_server: LabServer) -> Iterator[str]:
    """Store a study of three learners with three numbers of items, called maps."""
    learners = ("evo", "self-taught", "evo+self-taught")
    maps = (5, 50, 90)
    factors = {
        f"{learner}/{count}": Factors(learner, str(count)) for learner in learners for count in maps
    }
    experiments = {
        name: shorten_preset().replace(name=name, lifetime={"steps": 20}) for name in factors
    }
    life = simulate(experiments["evo/5"], seed=5)
    study = create_study(lab_server.root / "large", list(experiments.values()), 5, factors=factors)
    for number, (name, experiment) in enumerate(experiments.items()):
        eaten = life.food_eaten * 0 + number
        energy = eaten.astype(np.float64).assign_attrs(life["energy"].attrs)
        record = life.assign(food_eaten=eaten, energy=energy)
        study.write(name, 0, record.assign_attrs(condition=name, experiment=to_toml(experiment)))
    yield "large"
    shutil.rmtree(study.directory)


def test_many_conditions_are_grouped_filtered_and_separated(page: Page, large_study: str) -> None:
    open_results(page, f"study={large_study}")
    keys = page.get_by_test_id("curves").locator(".chart-key")
    expect(keys).to_have_text(["evo", "self-taught", "evo+self-taught"])
    open_section(page, "factors")
    page.get_by_test_id("group").select_option("map")
    page.get_by_test_id("only-learner").select_option("evo")
    expect(keys).to_have_text(["5", "50", "90"])
    expect(page).to_have_url(re.compile("group=map&only.learner=evo"))
    page.get_by_test_id("group").select_option("each")
    expect(keys).to_have_text(["evo/5", "evo/50", "evo/90"])
    expect(page).not_to_have_url(re.compile("group=map"))
    page.reload()
    expect(keys).to_have_text(["evo/5", "evo/50", "evo/90"])
    open_section(page, "finals")
    expect(page.get_by_test_id("final-mean").locator("a.chart-point")).to_have_count(3)
    page.get_by_test_id("results-study").select_option("small")
    expect(page).to_have_url(re.compile(r"results\?study=small$"))


def test_many_conditions_on_several_maps_have_a_panel_for_each_map(
    page: Page, large_study: str
) -> None:
    open_results(page, f"study={large_study}&group=each")
    panels = page.get_by_test_id("curves").locator(".results-panels > *")
    expect(panels.locator(".chart-title")).to_have_text(["Map 5", "Map 50", "Map 90"])
    expect(panels.last.locator(".chart-key")).to_have_text(
        ["evo/90", "self-taught/90", "evo+self-taught/90"]
    )
    # A learner has the same line in all panels.
    strokes = [
        panels.nth(number)
        .locator(".chart-key path")
        .evaluate_all("paths => paths.map(path => path.getAttribute('stroke'))")
        for number in range(3)
    ]
    assert strokes[0] == strokes[1] == strokes[2] and len(set(strokes[0])) == 3
    # A hidden curve stays hidden after a change of the measure.
    panels.first.get_by_role("button", name="evo/5", exact=True).click()
    page.get_by_test_id("measure-mean").click()
    expect(panels.first.get_by_role("button", name="evo/5", exact=True)).to_have_attribute(
        "aria-pressed", "false"
    )
    expect(page).to_have_url(re.compile("hidden=evo/5"))


@pytest.mark.nightly
def test_a_group_curve_opens_the_curves_of_its_conditions(page: Page, large_study: str) -> None:
    open_results(page, f"study={large_study}&measure=mean")
    plot = page.get_by_role("group", name="Items eaten by the average agent")
    plot.press("Home")
    plot.press("Enter")
    keys = page.get_by_test_id("curves").locator(".chart-key")
    expect(keys).to_have_text(["evo/5", "evo/50", "evo/90"])


def test_the_table_of_runs_is_sorted_and_downloaded(
    page: Page, lab_server: LabServer, large_study: str
) -> None:
    columns = get_json(lab_server.address, "results", study=large_study)["runs"]["columns"]
    open_results(page, f"study={large_study}")
    open_section(page, "finals")
    open_section(page, "runs")
    expect(page.get_by_test_id("runs").locator("thead th")).to_have_text(
        [column["title"] for column in columns]
    )
    rows = page.get_by_test_id("runs").locator("tbody tr")
    expect(rows.first).to_contain_text("evo+self-taught/90")
    page.get_by_test_id("sort-condition").click()
    expect(rows.first).to_contain_text("evo+self-taught/5")
    with page.expect_download() as download:
        page.get_by_test_id("download-runs.csv").click()
    head, first, *_ = download.value.path().read_text().splitlines()
    assert head == ",".join(column["key"] for column in columns)
    assert first.startswith("evo/5,0,")


def test_a_claim_shows_verdict_effect_and_published_value_and_opens_both_worlds(
    page: Page, stored_claims: None
) -> None:
    open_results(page)
    expect(page.get_by_test_id("claims")).to_contain_text(
        "1 holds, 1 is undecided, 1 is exploratory and not counted."
    )
    expect(page.get_by_test_id("claims").get_by_role("heading")).to_have_text("The paper's claims")
    open_section(page, "claims")
    claim = page.get_by_test_id("claim-C1")
    expect(claim).to_contain_text("+282 (95 % interval 212 to 293), corrected p below 0.001")
    expect(claim).to_contain_text("about 40 items more")
    claim.get_by_role("link", name="evo+self-taught/A and evo/A").click()
    expect(page.get_by_test_id("world-b")).to_be_visible()


@pytest.mark.nightly
def test_custom_claims_of_a_study_have_no_published_value(
    page: Page, lab_server: LabServer, stored_claims: None
) -> None:
    write_claims(StudyStore(lab_server.root / "small"), [CLAIM | {"paper": "", "figure": None}])
    open_results(page)
    section = page.get_by_test_id("claims")
    expect(section.get_by_role("heading")).to_have_text("The claims")
    expect(section).to_contain_text("Watch")
    expect(section).not_to_contain_text("The paper")


def test_manually_changed_claims_are_not_shown(
    page: Page, lab_server: LabServer, stored_claims: None
) -> None:
    path = lab_server.root / "small" / CLAIMS_FILE
    path.write_text(path.read_text().replace('"undecided"', '"holds"'))
    open_results(page)
    section = page.get_by_test_id("claims")
    expect(section.get_by_test_id("claims-problem")).to_contain_text(
        "claims.json was not written by a report"
    )
    expect(section).not_to_contain_text("holds")


def test_a_study_without_a_paper_has_no_section_of_claims(page: Page) -> None:
    open_results(page)
    expect(page.get_by_test_id("claims")).to_have_count(0)
    expect(page.get_by_test_id("report-link")).to_have_count(0)


def test_the_conditions_are_compared_as_in_the_report(page: Page, lab_server: LabServer) -> None:
    open_results(page)
    section = open_section(page, "comparison")
    table = section.get_by_role("region", name="Comparison of conditions")
    expect(table.locator("tbody tr")).to_have_count(2)
    expect(table.locator("thead th")).to_have_text(
        ["Condition", "Verdict", "Effect [95 % interval]", "Runs"]
    )
    tests = section.get_by_role("region", name="Tests")
    expect(tests).to_be_hidden()
    section.get_by_text("Tests: p, corrected p and A12").click()
    expect(tests.locator("thead th")).to_have_text(["Condition", "p", "Corrected p", "A12"])
    expect(section).to_contain_text(
        "With 2 runs and 2 tests, the smallest corrected p-value is 0.67."
        " At least 5 runs are needed."
    )
    expect(section).to_contain_text("--runs 5")
    expect(section.locator("tbody .badge").first).to_have_text("too few runs")
    expect(section.locator("td small").first).to_contain_text("runs would decide this")
    rows = get_json(lab_server.address, "results", study="small")["comparison"]["rows"]
    expected = bl.open_study(lab_server.root / "small").compare()
    assert [row["effect"] for row in rows] == expected["effect"].tolist()


def test_an_unknown_study_shows_a_message_and_a_menu_of_studies(page: Page) -> None:
    page.goto("/#/results?study=gone")
    expect(page.get_by_test_id("results-empty")).to_contain_text("gone is not in this folder.")
    page.get_by_test_id("results-study").select_option("small")
    expect(page.get_by_test_id("curves")).to_be_visible()


def test_a_report_opens_if_it_exists(page: Page, lab_server: LabServer) -> None:
    report = lab_server.root / "small" / "report.html"
    report.write_text("<h1>The report</h1>")
    open_results(page)
    with page.expect_popup() as popup:
        page.get_by_test_id("report-link").click()
    expect(popup.value.get_by_role("heading", name="The report")).to_be_visible()
    report.unlink()


def test_the_links_of_a_report_open_figures_save_files_and_watch_lifetimes(
    page: Page, lab_server: LabServer
) -> None:
    study = lab_server.root / "small"
    bl.open_study(study).report()
    try:
        open_results(page)
        with page.expect_popup() as popup:
            page.get_by_test_id("report-link").click()
        report = popup.value
        for kind, signature in {"pdf": b"%PDF", "csv": b"condition,"}.items():
            with report.expect_download() as download:
                report.get_by_role("link", name=kind.upper(), exact=True).first.click()
            assert download.value.suggested_filename == f"fitness.{kind}"
            assert download.value.path().read_bytes().startswith(signature)
        for kind in ("svg", "png"):
            report.get_by_role("link", name=kind.upper(), exact=True).first.click()
            expect(report).to_have_url(re.compile(rf"figures/fitness\.{kind}$"))
            expect(report.locator("svg, img").first).to_be_visible()
            report.go_back()
        report.locator(".watch a").first.click()
        expect(report.locator("[data-ready]").first).to_be_visible()
    finally:
        (study / "report.html").unlink()
        shutil.rmtree(study / "figures")


def test_five_number_summaries_and_ticks_are_correct(page: Page) -> None:
    page.goto("/#/results")
    values = page.evaluate(
        """async () => {
            const { computeBoxStatistics } = await import("/charts/svg_charts.js");
            const { chooseTicks } = await import("/core/drawing.js");
            return [
                computeBoxStatistics([9, 1, 2, 3, 4, 100]),
                chooseTicks(0, 437),
                chooseTicks(0, 0.9),
                chooseTicks(-50, 0),
                chooseTicks(-3, 8),
            ];
        }"""
    )
    assert values[0] == {"low": 1, "first": 2.25, "median": 3.5, "third": 7.75, "high": 9}
    assert values[1] == [0, 100, 200, 300, 400, 500]
    assert values[2] == [0, 0.2, 0.4, 0.6, 0.8, 1]
    assert values[3] == [-50, -40, -30, -20, -10, 0]
    assert values[4] == [-5, 0, 5, 10]


def test_the_range_of_an_axis_includes_0_and_all_numbers(page: Page) -> None:
    page.goto("/#/results")
    ranges = page.evaluate(
        """async () => {
            const { computeRange } = await import("/core/drawing.js");
            const lists = [[[-50]], [[2, 7], [-1]], [[0, 0]], [[null, NaN]], [], [[null, 5, NaN]]];
            return lists.map(numbers => computeRange(...numbers));
        }"""
    )
    assert ranges == [[-50, 0], [-1, 7], [0, 1], [0, 1], [0, 1], [0, 5]]
