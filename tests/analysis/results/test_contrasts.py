"""Tests of comparisons of conditions, on small hand-made studies."""

from __future__ import annotations

from dataclasses import replace

import pytest

from baldwinlab.analysis import statistics
from baldwinlab.analysis.results.contrasts import (
    COMPARISON_COLUMNS,
    find_references,
    planned_tests,
)
from baldwinlab.analysis.results.headlines import summarize_contrasts
from baldwinlab.analysis.statistics.significance import describe_too_few
from baldwinlab.experiment.conditions import Factors
from tests.analysis.results.studies import compare_conditions, study

HIGH = range(100, 108)
LOW = range(10, 18)
MIXED = [5, 6, 7, 8, 104, 105, 106, 107]
NOTHING = float("nan")


def factors(*names: str) -> dict[str, Factors]:
    """Return factors as a study stores them: a name with a slash is LEARNER/MAP."""
    return {name: Factors(*name.split("/")) if "/" in name else Factors(name) for name in names}


def test_each_condition_is_compared_with_the_first_on_its_map() -> None:
    contrasts = compare_conditions(
        study({"evo/A": LOW, "evo/B": LOW, "evo+drift/A": HIGH, "evo+lamarckian/B": LOW})
    )
    pairs = {(row.condition, row.reference) for row in contrasts.rows}
    assert pairs == {("evo+drift/A", "evo/A"), ("evo+lamarckian/B", "evo/B")}
    assert [row.measure for row in contrasts.rows] == ["mean", "best"] * 2
    assert contrasts.pairing == "Each condition is compared with the first condition in its world."


@pytest.mark.parametrize(
    ("names", "pairs"),
    [
        (["evo/B", "own"], {}),
        (["one", "two", "three"], {"two": "one", "three": "one"}),  # a model without maps
        (["evo/A", "evo/B"], {}),
        (["evo/A", "own", "other"], {"other": "own"}),
        (["evo/A", "evo/B", "drift/B"], {"drift/B": "evo/B"}),
        (["evo/A", "drift/A", "own", "evo/C"], {"drift/A": "evo/A"}),
        (["evo/A"], {}),
    ],
)
def test_a_condition_that_is_alone_on_its_map_is_not_compared(
    names: list[str], pairs: dict[str, str]
) -> None:
    assert find_references(factors(*names)) == pairs


def test_a_multiverse_is_compared_within_each_variant() -> None:
    named = {
        f"{learner}-{variant}": Factors(learner, "A", variant)
        for variant in ("R1", "R2")
        for learner in ("evo", "drift")
    }
    pairs = {"drift-R1": "evo-R1", "drift-R2": "evo-R2"}
    assert find_references(named) == pairs
    # The variants of a paper without maps are different experiments, too.
    assert find_references({name: row._replace(map="") for name, row in named.items()}) == pairs


def test_all_conditions_are_compared_with_a_given_baseline() -> None:
    contrasts = compare_conditions(
        study({"evo/A": LOW, "evo/B": LOW, "evo+drift/B": HIGH}), baseline="evo+drift/B"
    )
    assert {(row.condition, row.reference) for row in contrasts.rows} == {
        ("evo/A", "evo+drift/B"),
        ("evo/B", "evo+drift/B"),
    }
    assert contrasts.pairing == (
        "Each condition is compared with evo+drift/B. Conditions in another world than "
        "evo+drift/B (map B): evo/A (map A)."
    )


def test_a_comparison_across_maps_is_made_only_on_request_and_names_both_maps() -> None:
    eaten = {"evo/A": LOW, "evo+drift/A": LOW, "evo/B": HIGH}
    contrasts = compare_conditions(study(eaten))
    assert {row.condition for row in contrasts.rows} == {"evo+drift/A"}
    assert contrasts.pairing == (
        "Each condition is compared with evo/A. Not compared, because no other condition is in the "
        "same world: evo/B (map B). The option --baseline evo/A compares conditions in different "
        "worlds."
    )
    contrasts = compare_conditions(study(eaten), baseline="evo/A")
    assert contrasts.pairing == (
        "Each condition is compared with evo/A. Conditions in another world than evo/A (map A): "
        "evo/B (map B)."
    )
    assert summarize_contrasts(contrasts)[0] == (
        "The fitness of agents of evo/B on map B is 90.0 higher than that of agents of evo/A on "
        "map A [86.5, 93.5]."
    )


