"""Is it the Baldwin effect? The stored assays held against the questions in `questions.toml`.

They are asked of every condition that evolves and learns. A run counts once, and is compared with itself: the same run in two
lives, or early and late. All p-values are one family, corrected by Holm's method.
"""

from __future__ import annotations

import json
import tomllib
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from math import nan
from pathlib import Path
from typing import Any, Literal

import numpy as np
import xarray as xr

from baldwinlab.analysis import statistics
from baldwinlab.analysis.assays.values import Assays, Quantity, conditions, factors_of, quantities
from baldwinlab.analysis.statistics.csv import finite_or_none, to_csv
from baldwinlab.analysis.statistics.rules import SIGNIFICANT
from baldwinlab.analysis.statistics.sample_sizes import (
    TOO_FEW,
    Design,
    describe_too_few,
    smallest_corrected,
)
from baldwinlab.core.files import write_atomically
from baldwinlab.experiment import BaseExperiment, Experiment, ExperimentError
from baldwinlab.experiment.factors import Factors
from baldwinlab.experiment.registry import key_of

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
class Criterion:
    id: str
    assay: str  # that measures a and b
    question: str
    detail: str  # what is held against what, in words
    rule: str  # greater or lower
    a: Quantity
    b: Quantity
    phase: int | None = None
    of: str = ""  # "foragers" where it can be asked of no other model

    def fits(self, experiment: BaseExperiment) -> bool:
        return self.of != "foragers" or isinstance(experiment, Experiment)


@dataclass(frozen=True)
class Answer:
    """`numbers` is None where the criterion was not measured."""

    criterion: Criterion
    numbers: statistics.Pairs | None
    left_out: int  # runs in which a or b is undefined
    p_holm: float
    verdict: Verdict
    smallest_p_holm: float = nan  # the smallest corrected p-value that the number of runs allows

    @property
    def has_too_few_runs(self) -> bool:
        """Whether it is undecided because no data of so few runs could decide it."""
        return self.verdict == UNDECIDED and self.smallest_p_holm >= SIGNIFICANT

    @property
    def label(self) -> str:
        """The verdict as a report shows it."""
        return TOO_FEW if self.has_too_few_runs else self.verdict


@dataclass(frozen=True)
class Subject:
    """A condition that evolves and learns, and what was found of it."""

    condition: str
    factors: Factors
    rival: (
        str  # the condition that differs only in that it does not learn; empty where there is none
    )
    answers: tuple[Answer, ...]
    without_learning_nobody_ate: bool  # in any run and any generation that was assayed
    lamarckian: bool  # part of what is learned is inherited

    def answer(self, criterion: str) -> Answer:
        """Not measured where it was not asked."""
        asked = {answer.criterion.id: answer for answer in self.answers}
        known = {one.id: one for one in criteria()}
        return asked.get(criterion) or Answer(known[criterion], None, 0, nan, NOT_MEASURED)

    def of_phase(self, number: int | None) -> list[Answer]:
        return [answer for answer in self.answers if answer.criterion.phase == number]

    def phase(self, number: int) -> Verdict:
        """As far as it was measured."""
        return conjunction([answer.verdict for answer in self.of_phase(number)])


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
    tables: Mapping[
        str, Table
    ]  # by condition: its quantities, and with `RIVAL` what its rival's agents gain at last

    @property
    def too_few(self) -> str:
        """Whether the runs are too few for the tests, in a sentence; "" where they are not."""
        measured = [
            answer.numbers
            for subject in self.subjects
            for answer in subject.answers
            if answer.numbers
        ]
        return describe_too_few([_design(found.n) for found in measured])

    @property
    def asked(self) -> list[Criterion]:
        """The criteria that are asked of any condition."""
        of_any = {answer.criterion for subject in self.subjects for answer in subject.answers}
        return [one for one in criteria() if one in of_any]

    def number(self, condition: str, measure: str, when: str) -> Number | None:
        wanted = (condition, measure, when)
        return next(
            (
                found
                for found in self.numbers
                if (found.condition, found.measure, found.when) == wanted
            ),
            None,
        )


@cache
def _data() -> dict[str, Any]:
    return tomllib.loads(
        (files("baldwinlab.analysis.assays") / "questions.toml").read_text("utf-8")
    )


@cache
def criteria() -> tuple[Criterion, ...]:
    entries = _data()["criteria"]
    return tuple(
        Criterion(**{**entry, "a": tuple(entry["a"]), "b": tuple(entry["b"])}) for entry in entries
    )


