"""Is it the Baldwin effect? The stored assays held against the questions in `baldwin.toml`.

They are asked of every condition that evolves and learns. A run counts once, and is compared with itself: the same run in two
lives, or early and late. All p-values are one family, corrected by Holm's method.
"""

from __future__ import annotations

import json
import math
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from math import nan
from pathlib import Path
from typing import Any, Literal

import numpy as np
import xarray as xr

from baldwinlab.analysis import statistics
from baldwinlab.analysis.assays import Assays, Quantity, conditions, quantities
from baldwinlab.analysis.claims import csv_text, finite
from baldwinlab.analysis.rules import SIGNIFICANT
from baldwinlab.config import Experiment
from baldwinlab.files import write_atomically

Verdict = Literal["yes", "no", "undecided", "not measured"]
YES: Verdict = "yes"
NO: Verdict = "no"
UNDECIDED: Verdict = "undecided"
NOT_MEASURED: Verdict = "not measured"

SIGNS = {"greater": 1, "lower": -1}
RIVAL: Quantity = ("rival", "last")
OFF: Quantity = ("off", "last")

Table = Mapping[Quantity, xr.DataArray]


@dataclass(frozen=True)
class Comparison:
    a: Quantity
    b: Quantity


@dataclass(frozen=True)
class Criterion:
    id: str
    question: str
    detail: str  # what is held against what, in words
    rule: str  # greater or lower
    comparisons: tuple[Comparison, ...]
    phase: int | None = None


@dataclass(frozen=True)
class Finding:
    """One comparison, decided; `numbers` is None where it was not measured."""

    comparison: Comparison
    numbers: statistics.Pairs | None
    left_out: int  # runs in which a or b is undefined
    p_holm: float
    verdict: Verdict


@dataclass(frozen=True)
class Answer:
    criterion: Criterion
    findings: tuple[Finding, ...]

    @property
    def verdict(self) -> Verdict:
        return conjunction([finding.verdict for finding in self.findings])


@dataclass(frozen=True)
class Subject:
    """A condition that evolves and learns, and what was found of it."""

    condition: str
    rival: str  # the condition that differs only in that it does not learn; empty where there is none
    answers: tuple[Answer, ...]
    without_learning_nobody_ate: bool  # in any run and any generation that was assayed

    def answer(self, criterion: str) -> Answer:
        return next(answer for answer in self.answers if answer.criterion.id == criterion)

    def phase(self, number: int) -> Verdict:
        return conjunction([answer.verdict for answer in self.answers if answer.criterion.phase == number])


@dataclass(frozen=True)
class Number:
    """A quantity of a condition: its median over the runs in which it is defined, with a 95 % bootstrap interval."""

    condition: str
    measure: str
    when: str
    runs: int
    left_out: int  # runs in which it is undefined
    median: float
    low: float
    high: float


@dataclass(frozen=True)
class Analysis:
    subjects: tuple[Subject, ...]
    numbers: tuple[Number, ...]
    last: int  # generations in a window

    def number(self, condition: str, measure: str, when: str) -> Number | None:
        wanted = (condition, measure, when)
        return next((found for found in self.numbers if (found.condition, found.measure, found.when) == wanted), None)


@cache
def _data() -> dict[str, Any]:
    return tomllib.loads((files("baldwinlab.analysis") / "baldwin.toml").read_text("utf-8"))


@cache
def criteria() -> tuple[Criterion, ...]:
    return tuple(
        Criterion(**{**entry, "comparisons": tuple(Comparison(tuple(c["a"]), tuple(c["b"])) for c in entry["comparisons"])})
        for entry in _data()["criteria"]
    )


def rules() -> dict[str, str]:
    """What each rule does, in words."""
    return dict(_data()["rules"])


def conjunction(verdicts: Sequence[Verdict]) -> Verdict:
    """No if any part is no; yes if all are; not measured if none was; else undecided."""
    if NO in verdicts:
        return NO
    found = set(verdicts)
    return found.pop() if len(found) == 1 else UNDECIDED


def evaluate(assays: Assays, last: int = 10) -> Analysis:
    """Every criterion for every condition that evolves and learns, and the numbers of all conditions.

    "first" and "last" are windows of `last` generations. What was not assayed is not measured.
    Raises ValueError unless `last` is at least 1.
    """
    experiments = conditions(assays)
    tables: dict[str, dict[Quantity, xr.DataArray]] = {name: quantities(assays, name, last) for name in experiments}
    numbers = tuple(number for name, table in tables.items() for number in _numbers(name, table))
    rivals = {name: _rival(name, experiments) for name, experiment in experiments.items() if _evolves_and_learns(experiment)}
    for name, rival in rivals.items():
        if rival and OFF in tables[rival]:
            tables[name][RIVAL] = tables[rival][OFF]
    measured = {name: {pair: _measure(tables[name], pair) for pair in _pairs()} for name in rivals}
    ps = {(name, pair): found[0].p for name, pairs in measured.items() for pair, found in pairs.items() if found[0]}
    corrected = dict(zip(ps, statistics.holm(list(ps.values())), strict=True))
    subjects = []
    for name, rival in rivals.items():
        p_holm = {pair: float(corrected.get((name, pair), nan)) for pair in _pairs()}
        answers = tuple(
            Answer(one, tuple(_decide(one.rule, pair, *measured[name][pair], p_holm[pair]) for pair in one.comparisons))
            for one in criteria()
        )
        subjects.append(Subject(name, rival, answers, _nobody_ate(assays, name)))
    return Analysis(tuple(subjects), numbers, last)


