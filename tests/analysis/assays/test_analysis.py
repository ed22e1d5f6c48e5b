"""Criteria of the Baldwin effect, evaluated on artificial assays."""

from __future__ import annotations

import csv
import json
import math
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

from baldwinlab.analysis.assays.analysis import Analysis, ConditionResult, evaluate_assays
from baldwinlab.analysis.assays.criteria import combine_verdicts, load_criteria
from baldwinlab.analysis.assays.evaluation import compute_quantities
from baldwinlab.analysis.assays.section import write_analysis
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


@cache
def analyze_all_assays() -> Analysis:
    return evaluate_assays(make_all_assays())


def evaluate_condition(data: xr.Dataset, **more_assays: xr.Dataset) -> ConditionResult:
    """Return the result of one condition from its innate assay and further assays by name."""
    assays = {
        "innate": {A: data},
        **{assay.replace("_", "-"): {A: dataset} for assay, dataset in more_assays.items()},
    }
    (subject,) = evaluate_assays(assays).results
    return subject


def verdicts(subject: ConditionResult, *names: str) -> list[str]:
    return [subject.answer(name).verdict for name in names]


def test_full_assimilation_is_both_phases() -> None:
    data = innate(
        A, off=rising(0, 100), on=rising(50, 100), drift=constant(5), distance=rising(2, 0)
    )
    result = evaluate_condition(data, within_life=within_life(A, 1, 9))
    assert verdicts(result, "innate", "share", "need", "movement") == ["yes"] * 4
    # Learning adds nothing in the last generation.
    assert (result.phase_verdict(1), result.phase_verdict(2)) == ("yes", "yes")


def test_learning_without_assimilation_is_phase_1_alone() -> None:
    data = innate(
        A,
        off=constant(0),
        frozen=constant(0),
        drift=constant(5),
        on=rising(10, 100),
        distance=rising(1, 2),
    )
    result = evaluate_condition(data, within_life=within_life(A, 1, 9))
    assert result.eats_only_with_learning
    # Innate fitness is 0 in all runs and generations.
    assert (result.phase_verdict(1), result.phase_verdict(2)) == ("yes", "not measurable")
    assert verdicts(result, "innate", "share") == ["not measurable"] * 2
    assert verdicts(result, "need", "movement", "cost") == ["no"] * 3


def test_learning_without_gain_is_not_phase_1() -> None:
    result = evaluate_condition(innate(A, off=rising(10, 90), on=rising(10, 80), drift=constant(5)))
    assert result.answer("gain").verdict == "no" and result.phase_verdict(1) == "no"
    assert result.answer("innate").verdict == "yes"
    # No run differs, so there is no test.
    same = evaluate_condition(innate(A, off=constant(10), on=constant(10)))
    assert same.answer("gain").label == "equal in every run"
    assert same.answer("gain").test is None and same.phase_verdict(1) == "no"


def test_the_effect_on_a_share_is_its_change_in_percent() -> None:
    data = innate(A, off=rising(10, 30), on=constant(40))
    numbers = evaluate_condition(data).answer("share").numbers
    quantities = compute_quantities({"innate": {A: data}}, A, 10)
    last, first = (quantities["innate share", window] for window in ("last", "first"))
    assert numbers is not None
    assert numbers.effect == pytest.approx(float((100 * (last / first - 1)).median()))
    assert numbers.low <= numbers.effect <= numbers.high
    # Medians of the shares stand beside the change.
    assert numbers.median_a == pytest.approx(float(last.median()))


def test_drift_random_genomes_and_modules_decide_their_criteria() -> None:
    result = evaluate_condition(
        innate(A, off=constant(1), on=rising(10, 100), drift=rising(20, 110)),
        within_life=within_life(A, 1, 9),
    )
    assert verdicts(result, "gain", "newborns", "learning") == ["yes", "yes", "no"]
    assert result.phase_verdict(1) == "no"
    # Random genomes that eat as much contradict the paper.
    result = evaluate_condition(
        innate(A, off=constant(1), on=constant(9)), within_life=within_life(A, 9, 2)
    )
    assert verdicts(result, "newborns", "sooner") == ["no", "no"]
    # Mixed modules show which module is inherited knowledge.
    data = innate(A, off=constant(1), on=constant(9))
    result = evaluate_condition(data, modules=modules(A, (100, 90, 3, 10)))
    assert verdicts(result, "reinforcement", "action") == ["yes", "no"]


def test_selection_explains_an_advantage_over_the_neutral_control() -> None:
    data = innate(A, off=constant(1), on=constant(9))
    built = ("built-innate", "built-learned")
    for evolved, control, expected in (
        # The gain was greater before.
        ((90, 100), (10, 50), ["yes", "no"]),
        ((10, 100), (10, 50), ["equal in every run", "yes"]),
        ((0, 100), (0, 50), ["not measurable", "yes"]),
    ):
        result = evaluate_condition(data, neutral=neutral(A, evolved, control))
        assert verdicts(result, *built) == expected
    assert verdicts(evaluate_condition(data), *built) == ["not measured"] * 2