def rules() -> dict[str, str]:
    """What each rule does, in words."""
    return dict(_data()["rules"])


def conjunction(verdicts: Sequence[Verdict]) -> Verdict:
    """Of the parts that were measured: no if any is no, yes if all are, else undecided. Not measured if none was."""
    found = set(verdicts) - {NOT_MEASURED}
    if not found:
        return NOT_MEASURED
    return NO if NO in found else YES if found == {YES} else UNDECIDED


def evaluate(assays: Assays, last: int = 10) -> Analysis:
    """Every criterion for every condition that evolves and learns, and the numbers of all conditions.

    "first" and "last" are windows of `last` generations. What was not assayed is not measured.
    Raises ValueError unless `last` is at least 1.
    """
    experiments = conditions(assays)
    factors = {
        name: factors_of(data) for stored in assays.values() for name, data in stored.items()
    }
    tables = {name: quantities(assays, name, last) for name in experiments}
    numbers = tuple(number for name, table in tables.items() for number in _numbers(name, table))
    evolving = [
        name
        for name in experiments
        if _evolves_and_learns(experiments[name], assays.get("innate", {}).get(name))
    ]
    rivals = {name: _rival(name, experiments) for name in evolving}
    for name, rival in rivals.items():
        if rival and OFF in tables[rival]:
            tables[name][RIVAL] = tables[rival][OFF]
    asked = {name: [one for one in criteria() if one.fits(experiments[name])] for name in rivals}
    measured = {(name, one): _measure(tables[name], one) for name in rivals for one in asked[name]}
    tested = {place: found for place, (found, _) in measured.items() if found}
    corrected = statistics.holm([found.p for found in tested.values()]).tolist()
    smallest = smallest_corrected([_design(found.n) for found in tested.values()]).tolist()
    family = dict(zip(tested, zip(corrected, smallest, strict=True), strict=True))

    def answer(name: str, one: Criterion) -> Answer:
        (found, left_out), (p_holm, smallest_p) = (
            measured[name, one],
            family.get((name, one), (nan, nan)),
        )
        return Answer(
            one, found, left_out, p_holm, _verdict(SIGNS[one.rule], found, p_holm), smallest_p
        )

    def subject(name: str) -> Subject:
        answers = tuple(answer(name, one) for one in asked[name])
        lamarckian = experiments[name].evolution.lamarckian_share > 0
        nobody_ate = isinstance(experiments[name], Experiment) and _nobody_ate(assays, name)
        return Subject(name, factors[name], rivals[name], answers, nobody_ate, lamarckian)

    return Analysis(tuple(subject(name) for name in rivals), numbers, last, tables)


def _evolves_and_learns(experiment: BaseExperiment, innate: xr.Dataset | None) -> bool:
    """As the experiment says; where its model is not here, whether it was lived with learning on."""
    learns = innate is not None and bool(innate["energy"].sel(life="on").notnull().any())
    if isinstance(experiment, Experiment):
        learns = experiment.learns
    return learns and experiment.evolution.inheritance != "none"


def _rival(name: str, experiments: Mapping[str, Experiment]) -> str:
    """The condition that differs from this one in its learning and in nothing else; empty where there is none."""
    own = experiments[name]
    if not isinstance(own, Experiment):
        return next(
            (
                other
                for other, there in experiments.items()
                if other != name and _without_learner(own, there)
            ),
            "",
        )
    for other, there in experiments.items():
        tree = there.to_dict() | {"name": name, "learning": own.to_dict()["learning"]}
        if other != name and not there.learns and tree == own.to_dict():
            return other
    return ""


def _without_learner(own: BaseExperiment, other: BaseExperiment) -> bool:
    """Whether `other` is `own` with nothing learned in life."""
    try:
        return bool(own.without_learning().to_dict() | {"name": other.name} == other.to_dict())
    except ExperimentError:  # its model is not here
        table = key_of(own.model)
        one, two = own.to_dict(), other.to_dict()
        return two | {"name": own.name, table: one[table]} == one and _differ_in_one(
            two[table], one[table]
        )


def _differ_in_one(one: Mapping[str, object], other: Mapping[str, object]) -> bool:
    """Whether it is a single field, and it says yes or no: of a model that is not here, the switch of its learner."""
    differing = [name for name in other if one.get(name) != other[name]]
    return len(differing) == 1 and one.get(differing[0]) is False


def _nobody_ate(assays: Assays, condition: str) -> bool:
    data = assays.get("innate", {}).get(condition)
    return data is not None and not bool((data["energy"].sel(life="off") > 0).any())


