"""Ways of learning at the head of a report: sentences, a table and data, which follow the verdicts, whatever these are."""

from __future__ import annotations

import csv
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from baldwinlab.analysis.assays.analysis import evaluate as evaluate_assays
from baldwinlab.analysis.assays.learner_comparison import Ways, in_short, ways
from baldwinlab.analysis.claims import evaluate
from baldwinlab.experiment.factors import of_study
from baldwinlab.papers.claims import Claim
from tests.analysis.assays.assayed import constant, innate, neutral
from tests.analysis.statistics.studies import RUNS, Claims, study

TAUGHT, DRIFT = "evo+self-taught", "evo+drift"
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
    greater(f"{learner}/{place}", f"evo/{place}") for place in "AB" for learner in (TAUGHT, DRIFT)
]


def of(
    eaten: Mapping[str, Sequence[float]] = EATEN,
    claims: Sequence[Claim] = CLAIMS,
    assays: Mapping[str, Any] | None = None,
) -> Ways | None:
    data = study(eaten)
    return ways(
        evaluate(data, 10, Claims(tuple(claims))),
        of_study(data),
        evaluate_assays(assays) if assays else None,
    )


def said(found: Ways | None, folder: Path) -> tuple[Sequence[str], str]:
    assert found is not None
    return in_short(found, folder)


def test_who_finds_food_where_evolution_alone_does_not_and_what_it_costs(tmp_path: Path) -> None:
    (finds, unknown, costs), table = said(of(), tmp_path)
    assert (
        finds
        == "1 of 2 ways of learning find food where evolution alone (evo) finds none (map B): self-taught."
    )
    assert "was not measured" in unknown
    assert costs == "Learning costs on map A, where these eat less than evolution alone: drift."
    assert "A, B</td>" in table and "A\N{NO-BREAK SPACE}−30.0</td>" in table
    assert ">Innate</th>" not in table and ">Born knowing</th>" not in table


def test_without_a_map_where_evolution_alone_finds_none_more_is_what_counts(tmp_path: Path) -> None:
    (finds, _, _), _ = said(
        of({name: values for name, values in EATEN.items() if name.endswith("A")}, CLAIMS[:2]),
        tmp_path,
    )
    assert (
        finds
        == "1 of 2 ways of learning eat more than evolution alone (evo) on some map: self-taught (A)."
    )


def test_selection_that_built_what_is_innate_where_learning_adds_nothing_is_no_assimilation(
    tmp_path: Path,
) -> None:
    twins = {
        f"{TAUGHT}/A": neutral(f"{TAUGHT}/A", (5, 120), (5, 10)),
        f"{DRIFT}/A": neutral(f"{DRIFT}/A", (9, 10), (1, 2)),
    }
    (_, became, _), table = said(of(assays={"neutral": twins}), tmp_path)
    assert became.startswith("What was learned became innate in none of them: ")
    assert became.endswith("Where it does not, those of drift (A) do.")
    assert "A\N{NO-BREAK SPACE}+8.44" in table and "A\N{NO-BREAK SPACE}+116" in table


def test_what_is_innate_beside_what_is_learned_is_told_with_its_map(tmp_path: Path) -> None:
    twins = {f"{TAUGHT}/A": neutral(f"{TAUGHT}/A", (50, 120), (5, 10))}
    (_, became, _), _ = said(of(assays={"neutral": twins}), tmp_path)
    assert became.startswith("What was learned may have become innate in self-taught (A), ")


def test_the_cost_of_having_to_learn_is_told_where_it_was_measured(tmp_path: Path) -> None:
    lives = innate(f"{TAUGHT}/A", off=constant(1), on=constant(100), frozen=constant(130))
    (_, _, costs), table = said(of(assays={"innate": {f"{TAUGHT}/A": lives}}), tmp_path)
    assert costs.endswith(
        "Who would eat more if born with the weights of its own death: self-taught (A)."
    )
    assert ">Born knowing</th>" in table


def test_every_verdict_is_data(tmp_path: Path) -> None:
    twins = {f"{DRIFT}/A": neutral(f"{DRIFT}/A", (9, 10), (1, 2))}
    said(of(assays={"neutral": twins}), tmp_path)
    record = json.loads((tmp_path / "ways.json").read_text())
    assert (record["alone"], record["maps"], record["without_food"]) == ("evo", ["A", "B"], ["B"])
    assert (record["finding"], record["costing"]) == ({"self-taught": ["B"]}, {"drift": ["A"]})
    assert (record["innate"], record["innate_all_the_same"]) == ({}, {"drift": ["A"]})
    with (tmp_path / "figures" / "ways.csv").open() as file:
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
    assert [row["learner"] for row in record["ways"]] == [row["learner"] for row in rows]


def test_claims_that_compare_otherwise_make_no_table() -> None:
    assert of(claims=[]) is None
    assert of(claims=[greater(f"{TAUGHT}/A", "evo/B")]) is None, "other maps"
    assert of(claims=[*CLAIMS, greater(f"{TAUGHT}/A", f"{DRIFT}/A")]) is None, (
        "not against one learner"
    )
    assert of({"evo": [1, 2], DRIFT: [3, 4]}, [greater(DRIFT, "evo")]) is None, "no maps"