def test_the_control_is_the_condition_that_differs_only_in_learning() -> None:
    results = {subject.condition: subject for subject in analyze_all_assays().results}
    assert (results[A].control, results[B].control) == ("evo/A", "")
    assert results[A].answer("guidance").verdict == "yes"
    assert results[B].answer("guidance").verdict == "not measured"
    # P is corrected for all criteria of all conditions.
    answers = [
        answer
        for subject in analyze_all_assays().results
        for answer in subject.answers
        if answer.test
    ]
    smallest = min(answers, key=lambda answer: answer.numbers.p if answer.numbers else 1)
    assert smallest.numbers is not None and smallest.p_holm == pytest.approx(
        smallest.numbers.p * len(answers)
    )


def test_only_conditions_that_evolve_and_learn_are_evaluated() -> None:
    stored = {
        "innate": {name: innate(name, off=constant(1)) for name in ("evo/A", "self-taught/A")}
    }
    result = evaluate_assays(stored)
    assert result.results == ()
    assert {number.condition for number in result.numbers} == {"evo/A", "self-taught/A"}


def test_verdicts_distinguish_too_few_runs_from_undecided() -> None:
    # With the largest gain in each of 3 runs, p is 0.25 before correction.
    few, enough = (
        evaluate_condition(innate(A, off=constant(1), on=constant(50), runs=runs))
        for runs in (3, 12)
    )
    assert few.answer("gain").label == "too few runs" and few.answer("gain").verdict == "undecided"
    test = few.answer("gain").test
    assert test is not None and test.p_holm == test.smallest_p_holm >= 0.25
    assert enough.answer("gain").label == "yes" and not enough.answer("gain").has_too_few_runs
    # Verdicts of a single run are undecided.
    result = evaluate_condition(
        innate(A, off=constant(0), on=rising(10, 100), drift=constant(1), runs=1)
    )
    assert verdicts(result, "gain", "learning") == ["undecided"] * 2
    assert verdicts(result, "innate", "share") == ["not measurable"] * 2
    numbers = result.answer("gain").numbers
    assert numbers is not None and math.isnan(numbers.low)


@pytest.mark.parametrize("assay", ["neutral", "within-life", "modules", "reaction", "descent"])
def test_a_single_assay_gives_the_verdicts_of_its_criteria(assay: str) -> None:
    result = evaluate_assays({assay: make_all_assays()[assay]})
    assert [subject.phase_verdict(2) for subject in result.results] == ["not measured"] * 2
    assert result.numbers


def test_runs_in_which_a_share_is_undefined_are_left_out_and_counted() -> None:
    data = innate(A, off=rising(1, 20), on=constant(50))
    data["energy"].loc[{"run": [0, 1], "generation": range(10), "life": "on"}] = 0
    answer = evaluate_condition(data).answer("share")
    assert answer.left_out == 2 and answer.numbers is not None and answer.numbers.n == 10
    first = evaluate_assays({"innate": {A: data}}).find_number(A, "innate share", "first")
    assert first is not None and (first.runs, first.left_out) == (10, 2)


@pytest.mark.parametrize(
    ("parts", "combined"),
    [
        (["yes", "yes"], "yes"),
        (["yes", "not measured"], "yes"),
        (["yes", "undecided"], "undecided"),
        (["undecided", "no", "yes"], "no"),
        (["not measured"], "not measured"),
        ([], "not measured"),
    ],
)
def test_a_phase_is_as_weak_as_its_weakest_part_that_was_measured(
    parts: list[Any], combined: str
) -> None:
    assert combine_verdicts(parts) == combined


def test_criteria_name_only_existing_quantities() -> None:
    assays = make_all_assays()
    for criterion in load_criteria():
        assert {criterion.a, criterion.b} <= {
            *compute_quantities({criterion.assay: assays[criterion.assay]}, A, 10),
            ("no-learning control", "last"),
        }
    assert len({criterion.id for criterion in load_criteria()}) == len(load_criteria())


def test_files_are_strict_complete_and_the_same_each_time(tmp_path: Path) -> None:
    stored = make_all_assays()
    stored["innate"][A]["energy"].loc[{"life": "drift"}] = np.nan
    for folder in ("one", "two"):
        write_analysis(evaluate_assays(stored), tmp_path / folder)
    record = json.loads((tmp_path / "one" / "baldwin.json").read_text(), parse_constant=pytest.fail)
    assert (record["conditions"][A]["phase_2"], record["conditions"][B]["phase_2"]) == (
        "yes",
        "not measurable",
    )
    learning = next(
        criterion
        for criterion in record["conditions"][A]["criteria"]
        if criterion["id"] == "learning"
    )
    assert learning["verdict"] == "not measured" and learning["p_holm"] is None
    with (tmp_path / "one" / "baldwin.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(record["numbers"]) + sum(
        "median_a" in criterion
        for part in record["conditions"].values()
        for criterion in part["criteria"]
    )
    of_b = [row for row in rows if row["condition"] == B and row["against"]]
    gain = next(row for row in of_b if row["quantity"] == "on")
    assert (gain["against"], gain["verdict"]) == ("off, throughout", "yes")
    assert float(gain["low"]) > 0
    for name in ("baldwin.json", "baldwin.csv"):
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes()