def test_a_verdict_needs_a_significant_difference() -> None:
    contrasts = compare_conditions(study({"a/A": LOW, "b/A": HIGH, "c/A": LOW, "d/A": MIXED}))
    assert [row.verdict for row in contrasts.rows if row.measure == "mean"] == [
        "higher",
        "undecided",
        "undecided",
    ]
    _, turned = compare_conditions(study({"b/A": HIGH, "a/A": LOW})).rows
    assert turned.measure == "best"
    assert turned.verdict == "lower"
    assert turned.numbers.effect == -90
    assert turned.test.p_holm == pytest.approx(2 * 2 / 12870)  # exact, and one of two tests
    (mean, best) = compare_conditions(study({"a/A": LOW, "b/A": HIGH})).rows
    assert mean.required_runs is best.required_runs is None
    assert mean.note == best.note == ""
    (mean, _) = compare_conditions(study({"a/A": LOW, "b/A": MIXED})).rows
    row = mean.row()
    expected = statistics.compare(MIXED, LOW)
    assert set(row) == set(COMPARISON_COLUMNS)
    assert [row[name] for name in expected._fields] == list(expected)


def test_the_verdict_is_too_few_runs_if_no_data_could_be_significant() -> None:
    # The smallest p-value of four runs is 2 / 70, or 4 / 70 after correction for two tests.
    few = compare_conditions(study({"a/A": LOW[:4], "b/A": HIGH[:4]}))
    assert [row.verdict for row in few.rows] == ["too few runs"] * 2
    for row in few.rows:
        assert row.test.p_holm == pytest.approx(4 / 70) == row.test.smallest_p_holm
    assert (
        few.too_few == "With 4 runs and 2 tests, the smallest corrected p-value is 0.057. "
        "At least 5 runs are needed."
    )
    enough = compare_conditions(study({"a/A": LOW[:5], "b/A": HIGH[:5]}))
    assert [row.verdict for row in enough.rows] == ["higher"] * 2 and enough.too_few == ""
    # The note on too few runs ends with the instruction that adds runs.
    few = replace(few, instruction="To add runs: baldwinlab run mine --runs {runs}")
    assert few.too_few.endswith(
        "At least 5 runs are needed. To add runs: baldwinlab run mine --runs 5"
    )
    # Planned designs give the same warning as the report.
    eaten = {"evo/A": LOW[:4], "evo+drift/A": HIGH[:4], "own": LOW[:4]}
    designs = planned_tests(factors(*eaten), 4)
    assert describe_too_few(designs) == compare_conditions(study(eaten)).too_few != ""


def test_a_condition_without_runs_or_without_a_reference_is_not_compared() -> None:
    assert compare_conditions(study({"evo/A": LOW})).rows == ()
    without = compare_conditions(
        study({"evo/A": [NOTHING] * 8, "evo+drift/A": LOW, "drift/A": LOW})
    )
    assert {(row.condition, row.reference) for row in without.rows} == {("drift/A", "evo+drift/A")}


def test_the_corrected_p_decides_if_the_interval_alone_excludes_0() -> None:
    names = [f"rule-{number}/A" for number in range(14)]
    # The samples hardly overlap, but the family has 28 tests.
    contrasts = compare_conditions(study({"evo/A": LOW} | dict.fromkeys(names, range(15, 23))))
    row = contrasts.rows[0]
    assert row.numbers.low > 0 and row.test.p_holm >= 0.05 and row.verdict == "undecided"
    assert row.note == (
        f"the corrected p {row.test.p_holm:.2g} decides, not the interval of this comparison "
        "alone; "
        f"about {row.required_runs} runs would decide this if the effect is the observed one"
    )
    assert row.required_runs is not None and row.required_runs > 8
