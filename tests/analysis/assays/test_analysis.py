"""The questions of the Baldwin effect, asked of assays whose answers are known."""

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
from baldwinlab.analysis.assays.records import write_analysis
from baldwinlab.analysis.assays.values import compute_quantities
from tests.analysis.assays.assayed import (
    constant,
    innate,
    modules,
    neutral,
    rising,
    whole,
    within_life,
)

A = "evo+self-taught/A"
B = "evo+self-taught/B"


@cache
def all_of_it() -> Analysis:
    return evaluate_assays(whole())


def asked(data: xr.Dataset, **others: xr.Dataset) -> ConditionResult:
    """What is found of one condition, given its innate assay and others by name."""
    assays = {
        "innate": {A: data},
        **{assay.replace("_", "-"): {A: dataset} for assay, dataset in others.items()},
    }
    (subject,) = evaluate_assays(assays).results
    return subject


def verdicts(subject: ConditionResult, *names: str) -> list[str]:
    return [subject.answer(name).verdict for name in names]


def test_full_assimilation_is_both_phases() -> None:
    data = innate(
        A, off=rising(0, 100), on=rising(50, 100), drift=constant(5), distance=rising(2, 0)
    )
    found = asked(data, within_life=within_life(A, 1, 9))
    assert verdicts(found, "innate", "share", "need", "movement") == ["yes"] * 4
    assert (found.phase_verdict(1), found.phase_verdict(2)) == (
        "yes",
        "yes",
    )  # although at last learning adds nothing any more


def test_learning_that_nothing_of_becomes_innate_is_the_first_phase_alone() -> None:
    data = innate(
        A,
        off=constant(0),
        on=rising(10, 100),
        frozen=constant(0),
        drift=constant(5),
        distance=rising(1, 2),
    )
    found = asked(data, within_life=within_life(A, 1, 9))
    assert found.eats_only_with_learning
    assert (found.phase_verdict(1), found.phase_verdict(2)) == ("yes", "no")
    assert verdicts(found, "innate", "share", "need", "movement", "cost") == ["no"] * 5


def test_learning_that_does_not_help_is_not_even_that() -> None:
    found = asked(innate(A, off=rising(10, 90), on=rising(10, 80), drift=constant(5)))
    assert found.answer("gain").verdict == "no" and found.phase_verdict(1) == "no"
    assert found.answer("innate").verdict == "yes"
    same = asked(innate(A, off=constant(10), on=constant(10)))
    assert same.answer("gain").verdict == "no"  # not one run differs


def test_where_drift_does_as_well_it_is_not_learning() -> None:
    found = asked(
        innate(A, off=constant(1), on=rising(10, 100), drift=rising(20, 110)),
        within_life=within_life(A, 1, 9),
    )
    assert verdicts(found, "gain", "newborns", "learning") == ["yes", "yes", "no"]
    assert found.phase_verdict(1) == "no"


def test_blank_slates_that_do_as_well_contradict_the_paper() -> None:
    found = asked(innate(A, off=constant(1), on=constant(9)), within_life=within_life(A, 9, 2))
    assert verdicts(found, "newborns", "sooner") == ["no", "no"]


def test_chimeras_say_which_module_carries_knowledge() -> None:
    data = innate(A, off=constant(1), on=constant(9))
    found = asked(data, modules=modules(A, (100, 90, 3, 10)))
    assert verdicts(found, "reinforcement", "action") == ["yes", "no"]


def test_selection_built_what_the_neutral_twin_has_not() -> None:
    data = innate(A, off=constant(1), on=constant(9))
    built = ("built-innate", "built-learned")
    assert verdicts(asked(data, neutral=neutral(A, (90, 100), (10, 50))), *built) == [
        "yes",
        "no",
    ]  # the gain was greater before
    assert verdicts(asked(data, neutral=neutral(A, (0, 100), (0, 50))), *built) == ["no", "yes"]
    assert (
        verdicts(asked(data), *built) == ["not measured"] * 2
    )  # of a study that was assayed before there were twins


def test_the_control_is_the_condition_that_differs_only_in_learning() -> None:
    found = {subject.condition: subject for subject in all_of_it().results}
    assert (found[A].control, found[B].control) == ("evo/A", "")
    assert found[A].answer("guidance").verdict == "yes"
    assert found[B].answer("guidance").verdict == "not measured"


