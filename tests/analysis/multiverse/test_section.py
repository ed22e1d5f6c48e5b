"""The section on every variant: what it says follows from the numbers, and a browser shows it."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from playwright.sync_api import Browser

from baldwinlab.analysis.multiverse.analysis import Multiverse, read, write
from baldwinlab.analysis.multiverse.section import (
    Beside,
    combinations,
    lead,
    other_runs,
    section,
    verdict,
)
from baldwinlab.analysis.report import write_page
from baldwinlab.analysis.statistics.rules import HOLDS, UNDECIDED
from baldwinlab.studies.multiverse import one_at_a_time
from tests.analysis.multiverse.variants import (
    NOBODY_EATS,
    TAUGHT_BEAT_EVOLVED,
    multiverse_of,
    variant_of,
    with_gain,
)
from tests.analysis.report.browsing import complaints_and_width

STANDARD = variant_of(eaten=with_gain(240))


def small_multiverse() -> Multiverse:
    return multiverse_of(STANDARD, variant_of("biases"), variant_of("rank", TAUGHT_BEAT_EVOLVED))


def full_multiverse() -> Multiverse:
    return multiverse_of(
        *small_multiverse().variants, variant_of("biases+rank", TAUGHT_BEAT_EVOLVED)
    )


def test_the_verdict_names_what_no_choice_overturns_and_what_one_does() -> None:
    said = verdict(small_multiverse())
    assert said[0].startswith(
        "No single open choice overturns what holds under every variant: C1 (learning helps the best"
    )
    assert "C6" not in said[0]
    assert (
        "C6 (self-teaching alone does not exceed evolution on map A) holds under the standard variant and biases (R3); "
        "does not hold under rank (R4)." in said
    )
    assert "The standard variant is at a distance of 5.00: +240 for C1 and +240 for C2." in said
    assert any(
        "(+40 for C1 and +40 for C2) comes biases (R3): +40.0 for C1" in sentence
        for sentence in said
    )
    assert (
        "These figures all lie inside the measured 95 % intervals under biases (R3) and rank (R4)."
        in said
    )
    assert "Under the standard variant and biases (R3), all 9 claims hold." in said


def test_many_variants_are_counted_and_few_are_named() -> None:
    names = [variant.name for variant in one_at_a_time()[1:]]
    said = verdict(
        multiverse_of(
            variant_of(),
            *(variant_of(name) for name in names[:5]),
            variant_of("rank", TAUGHT_BEAT_EVOLVED),
        )
    )
    assert any(
        "holds under the standard variant and 5 others; does not hold under rank (R4)" in sentence
        for sentence in said
    )


def test_what_fails_everywhere_is_said_without_a_double_meaning() -> None:
    said = verdict(multiverse_of(variant_of("rank", TAUGHT_BEAT_EVOLVED)))
    assert (
        "C6 (self-teaching alone does not exceed evolution on map A) does not hold under any variant."
        in said
    )


def test_where_nothing_holds_or_nothing_changes_it_says_so() -> None:
    said = verdict(
        multiverse_of(variant_of(eaten=NOBODY_EATS), variant_of("open-boundaries", NOBODY_EATS))
    )
    assert (
        "Every verdict and every effect is the standard variant's under open-boundaries (R8)."
        in said
    )
    assert any(sentence.startswith("Holding under no variant: C1, C2, C4") for sentence in said)
    lone = verdict(multiverse_of(variant_of(eaten={"evo/A": [1, 2]})))
    assert (
        lone[0] == "No claim holds under every variant."
        and "No claim holds under any variant." in lone
    )
    assert any("C1" in sentence and "for want of runs" in sentence for sentence in lone)


def test_of_all_combinations_it_names_the_choice_that_moves_a_claim_most() -> None:
    said = combinations(full_multiverse())
    assert said[0] == "C1 holds under 100% of 4 combinations, does not under 0%."
    assert said[5] == (
        "C6 holds under 50% of 4 combinations, does not under 50%; the choice that moves it most is R4: 100% with standard, "
        "0% with rank."
    )
    assert combinations(small_multiverse()) == []


def test_beside_a_study_of_more_runs_it_says_why_verdicts_differ(tmp_path: Path) -> None:
    few = small_multiverse()
    undecided = Beside(
        dict.fromkeys([claim.id for claim in few.claims], HOLDS) | {"C6": UNDECIDED}, (30, 30)
    )
    said = other_runs(few, undecided)
    assert "30 of each condition and 8 under every variant" in said
    assert (
        "some verdicts differ: C6 (is undecided with 30, holds with 8). That is no contradiction"
        in said
    )
    made = section(few, tmp_path, undecided)
    assert made.of_claims == said and said in made.body


def test_of_equal_runs_or_equal_verdicts_there_is_nothing_to_explain() -> None:
    few = small_multiverse()
    all_hold = dict.fromkeys([claim.id for claim in few.claims], HOLDS)
    assert other_runs(few, Beside(all_hold, (30, 30))) == ""
    assert other_runs(few, Beside(all_hold | {"C6": UNDECIDED}, few.variants[0].runs)) == ""


def test_the_section_is_made_of_the_json_alone_and_keeps_its_figures(tmp_path: Path) -> None:
    found = read(write(full_multiverse(), tmp_path / "multiverse.json"))
    made = section(found, tmp_path / "figures")
    assert made == section(full_multiverse(), tmp_path / "again")
    assert (made.anchor, made.title) == ("every-variant", "Every variant")
    names = {
        f"{name}.{end}" for name in ("variants", "variants-shares") for end in ("svg", "png", "csv")
    }
    assert {path.name for path in (tmp_path / "figures").iterdir()} == names
    text = re.sub(r'src="[^"]*"', "", made.body)
    assert "nan" not in text.lower() and "None" not in text
    assert (
        "C1, paper +40" in text
        and "R4: the probability of a parent grows linearly with its rank" in text
    )


@pytest.mark.parametrize(("width", "height"), [(1280, 900), (390, 844)], ids=["desk", "phone"])
def test_a_browser_shows_the_page_without_complaint_and_without_scrolling_sideways(
    browser: Browser, tmp_path: Path, width: int, height: int
) -> None:
    several = full_multiverse()
    page = write_page(
        "Every variant",
        lead(several),
        [section(several, tmp_path)],
        tmp_path / "report.html",
        tmp_path,
    )
    assert complaints_and_width(browser, page, width, height) == ([], width)
