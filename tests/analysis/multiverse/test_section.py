"""The section on every variant: what it says follows from the numbers, and a browser shows it."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from playwright.sync_api import Browser

from baldwinlab.analysis.multiverse.analysis import read_multiverse, write_multiverse
from baldwinlab.analysis.multiverse.records import Multiverse
from baldwinlab.analysis.multiverse.section import (
    StandardStudy,
    compose_lead,
    explain_differences,
    make_section,
)
from baldwinlab.analysis.multiverse.sentences import compose_sentences, describe_combinations
from baldwinlab.analysis.report.sections import write_page
from baldwinlab.analysis.results.verdicts import HOLDS, UNDECIDED, Verdict
from baldwinlab.studies.multiverse import vary_one_at_a_time
from tests.analysis.multiverse.variants import (
    NO_MEALS,
    TAUGHT_BEAT_EVOLVED,
    multiverse_of,
    variant_of,
    with_gain,
)
from tests.analysis.report.browsing import errors_and_width


def small_multiverse() -> Multiverse:
    standard = variant_of(eaten=with_gain(240))
    return multiverse_of(standard, variant_of("biases"), variant_of("rank", TAUGHT_BEAT_EVOLVED))


def full_multiverse() -> Multiverse:
    return multiverse_of(
        *small_multiverse().variants, variant_of("biases+rank", TAUGHT_BEAT_EVOLVED)
    )


C6 = "C6 (self-teaching alone does not exceed evolution on map A)"


def test_sentences_name_robust_claims_and_the_choices_that_change_others() -> None:
    sentences = compose_sentences(small_multiverse())
    start = "These claims hold under every variant: C1 (learning helps the best"
    assert sentences[0].startswith(start)
    assert "C6" not in sentences[0]
    for sentence in (
        f"{C6} holds under the standard variant and biases (R3); does not hold under rank (R4).",
        "The standard variant is at a distance of 5.00: +240 for C1 and +240 for C2.",
        "All these values are inside the measured 95 % intervals under biases (R3) and rank (R4).",
        "Under the standard variant and biases (R3), all 9 claims hold.",
    ):
        assert sentence in sentences
    nearest = "(+40 for C1 and +40 for C2) is biases (R3): +40.0 for C1"
    assert any(nearest in sentence for sentence in sentences)


def test_many_variants_are_counted_and_few_are_named() -> None:
    names = [variant.name for variant in vary_one_at_a_time()[1:]]
    rank = variant_of("rank", TAUGHT_BEAT_EVOLVED)
    sentences = compose_sentences(
        multiverse_of(variant_of(), *(variant_of(name) for name in names[:5]), rank)
    )
    counted = "holds under the standard variant and 5 others; does not hold under rank (R4)"
    assert any(counted in sentence for sentence in sentences)
    assert f"{C6} does not hold under any variant." in compose_sentences(multiverse_of(rank))


def test_variants_without_effect_and_claims_that_never_hold_are_named() -> None:
    sentences = compose_sentences(
        multiverse_of(variant_of(eaten=NO_MEALS), variant_of("open-boundaries", NO_MEALS))
    )
    equal = "All verdicts and effects equal those of the standard variant under open-boundaries"
    assert f"{equal} (R8)." in sentences
    start = "These claims hold under no variant: C1, C2, C4"
    assert any(sentence.startswith(start) for sentence in sentences)
    lone = compose_sentences(multiverse_of(variant_of(eaten={"evo/A": [1, 2]})))
    assert lone[0] == "No claim holds under every variant."
    assert "No claim holds under any variant." in lone
    assert any("C1" in sentence and "because runs are missing" in sentence for sentence in lone)


def test_combinations_name_the_choice_with_the_largest_effect() -> None:
    sentences = describe_combinations(full_multiverse())
    assert sentences[0] == "C1 holds under 100 % of 4 combinations and fails under 0 %."
    assert sentences[5] == (
        "C6 holds under 50 % of 4 combinations and fails under 50 %. The choice with the largest "
        "effect is R4: the claim holds under 100 % with standard and 0 % with rank."
    )
    assert describe_combinations(small_multiverse()) == []


@pytest.mark.usefixtures("placeholder_figures")
def test_a_study_with_more_runs_has_an_explanation_of_its_other_verdicts(tmp_path: Path) -> None:
    few = small_multiverse()
    verdicts: dict[str, Verdict] = {claim.id: HOLDS for claim in few.claims}
    verdicts["C6"] = UNDECIDED
    undecided = StandardStudy(verdicts, (30, 30))
    sentences = explain_differences(few, undecided)
    assert "This study has 30 runs of each condition, and every variant has 8." in sentences
    assert "Some verdicts therefore differ: C6 (is undecided with 30, holds with 8)." in sentences
    made = make_section(few, tmp_path, undecided)
    assert made.claims_note == sentences and sentences in made.body


def test_equal_runs_or_equal_verdicts_need_no_explanation() -> None:
    few = small_multiverse()
    verdicts: dict[str, Verdict] = {claim.id: HOLDS for claim in few.claims}
    assert explain_differences(few, StandardStudy(verdicts, (30, 30))) == ""
    verdicts["C6"] = UNDECIDED
    equal_runs = StandardStudy(verdicts, few.variants[0].runs)
    assert explain_differences(few, equal_runs) == ""


@pytest.mark.usefixtures("placeholder_figures")
def test_the_section_is_made_from_the_json_and_saves_its_figures(tmp_path: Path) -> None:
    multiverse = read_multiverse(write_multiverse(full_multiverse(), tmp_path / "multiverse.json"))
    made = make_section(multiverse, tmp_path / "figures")
    assert made == make_section(full_multiverse(), tmp_path / "again")
    assert (made.anchor, made.title) == ("variants", "Variants of the paper")
    names = {
        f"{name}.{end}"
        for name in ("variants", "variants-shares")
        for end in ("svg", "pdf", "png", "csv")
    }
    assert {path.name for path in (tmp_path / "figures").iterdir()} == names
    text = re.sub(r'"data:[^"]*"', "", made.body)
    assert "nan" not in text.lower() and "None" not in text
    assert "C1, paper +40" in text
    assert "R4: the probability of a parent grows linearly with its rank" in text


@pytest.mark.usefixtures("placeholder_figures")
def test_a_browser_shows_the_page_without_errors_or_horizontal_scrolling(
    browser: Browser, tmp_path: Path
) -> None:
    several = full_multiverse()
    page = write_page(
        "Every variant",
        compose_lead(several),
        [make_section(several, tmp_path)],
        tmp_path / "report.html",
        tmp_path,
    )
    for width, height in ((1280, 900), (390, 844)):  # on a desk, on a phone
        assert errors_and_width(browser, page, width, height) == ([], width)