def _pairs() -> list[Comparison]:
    return list(dict.fromkeys(pair for one in criteria() for pair in one.comparisons))


def _evolves_and_learns(experiment: Experiment) -> bool:
    return experiment.learns and experiment.evolution.inheritance != "none"


def _rival(name: str, experiments: Mapping[str, Experiment]) -> str:
    """The condition that differs from this one in its learning and in nothing else; empty where there is none."""
    own = experiments[name].to_dict()
    for other, experiment in experiments.items():
        if not experiment.learns and experiment.to_dict() | {"name": own["name"], "learning": own["learning"]} == own:
            return other
    return ""


def _nobody_ate(assays: Assays, condition: str) -> bool:
    data = assays.get("innate", {}).get(condition)
    return data is not None and not bool((data["energy"].sel(life="off") > 0).any())


def _defined(table: Table, *names: Quantity) -> tuple[list[np.ndarray], int]:
    """The runs in which all of these are defined, and the number of those in which any is not."""
    values = xr.align(*(table[name].drop_vars(set(table[name].coords) - {"run"}) for name in names), join="inner")
    stacked = np.stack([np.asarray(part.values, np.float64) for part in values])
    defined = np.isfinite(stacked).all(axis=0)
    return list(stacked[:, defined]), int((~defined).sum())


def _measure(table: Table, pair: Comparison) -> tuple[statistics.Pairs | None, int]:
    if pair.a not in table or pair.b not in table:
        return None, 0
    (a, b), left_out = _defined(table, pair.a, pair.b)
    return (statistics.compare_pairs(a, b) if a.size else None), left_out


def _decide(rule: str, pair: Comparison, found: statistics.Pairs | None, left_out: int, p_holm: float) -> Finding:
    return Finding(pair, found, left_out, p_holm, _verdict(SIGNS[rule], found, p_holm))


def _verdict(sign: int, found: statistics.Pairs | None, p_holm: float) -> Verdict:
    if found is None:
        return NOT_MEASURED
    if found.n > 1 and found.above == found.below == 0:
        return NO
    if p_holm < SIGNIFICANT and sign * found.effect > 0 and sign * (found.above - found.below) > 0:
        return YES
    return NO if p_holm < SIGNIFICANT and sign * found.effect < 0 and sign * (found.above - found.below) < 0 else UNDECIDED


def _numbers(condition: str, table: Table) -> Iterator[Number]:
    for (measure, when), _ in table.items():
        (values,), left_out = _defined(table, (measure, when))
        if values.size:
            yield Number(
                condition, measure, when, values.size, left_out, float(np.median(values)), *statistics.median_interval(values)
            )


COLUMNS = ("condition", "quantity", "when", "against", "runs", "left_out", "median", "low", "high", "p", "p_holm", "verdict")


def write(analysis: Analysis, directory: Path) -> None:
    """Write `baldwin.json` and `baldwin.csv`, which has a row for every number and for every comparison.

    Each file appears whole or not at all. Raises OSError.
    """
    record = {
        "last": analysis.last,
        "conditions": {subject.condition: _record(subject) for subject in analysis.subjects},
        "numbers": [_json(vars(number)) for number in analysis.numbers],
    }
    text = json.dumps(record, indent=2, ensure_ascii=False, allow_nan=False)
    write_atomically(directory / "baldwin.json", f"{text}\n".encode())
    write_atomically(directory / "baldwin.csv", csv_text(COLUMNS, [*_rows(analysis)]))


def _record(subject: Subject) -> dict[str, Any]:
    answers = [
        {
            "id": answer.criterion.id,
            "question": answer.criterion.question,
            "phase": answer.criterion.phase,
            "rule": rules()[answer.criterion.rule],
            "verdict": answer.verdict,
            "comparisons": [
                {"a": list(found.comparison.a), "b": list(found.comparison.b), "left_out": found.left_out, "verdict": found.verdict}
                | _json((found.numbers._asdict() if found.numbers else {}) | {"p_holm": found.p_holm})
                for found in answer.findings
            ],
        }
        for answer in subject.answers
    ]
    phases = {f"phase_{number}": subject.phase(number) for number in (1, 2)}
    return {"rival": subject.rival or None, **phases, "criteria": answers}


def _json(values: Mapping[str, Any]) -> dict[str, Any]:
    """Null where a number does not exist."""
    return {name: finite(value) if isinstance(value, float) else value for name, value in values.items()}


def _rows(analysis: Analysis) -> Iterator[dict[str, Any]]:
    for number in analysis.numbers:
        row = vars(number) | {"quantity": number.measure}
        yield {name: row.get(name, "") for name in COLUMNS}
    for subject in analysis.subjects:
        for found in dict.fromkeys(finding for answer in subject.answers for finding in answer.findings):
            if found.numbers:
                (a, when), b, numbers = found.comparison.a, found.comparison.b, found.numbers
                yield {
                    "condition": subject.condition, "quantity": a, "when": when, "against": ", ".join(b), "runs": numbers.n,
                    "left_out": found.left_out, "median": numbers.effect, "low": numbers.low, "high": numbers.high,
                    "p": numbers.p, "p_holm": found.p_holm, "verdict": found.verdict,
                }  # fmt: skip