def _defined(table: Table, *names: Quantity) -> tuple[list[np.ndarray], int]:
    """The runs in which all of these are defined, and the number of those in which any is not."""
    values = xr.align(
        *(table[name].drop_vars(set(table[name].coords) - {"run"}) for name in names), join="inner"
    )
    stacked = np.stack([np.asarray(part.values, np.float64) for part in values])
    defined = np.isfinite(stacked).all(axis=0)
    return list(stacked[:, defined]), int((~defined).sum())


def _measure(table: Table, criterion: Criterion) -> tuple[statistics.Pairs | None, int]:
    if criterion.a not in table or criterion.b not in table:
        return None, 0
    (a, b), left_out = _defined(table, criterion.a, criterion.b)
    return (statistics.compare_pairs(a, b) if a.size else None), left_out


def _design(runs: int) -> Design:
    return Design(runs, runs, "Wilcoxon")


def planned_designs(
    experiments: Mapping[str, Experiment], assays: Mapping[str, Collection[str]], runs: int
) -> list[Design]:
    """Return the tests that these assays of each condition will allow, at most, of so many runs."""
    asked = [
        (name, one)
        for name in experiments
        for one in criteria()
        if _evolves_and_learns(experiments[name], None)
        and one.fits(experiments[name])
        and one.assay in assays[name]
    ]
    return [_design(runs) for name, one in asked if one.b != RIVAL or _rival(name, experiments)]


def _verdict(sign: int, found: statistics.Pairs | None, p_holm: float) -> Verdict:
    if found is None:
        return NOT_MEASURED
    if found.n > 1 and found.above == found.below == 0:
        return NO
    if p_holm < SIGNIFICANT and sign * found.effect > 0 and sign * (found.above - found.below) > 0:
        return YES
    return (
        NO
        if p_holm < SIGNIFICANT
        and sign * found.effect < 0
        and sign * (found.above - found.below) < 0
        else UNDECIDED
    )


def _numbers(condition: str, table: Table) -> Iterator[Number]:
    for (measure, when), _ in table.items():
        (values,), left_out = _defined(table, (measure, when))
        if values.size:
            yield Number(
                condition,
                measure,
                when,
                values.size,
                left_out,
                float(np.median(values)),
                *statistics.median_interval(values),
            )


COLUMNS = (
    "condition",
    "quantity",
    "when",
    "against",
    "runs",
    "left_out",
    "median",
    "low",
    "high",
    "p",
    "p_holm",
    "verdict",
)


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
    write_atomically(directory / "baldwin.csv", to_csv(COLUMNS, [*_rows(analysis)]))


def _record(subject: Subject) -> dict[str, Any]:
    phases = {f"phase_{number}": subject.phase(number) for number in (1, 2)}
    return {
        "rival": subject.rival or None,
        **phases,
        "criteria": [_answer_record(answer) for answer in subject.answers],
    }


def _answer_record(answer: Answer) -> dict[str, Any]:
    criterion = answer.criterion
    numbers = (answer.numbers._asdict() if answer.numbers else {}) | {
        "left_out": answer.left_out,
        "p_holm": answer.p_holm,
    }
    numbers |= {"smallest_p_holm": answer.smallest_p_holm, "too_few_runs": answer.has_too_few_runs}
    return (
        vars(criterion)
        | {"rule": rules()[criterion.rule], "verdict": answer.verdict}
        | _json(numbers)
    )


def _json(values: Mapping[str, Any]) -> dict[str, Any]:
    """Null where a number does not exist."""
    return {
        name: finite_or_none(value) if isinstance(value, float) else value
        for name, value in values.items()
    }


def _rows(analysis: Analysis) -> Iterator[dict[str, Any]]:
    for number in analysis.numbers:
        row = vars(number) | {"quantity": number.measure}
        yield {name: row.get(name, "") for name in COLUMNS}
    for subject in analysis.subjects:
        for answer in subject.answers:
            if answer.numbers:
                row = answer.numbers._asdict() | {
                    "left_out": answer.left_out,
                    "p_holm": answer.p_holm,
                    "verdict": answer.verdict,
                }
                (quantity, when), against = answer.criterion.a, ", ".join(answer.criterion.b)
                row |= {
                    "condition": subject.condition,
                    "quantity": quantity,
                    "when": when,
                    "against": against,
                }
                row |= {"runs": answer.numbers.n, "median": answer.numbers.effect}
                yield {name: row[name] for name in COLUMNS}
