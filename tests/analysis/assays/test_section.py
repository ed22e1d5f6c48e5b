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
from baldwinlab.analysis.assays.evaluation import Assays
from baldwinlab.analysis.assays.section import make_section, tabulate_numbers
from baldwinlab.analysis.report.sections import Section, write_page
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
from tests.analysis.report.browsing import errors_and_width

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


NOT_HELPFUL = "not all comparisons show that learning raises fitness"


@pytest.mark.parametrize(
    ("off", "on", "drift", "start", "sentences"),
    [
        (
            *(rising(0, 100), rising(50, 100), constant(5)),
            "learning raises fitness; innate fitness and the innate share rise",
            [f"the innate share rise in {A}", "The gain from learning falls"],
        ),
        (
            *(constant(10), rising(20, 200), constant(5)),
            "learning raises fitness; innate fitness or the innate share does not rise",
            ["a larger part of their fitness by learning", "The gain from learning rises"],
        ),
        (
            *(constant(0), rising(10, 100), constant(5)),
            "",
            ["no agent eats without learning", "so innate fitness cannot rise"],
        ),
        (
            *(rising(10, 90), rising(10, 80), constant(5)),
            NOT_HELPFUL,
            ["Answered no: Does learning raise fitness?"],
        ),
        (
            *(constant(1), rising(10, 90), rising(20, 99)),
            NOT_HELPFUL,
            ["Random changes help more than learning."],
        ),
    ],
    ids=["assimilation", "larger learned part", "only with learning", "no help", "drift"],
)
def test_the_headline_and_the_sentences_state_the_effect_of_learning(
    off: Any, on: Any, drift: Any, start: str, sentences: list[str]
) -> None:
    text = text_on(innate=innate(A, off=off, on=on, drift=drift), within_life=LEARNERS)
    assert text.startswith(start)
    for sentence in sentences:
        assert sentence in text
    assert "opposite" not in text


def test_lamarckian_inheritance_is_no_evidence_for_the_baldwin_effect() -> None:
    data = innate(A, off=rising(0, 100), on=rising(50, 100), drift=constant(5))
    assert "Lamarckian" not in text_on(innate=data)
    data.attrs["experiment"] = data.attrs["experiment"].replace(
        "lamarckian_share = 0.0", "lamarckian_share = 1.0"
    )
    assert "not evidence for the Baldwin effect" in text_on(innate=data)


def test_comparisons_with_the_paper_and_with_selection_are_stated() -> None:
    text = text_on(
        innate=innate(A, off=constant(1), on=constant(9)), within_life=within_life(A, 9, 2)
    )
    assert f"contradicts that comparison in {A}" in text
    assert "contradicts" not in text_on(within_life=LEARNERS)
    # Effects of selection are compared with the neutral control.
    text = text_on(
        innate=innate(A, off=constant(1), on=constant(9)), neutral=neutral(A, (5, 50), (5, 20))
    )
    assert "innate fitness is 5.28 against 5.28 (both are equal in every run)" in text
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
    # One run allows no verdict.
    text = text_on(
        innate=innate(A, off=rising(1, 50), on=rising(30, 60), drift=constant(1), runs=1)
    )
    assert text.startswith("too few runs for a verdict on the effect of learning on fitness")
    assert "The gain from learning does not change significantly (too few runs" in text
    assert "with learning. The runs are too few to establish a difference." in text
    few_modules = modules(A, (100, 90, 3, 10)).isel(run=[0, 1])
    assert "improves fitness (too few runs to establish a difference)" in text_on(
        modules=few_modules
    )


@pytest.mark.usefixtures("placeholder_figures")
def test_the_section_says_how_many_runs_a_verdict_needs(tmp_path: Path) -> None:
    few = make_section(
        {"innate": {A: innate(A, off=rising(1, 2), on=rising(50, 60), runs=5)}}, tmp_path
    )
    sentence = (
        "With 5 runs and 4 tests, the smallest corrected p-value is 0.25. "
        "At least 8 runs are needed."
    )
    assert sentence in few.body and few.summary.endswith(sentence)
    assert (
        "</span> too few runs</span>" in few.body
        and "(too few runs to establish a difference)" in few.body
    )
    enough = make_section(
        {"innate": {A: innate(A, off=rising(1, 2), on=rising(50, 60), runs=8)}}, tmp_path
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
    return re.sub(r'"data:[^"]*"', "", path.read_text("utf-8"))


def test_the_section_has_verdict_questions_figures_and_numbers(
    page: Path, section: Section
) -> None:
    text = text_of(page)
    verdict = "learning raises fitness; innate fitness and"
    assert f"<strong>On map A (evo+self-taught)</strong>: {verdict}" in text
    headings = [f"<h3>{name}" for name in ("Fitness with learning", "Innate fitness", "Mechanism")]
    order = ["On map B", *headings, "<figure", "All numbers of the assays"]
    assert [text.index(part) for part in order] == sorted(map(text.index, order))
    assert text.count("<figure") == 7 and "✓" in text and "✗" in text
    assert "nan" not in text.lower()
    names = {path.name for path in page.parent.iterdir()}
    assert names == {"page.html", "figures", "baldwin.json", "baldwin.csv"}
    assert len(list((page.parent / "figures").glob("baldwin-*.svg"))) == 7
    # Its verdict is its summary.
    assert section.summary.startswith(f"On map A (evo+self-taught): {verdict}")
    assert "On map B" in section.summary


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
        text = re.sub(r'"data:[^"]*"', "", section.body)
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
    measure = "fitness, learning off (innate fitness)"
    assert (rows[0]["measure"], rows[0]["when"]) == (measure, "first")
    assert not any(row["measure"] == "fitness, learning on" for row in rows)
    assert set(rows[0]["numbers"]) == {A, "evo/A"}


@pytest.mark.parametrize(("width", "height"), [(1280, 900), (390, 844)], ids=["desk", "phone"])
def test_a_browser_shows_it_without_scrolling_sideways(
    browser: Browser,
    page: Path,
    width: int,
    height: int,
) -> None:
    assert errors_and_width(browser, page, width, height) == ([], width)


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
    body = re.sub(r'"data:[^"]*"', "", section.body)
    for name in conditions:
        assert f"<p><strong>{name}</strong></p>" in body
    assert "the average agent gains" in body and "born with their genome at death" in body
    assert not re.search(r"\b(eats?|food|weights)\b", re.sub(r"eat/weights|\bfood\b", "", body))
