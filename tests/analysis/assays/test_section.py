"""Section of a report on the Baldwin effect: sentences, figures and its layout in a browser."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from playwright.sync_api import Browser

from baldwinlab import papers
from baldwinlab.analysis.assays import sentences as wording
from baldwinlab.analysis.assays.analysis import evaluate_assays
from baldwinlab.analysis.assays.section import make_section, tabulate_numbers
from baldwinlab.analysis.assays.values import Assays
from baldwinlab.analysis.report import write_page
from baldwinlab.analysis.report.sections import Section
from baldwinlab.experiment.toml import to_toml
from baldwinlab.papers.presets import load
from tests.analysis.assays.artificial_assays import (
    constant,
    innate,
    make_all_assays,
    modules,
    neutral,
    rising,
    within_life,
)

A = "evo+self-taught/A"
B = "evo+self-taught/B"


def text_on(**assays: xr.Dataset) -> str:
    """Return the headline and the sentences on one condition."""
    stored: dict[str, Any] = {name.replace("_", "-"): {A: data} for name, data in assays.items()}
    analysis = evaluate_assays(stored)
    (result,) = analysis.results
    inference = papers.load().texts.inference
    assert inference is not None
    comparison = wording.compare_with_paper(analysis, inference)
    sentences = wording.compose_sentences(analysis, result)
    return " ".join([wording.compose_headline(result, analysis.terms), comparison, *sentences])


LEARNERS = within_life(A, 1, 9)


def test_the_headline_says_that_innate_fitness_and_its_share_rise() -> None:
    text = text_on(
        innate=innate(A, off=rising(0, 100), on=rising(50, 100), drift=constant(5)),
        within_life=LEARNERS,
    )
    assert text.startswith("learning raises fitness; innate fitness and the innate share rise")
    assert f"the innate share rise in {A}" in text and "The gain from learning falls" in text


def test_the_headline_says_that_the_innate_share_does_not_rise() -> None:
    text = text_on(
        innate=innate(A, off=constant(10), on=rising(20, 200), drift=constant(5)),
        within_life=LEARNERS,
    )
    assert text.startswith(
        "learning raises fitness; innate fitness or the innate share does not rise"
    )
    assert (
        "a larger part of their fitness by learning" in text
        and "The gain from learning rises" in text
    )


def test_if_no_agent_eats_without_learning_the_ability_to_learn_evolves() -> None:
    text = text_on(
        innate=innate(A, off=constant(0), on=rising(10, 100), drift=constant(5)),
        within_life=LEARNERS,
    )
    assert "no agent eats without learning" in text
    assert "so innate fitness cannot rise" in text and "opposite" not in text


def test_learning_that_does_not_help_is_no_baldwin_effect() -> None:
    text = text_on(
        innate=innate(A, off=rising(10, 90), on=rising(10, 80), drift=constant(5)),
        within_life=LEARNERS,
    )
    assert (
        text.startswith("not all comparisons show that learning raises fitness")
        and "Answered no: Does learning raise fitness?" in text
    )


def test_lamarckian_inheritance_is_no_evidence_for_the_baldwin_effect() -> None:
    data = innate(A, off=rising(0, 100), on=rising(50, 100), drift=constant(5))
    assert "Lamarckian" not in text_on(innate=data)
    data.attrs["experiment"] = data.attrs["experiment"].replace(
        "lamarckian_share = 0.0", "lamarckian_share = 1.0"
    )
    assert "not evidence for the Baldwin effect" in text_on(innate=data)


def test_drift_that_helps_as_much_as_learning_is_reported() -> None:
    text = text_on(
        innate=innate(A, off=constant(1), on=rising(10, 90), drift=rising(20, 99)),
        within_life=LEARNERS,
    )
    assert (
        text.startswith("not all comparisons show that learning raises fitness")
        and "Random changes help as much as learning." in text
    )


def test_contradictions_of_the_paper_are_reported() -> None:
    text = text_on(
        innate=innate(A, off=constant(1), on=constant(9)), within_life=within_life(A, 9, 2)
    )
    assert f"contradicts that comparison in {A}" in text
    assert "contradicts" not in text_on(within_life=LEARNERS)


def test_effects_of_selection_are_compared_with_the_neutral_control() -> None:
    text = text_on(
        innate=innate(A, off=constant(1), on=constant(9)), neutral=neutral(A, (5, 50), (5, 20))
    )
    assert "innate fitness is 5.28 against 5.28 (selection does not increase it)" in text
    assert "the gain from learning is 47.5 against 15.8 (selection increases it)" in text


def test_unmeasured_criteria_are_named() -> None:
    text = text_on(innate=innate(A, off=rising(1, 50), on=rising(30, 60)))
    assert (
        "Not measured: Does learning help more than random changes? "
        "Does evolution improve agents that learn?" in text
    )
    assert "newborns" not in text and "random weight changes" not in text
    modules_text = text_on(modules=modules(A, (100, 90, 3, 10)))
    assert (
        modules_text.startswith("unknown")
        and "only the reinforcement module alone improves fitness" in modules_text
    )


def test_one_run_allows_no_verdict() -> None:
    text = text_on(
        innate=innate(A, off=rising(1, 50), on=rising(30, 60), drift=constant(1), runs=1)
    )
    assert text.startswith("too few runs for a verdict on the effect of learning on fitness")


@pytest.mark.usefixtures("placeholder_figures")
def test_the_section_says_how_many_runs_a_verdict_needs(tmp_path: Path) -> None:
    few = make_section(
        {"innate": {A: innate(A, off=constant(1), on=constant(50), runs=5)}}, tmp_path
    )
    sentence = (
        "With 5 runs and 5 tests, the smallest corrected p-value is 0.31. "
        "At least 8 runs are needed."
    )
    assert sentence in few.body and few.summary.endswith(sentence)
    assert (
        "</span> too few runs</span>" in few.body
        and "(too few runs to establish a difference)" in few.body
    )
    enough = make_section(
        {"innate": {A: innate(A, off=constant(1), on=constant(50), runs=8)}}, tmp_path
    )
    assert "too few runs" not in enough.body and "smallest corrected" not in enough.summary


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("study")


# Tests of the figures draw them.
@pytest.fixture(scope="module")
def section(folder: Path, placeholder_figures_of_module: None) -> Section:
    return make_section(make_all_assays(), folder)


@pytest.fixture(scope="module")
def page(folder: Path, section: Section) -> Path:
    return write_page("A study", "Its assays.", [section], folder / "page.html", folder / "figures")


def text_of(path: Path) -> str:
    return re.sub(r'src="[^"]*"', "", path.read_text("utf-8"))


def test_the_section_has_verdict_questions_figures_and_numbers(page: Path) -> None:
    text = text_of(page)
    assert (
        "<strong>On map A (evo+self-taught)</strong>: learning raises fitness; innate fitness and"
        in text
    )
    assert (
        text.index("On map B")
        < text.index("<h3>Fitness with learning")
        < text.index("<h3>Innate fitness")
        < text.index("<h3>Mechanism")
    )
    assert (
        text.index("<h3>Mechanism")
        < text.index("<figure")
        < text.index("All numbers of the assays")
    )
    assert text.count("<figure") == 7 and "✓" in text and "✗" in text
    assert "nan" not in text.lower()
    names = {path.name for path in page.parent.iterdir()}
    assert names == {"page.html", "figures", "baldwin.json", "baldwin.csv"}
    assert len(list((page.parent / "figures").glob("baldwin-*.svg"))) == 7


def test_its_verdict_is_its_summary(section: Section) -> None:
    assert (
        section.summary.startswith(
            "On map A (evo+self-taught): learning raises fitness; innate fitness and"
        )
        and "On map B" in section.summary
    )


@pytest.mark.usefixtures("placeholder_figures")
def test_a_figure_s_numbers_are_the_medians_that_it_draws(tmp_path: Path) -> None:
    make_section({"innate": {A: innate(A, off=constant(2), on=constant(9))}}, tmp_path)
    first, *rows = (tmp_path / "figures" / "baldwin-lives.csv").read_text().splitlines()
    assert first.startswith("condition,quantity,generation,life,median,low,high")
    assert any(row.startswith(f"{A},energy,0,off,2.") for row in rows)


@pytest.mark.usefixtures("placeholder_figures")
def test_a_single_assay_of_a_single_run_has_a_section_too(tmp_path: Path) -> None:
    for assay, conditions in make_all_assays(runs=1).items():
        section = make_section({assay: conditions}, tmp_path / assay)
        text = re.sub(r'src="[^"]*"', "", section.body)
        assert "not measured" in text and "nan" not in text.lower(), assay


def test_without_a_condition_that_evolves_and_learns_there_are_only_numbers(tmp_path: Path) -> None:
    stored: Assays = {"innate": {"evo/A": innate("evo/A", off=constant(3))}}
    text = make_section(stored, tmp_path).body
    assert (
        "so the criteria do not apply" in text
        and "<figure" not in text
        and "fitness, learning off (innate fitness)" in text
    )


def test_the_table_has_a_row_for_each_quantity_and_leaves_blank_what_there_is_not() -> None:
    data = innate(A, off=constant(1), on=constant(2))
    data["energy"].loc[{"life": "on"}] = np.nan
    rows = tabulate_numbers(
        evaluate_assays({"innate": {A: data, "evo/A": innate("evo/A", off=constant(1))}})
    )
    assert (rows[0]["measure"], rows[0]["when"]) == (
        "fitness, learning off (innate fitness)",
        "first",
    )
    assert not any(row["measure"] == "fitness, learning on" for row in rows)
    assert set(rows[0]["numbers"]) == {A, "evo/A"}


@pytest.mark.parametrize(("width", "height"), [(1280, 900), (390, 844)], ids=["desk", "phone"])
def test_a_browser_shows_it_without_scrolling_sideways(
    browser: Browser,
    page: Path,
    width: int,
    height: int,
) -> None:
    opened = browser.new_page(viewport={"width": width, "height": height})
    complaints: list[str] = []
    opened.on("console", lambda message: complaints.append(message.text))
    opened.goto(page.as_uri())
    opened.evaluate("document.querySelectorAll('details').forEach(part => part.open = true)")
    assert opened.evaluate("document.documentElement.scrollWidth") <= width
    assert opened.evaluate(
        "[...document.images].every(image => image.complete && image.naturalWidth > 0)"
    )
    assert complaints == []
    opened.close()


@pytest.mark.usefixtures("placeholder_figures")
def test_terms_of_a_model_without_food_leave_names_and_commands_unchanged(tmp_path: Path) -> None:
    preset = load("hinton-nowlan-1987:guessing")
    conditions = {}
    for name in ("food", "eat/weights"):
        assay = innate(A, on=rising(4, 9), off=rising(1, 2), frozen=rising(5, 12))
        provenance = {"experiment": to_toml(preset.replace(name=name)), "learner": name, "map": ""}
        conditions[name] = assay.assign_attrs(provenance)
    section = make_section({"innate": conditions}, tmp_path)
    assert section.summary.startswith("On food: ") and "On eat/weights: " in section.summary
    body = re.sub(r'src="[^"]*"', "", section.body)
    for name in conditions:
        assert f"<p><strong>{name}</strong></p>" in body
    assert "the average agent gains" in body and "born with their genome at death" in body
    assert not re.search(r"\b(eats?|food|weights)\b", re.sub(r"eat/weights|\bfood\b", "", body))