def test_only_conditions_that_evolve_and_learn_are_asked() -> None:
    stored = {
        "innate": {name: innate(name, off=constant(1)) for name in ("evo/A", "self-taught/A")}
    }
    found = evaluate_assays(stored)
    assert found.results == ()
    assert {number.condition for number in found.numbers} == {"evo/A", "self-taught/A"}


def test_one_run_decides_nothing() -> None:
    found = asked(innate(A, off=constant(0), on=rising(10, 100), drift=constant(1), runs=1))
    assert set(verdicts(found, "gain", "learning", "innate", "share")) == {"undecided"}
    numbers = found.answer("gain").numbers
    assert numbers is not None and math.isnan(numbers.low)


def test_what_so_few_runs_cannot_decide_is_told_from_what_is_undecided() -> None:
    """The largest gain that there can be, in every run: of 3 runs p is 0.25 before it is corrected."""
    few, enough = (
        asked(innate(A, off=constant(1), on=constant(50), runs=runs)) for runs in (3, 12)
    )
    assert few.answer("gain").label == "too few runs" and few.answer("gain").verdict == "undecided"
    assert few.answer("gain").p_holm == few.answer("gain").smallest_p_holm >= 0.25
    assert enough.answer("gain").label == "yes" and not enough.answer("gain").has_too_few_runs


@pytest.mark.parametrize("assay", ["neutral", "within-life", "modules", "reaction", "descent"])
def test_a_single_assay_answers_what_it_can(assay: str) -> None:
    found = evaluate_assays({assay: whole()[assay]})
    assert [subject.phase_verdict(2) for subject in found.results] == ["not measured"] * 2
    assert found.numbers


def test_runs_in_which_a_share_is_undefined_are_left_out_and_counted() -> None:
    data = innate(A, off=rising(1, 20), on=constant(50))
    data["energy"].loc[{"run": [0, 1], "generation": range(10), "life": "on"}] = 0
    answer = asked(data).answer("share")
    assert answer.left_out == 2 and answer.numbers is not None and answer.numbers.n == 10
    first = evaluate_assays({"innate": {A: data}}).find_number(A, "innate share", "first")
    assert first is not None and (first.runs, first.left_out) == (10, 2)


def test_p_is_corrected_for_all_questions_of_all_conditions() -> None:
    answers = [
        answer for subject in all_of_it().results for answer in subject.answers if answer.numbers
    ]
    smallest = min(answers, key=lambda answer: answer.numbers.p if answer.numbers else 1)
    assert smallest.numbers is not None and smallest.p_holm == pytest.approx(
        smallest.numbers.p * len(answers)
    )


@pytest.mark.parametrize(
    ("parts", "whole_"),
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
    parts: list[Any], whole_: str
) -> None:
    assert combine_verdicts(parts) == whole_


def test_the_questions_name_only_what_there_is() -> None:
    known = set(compute_quantities(whole(), A, 10)) | {("no-learning control", "last")}
    assert {quantity for one in load_criteria() for quantity in (one.a, one.b)} <= known
    for one in load_criteria():
        assert {one.a, one.b} <= {
            *compute_quantities({one.assay: whole()[one.assay]}, A, 10),
            ("no-learning control", "last"),
        }
    assert len({one.id for one in load_criteria()}) == len(load_criteria())


def test_files_are_strict_complete_and_the_same_each_time(tmp_path: Path) -> None:
    stored = whole()
    stored["innate"][A]["energy"].loc[{"life": "drift"}] = np.nan
    for folder in ("one", "two"):
        write_analysis(evaluate_assays(stored), tmp_path / folder)
    record = json.loads((tmp_path / "one" / "baldwin.json").read_text(), parse_constant=pytest.fail)
    assert (record["conditions"][A]["phase_2"], record["conditions"][B]["phase_2"]) == ("yes", "no")
    learning = next(one for one in record["conditions"][A]["criteria"] if one["id"] == "learning")
    assert learning["verdict"] == "not measured" and learning["p_holm"] is None
    with (tmp_path / "one" / "baldwin.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(record["numbers"]) + sum(
        "median_a" in one for part in record["conditions"].values() for one in part["criteria"]
    )
    gain = next(
        row for row in rows if row["condition"] == B and row["quantity"] == "on" and row["against"]
    )
    assert (gain["against"], gain["verdict"]) == ("off, throughout", "yes") and float(
        gain["low"]
    ) > 0
    for name in ("baldwin.json", "baldwin.csv"):
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes()
