"""Comparison of learners at the top of a report: sentences, a table and data."""

from __future__ import annotations

import csv
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from baldwinlab.analysis.assays.analysis import evaluate_assays
from baldwinlab.analysis.assays.learner_comparison import LearnerComparison, compare_learners
from baldwinlab.analysis.assays.learner_report import make_summary
from baldwinlab.analysis.claims import evaluate_claims
from baldwinlab.experiment.factors import read_factors
from baldwinlab.papers.claims import Claim
from tests.analysis.assays.artificial_assays import constant, innate, neutral
from tests.analysis.statistics.studies import RUNS, Claims, study

TAUGHT = "evo+self-taught"
DRIFT = "evo+drift"
EATEN = {
    "evo/A": range(40, 40 + RUNS),
    f"{TAUGHT}/A": range(120, 120 + RUNS),
    f"{DRIFT}/A": range(10, 10 + RUNS),
    "evo/B": [0] * RUNS,
    f"{TAUGHT}/B": range(50, 50 + RUNS),
    f"{DRIFT}/B": [0] * RUNS,
}


def greater(a: str, b: str) -> Claim:
    comparison = {"a": a, "b": b, "measure": "mean", "rule": "greater"}
    return Claim.model_validate({"id": a, "title": a, "claim": a, "comparisons": [comparison]})


CLAIMS = [
    greater(f"{learner}/{map_name}", f"evo/{map_name}")
    for map_name in "AB"
    for learner in (TAUGHT, DRIFT)
]


def compare(
    eaten: Mapping[str, Sequence[float]] = EATEN,
    claims: Sequence[Claim] = CLAIMS,
    assays: Mapping[str, Any] | None = None,
) -> LearnerComparison | None:
    data = study(eaten)
    return compare_learners(
        evaluate_claims(data, 10, Claims(tuple(claims))),
        read_factors(data),
        evaluate_assays(assays) if assays else None,
    )


def summarize(comparison: LearnerComparison | None, folder: Path) -> tuple[Sequence[str], str]:
    assert comparison is not None
    return make_summary(comparison, folder)


def test_learners_that_find_food_where_evolution_alone_finds_none_are_named(tmp_path: Path) -> None:
    (success, innate_text, costs), table = summarize(compare(), tmp_path)
    assert (
        success == "1 of 2 learners find food on map B, where evolution alone (evo) finds none: "
        "self-taught."
    )
    assert "has no measurement of innate fitness" in innate_text
    assert costs == "On map A, these learners eat less than evolution alone: drift."
    assert "A, B</td>" in table and "A\N{NO-BREAK SPACE}−30.0</td>" in table
    assert ">Innate fitness</th>" not in table and ">Weights at death</th>" not in table


def test_where_evolution_alone_finds_food_learners_that_eat_more_are_named(tmp_path: Path) -> None:
    (success, _, _), _ = summarize(
        compare({name: values for name, values in EATEN.items() if name.endswith("A")}, CLAIMS[:2]),
        tmp_path,
    )
    assert (
        success == "1 of 2 learners eat more than evolution alone (evo) on at least one map: "
        "self-taught (A)."
    )


def test_innate_fitness_without_a_gain_from_learning_is_no_assimilation(
    tmp_path: Path,
) -> None:
    controls = {
        f"{TAUGHT}/A": neutral(f"{TAUGHT}/A", (5, 120), (5, 10)),
        f"{DRIFT}/A": neutral(f"{DRIFT}/A", (9, 10), (1, 2)),
    }
    (_, innate_text, _), table = summarize(compare(assays={"neutral": controls}), tmp_path)
    assert innate_text.startswith(
        "No learner that eats more than evolution alone eats significantly"
    )
    assert "Newborns also eat more than their neutral control in drift (A), " in innate_text
    assert "A\N{NO-BREAK SPACE}+8.44" in table and "A\N{NO-BREAK SPACE}+116" in table


def test_innate_fitness_with_a_gain_from_learning_is_named_with_its_map(tmp_path: Path) -> None:
    controls = {f"{TAUGHT}/A": neutral(f"{TAUGHT}/A", (50, 120), (5, 10))}
    (_, innate_text, _), _ = summarize(compare(assays={"neutral": controls}), tmp_path)
    assert innate_text.endswith("chosen at random: self-taught (A).")


def test_the_cost_of_learning_is_named_if_it_was_measured(tmp_path: Path) -> None:
    lives = innate(f"{TAUGHT}/A", off=constant(1), on=constant(100), frozen=constant(130))
    (_, _, costs), table = summarize(compare(assays={"innate": {f"{TAUGHT}/A": lives}}), tmp_path)
    assert costs.endswith(
        "These learners eat more if they are born with their weights at death: self-taught (A)."
    )
    assert ">Weights at death</th>" in table


def test_every_verdict_is_data(tmp_path: Path) -> None:
    controls = {f"{DRIFT}/A": neutral(f"{DRIFT}/A", (9, 10), (1, 2))}
    summarize(compare(assays={"neutral": controls}), tmp_path)
    record = json.loads((tmp_path / "learners.json").read_text())
    assert (record["reference"], record["maps"], record["maps_without_food"]) == (
        "evo",
        ["A", "B"],
        ["B"],
    )
    assert (record["successful"], record["worse"]) == ({"self-taught": ["B"]}, {"drift": ["A"]})
    assert (record["innate_with_gain"], record["innate_without_gain"]) == ({}, {"drift": ["A"]})
    with (tmp_path / "figures" / "learners.csv").open() as file:
        rows = [*csv.DictReader(file)]
    assert [(row["learner"], row["map"], row["verdict"]) for row in rows] == [
        ("self-taught", "A", "holds"),
        ("drift", "A", "does not hold"),
        ("self-taught", "B", "holds"),
        ("drift", "B", "undecided"),
    ]
    assert [row["innate_verdict"] for row in rows] == [
        "not measured",
        "yes",
        "not measured",
        "not measured",
    ]
    assert [row["learner"] for row in record["learners"]] == [row["learner"] for row in rows]


def test_other_comparisons_make_no_table() -> None:
    assert compare(claims=[]) is None
    assert compare(claims=[greater(f"{TAUGHT}/A", "evo/B")]) is None, "other maps"
    assert compare(claims=[*CLAIMS, greater(f"{TAUGHT}/A", f"{DRIFT}/A")]) is None, (
        "not against one learner"
    )
    assert compare({"evo": [1, 2], DRIFT: [3, 4]}, [greater(DRIFT, "evo")]) is None, "no maps"
