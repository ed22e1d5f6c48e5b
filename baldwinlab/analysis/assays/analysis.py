"""Test for the Baldwin effect: the stored assays, compared by the criteria in `questions.toml`.

Every condition that evolves and learns is tested. Each run has one value and is compared with
itself: with and without learning, or early and late. All p-values are one family, corrected by
Holm's method.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from math import nan

import numpy as np
import xarray as xr

from baldwinlab.analysis import statistics
from baldwinlab.analysis.assays.controls import evolves_and_learns, find_control
from baldwinlab.analysis.assays.criteria import (
    CONTROL_LAST,
    INNATE_LAST,
    NO,
    NOT_MEASURED,
    SIGNS,
    UNDECIDED,
    YES,
    Criterion,
    Verdict,
    combine_verdicts,
    load_criteria,
)
from baldwinlab.analysis.assays.values import (
    Assays,
    Quantity,
    compute_quantities,
    parse_experiments,
    read_factors,
)
from baldwinlab.analysis.statistics.rules import SIGNIFICANCE_LEVEL
from baldwinlab.analysis.statistics.sample_sizes import (
    TOO_FEW_RUNS,
    PlannedTest,
    describe_too_few,
    smallest_corrected_p,
)
from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.experiment.factors import Factors

Table = Mapping[Quantity, xr.DataArray]


@dataclass(frozen=True)
class Answer:
    """The answer to a criterion. `numbers` is None if it was not measured."""

    criterion: Criterion
    numbers: statistics.Pairs | None
    # Runs in which a or b is undefined.
    left_out: int
    p_holm: float
    verdict: Verdict
    # The smallest corrected p-value that the number of runs allows.
    smallest_p_holm: float = nan

    @property
    def has_too_few_runs(self) -> bool:
        """Whether the answer is undecided because so few runs cannot decide it."""
        return self.verdict == UNDECIDED and self.smallest_p_holm >= SIGNIFICANCE_LEVEL

    @property
    def label(self) -> str:
        """The verdict as a report shows it."""
        return TOO_FEW_RUNS if self.has_too_few_runs else self.verdict


@dataclass(frozen=True)
class ConditionResult:
    """A condition that evolves and learns, with its answers."""

    condition: str
    factors: Factors
    # The condition that differs only in having no learning, or "".
    control: str
    answers: tuple[Answer, ...]
    # Whether no agent ate without learning, in any run and any tested generation.
    eats_only_with_learning: bool
    # Whether agents inherit learned weights.
    is_lamarckian: bool

    def answer(self, criterion: str) -> Answer:
        """Return the answer to a criterion, which is "not measured" if it does not apply."""
        answers = {answer.criterion.id: answer for answer in self.answers}
        if criterion in answers:
            return answers[criterion]
        criteria = {entry.id: entry for entry in load_criteria()}
        return Answer(criteria[criterion], None, 0, nan, NOT_MEASURED)

    def answers_of_phase(self, phase: int | None) -> list[Answer]:
        """Return the answers to the criteria of a phase of the Baldwin effect."""
        return [answer for answer in self.answers if answer.criterion.phase == phase]

    def phase_verdict(self, phase: int) -> Verdict:
        """Return the verdict over the measured criteria of a phase."""
        return combine_verdicts([answer.verdict for answer in self.answers_of_phase(phase)])


@dataclass(frozen=True)
class Number:
    """Median of a quantity over the runs in which it is defined, with its 95 % interval."""

    condition: str
    measure: str
    when: str
    runs: int
    # Runs in which the quantity is undefined.
    left_out: int
    median: float
    low: float
    high: float


@dataclass(frozen=True)
class Analysis:
    """The answers and the numbers of all stored assays."""

    results: tuple[ConditionResult, ...]
    numbers: tuple[Number, ...]
    # Number of generations in the first and the last window.
    last: int
    # Quantities by condition.
    tables: Mapping[str, Table]

    @property
    def too_few(self) -> str:
        """A sentence if the runs are too few for the tests, else ""."""
        answers = [answer for result in self.results for answer in result.answers]
        return describe_too_few([_design(answer.numbers.n) for answer in answers if answer.numbers])

    @property
    def applicable_criteria(self) -> list[Criterion]:
        """The criteria that apply to a condition."""
        applicable = {answer.criterion for result in self.results for answer in result.answers}
        return [criterion for criterion in load_criteria() if criterion in applicable]

    def find_number(self, condition: str, measure: str, when: str) -> Number | None:
        """Return the number of a quantity of a condition, or None if it does not exist."""
        key = (condition, measure, when)
        for number in self.numbers:
            if (number.condition, number.measure, number.when) == key:
                return number
        return None


def evaluate_assays(assays: Assays, last: int = 10) -> Analysis:
    """Test every criterion for every condition that evolves and learns.

    Parameters
    ----------
    assays : mapping of str to mapping of str to xr.Dataset
        Stored assays by assay and condition.
    last : int
        Number of generations in the first and the last window, at least 1.

    Returns
    -------
    Analysis
        The answers, and the numbers of all conditions.

    Raises
    ------
    ValueError
        `last` is less than 1.
    """
    experiments = parse_experiments(assays)
    factors = {
        name: read_factors(data) for stored in assays.values() for name, data in stored.items()
    }
    tables = {name: compute_quantities(assays, name, last) for name in experiments}
    numbers = tuple(number for name, table in tables.items() for number in _numbers(name, table))
    learning = [
        name
        for name, experiment in experiments.items()
        if evolves_and_learns(experiment, assays.get("innate", {}).get(name))
    ]
    controls = {name: find_control(name, experiments) for name in learning}
    for name, control in controls.items():
        if control and INNATE_LAST in tables[control]:
            tables[name][CONTROL_LAST] = tables[control][INNATE_LAST]
    answers = _answer(tables, {name: experiments[name] for name in learning})
    results = [
        ConditionResult(
            name,
            factors[name],
            controls[name],
            answers[name],
            isinstance(experiments[name], Experiment) and _eats_only_with_learning(assays, name),
            experiments[name].evolution.lamarckian_share > 0,
        )
        for name in learning
    ]
    return Analysis(tuple(results), numbers, last, tables)


def _answer(
    tables: Mapping[str, Table], experiments: Mapping[str, BaseExperiment]
) -> dict[str, tuple[Answer, ...]]:
    """Answer the criteria of all conditions. Their tests are one family."""
    measured = {
        (name, criterion): _measure(tables[name], criterion)
        for name, experiment in experiments.items()
        for criterion in load_criteria()
        if criterion.applies_to(experiment)
    }
    tests = {key: pairs for key, (pairs, _) in measured.items() if pairs}
    p_values = statistics.holm([pairs.p for pairs in tests.values()]).tolist()
    limits = smallest_corrected_p([_design(pairs.n) for pairs in tests.values()]).tolist()
    p_holm = dict(zip(tests, p_values, strict=True))
    smallest = dict(zip(tests, limits, strict=True))
    answers: dict[str, list[Answer]] = {name: [] for name in experiments}
    for (name, criterion), (pairs, left_out) in measured.items():
        p = p_holm.get((name, criterion), nan)
        verdict = _decide(SIGNS[criterion.rule], pairs, p)
        limit = smallest.get((name, criterion), nan)
        answers[name].append(Answer(criterion, pairs, left_out, p, verdict, limit))
    return {name: tuple(condition_answers) for name, condition_answers in answers.items()}


def _eats_only_with_learning(assays: Assays, condition: str) -> bool:
    data = assays.get("innate", {}).get(condition)
    return data is not None and not bool((data["energy"].sel(life="off") > 0).any())


def _defined(table: Table, *names: Quantity) -> tuple[list[np.ndarray], int]:
    """Return the values of the runs in which all quantities are defined, and the other runs."""
    values = [table[name].drop_vars(set(table[name].coords) - {"run"}) for name in names]
    aligned = xr.align(*values, join="inner")
    stacked = np.stack([np.asarray(column.values, np.float64) for column in aligned])
    is_defined = np.isfinite(stacked).all(axis=0)
    return list(stacked[:, is_defined]), int((~is_defined).sum())


def _measure(table: Table, criterion: Criterion) -> tuple[statistics.Pairs | None, int]:
    if criterion.a not in table or criterion.b not in table:
        return None, 0
    (a, b), left_out = _defined(table, criterion.a, criterion.b)
    return (statistics.compare_pairs(a, b) if a.size else None), left_out


def _design(runs: int) -> PlannedTest:
    return PlannedTest(runs, runs, "Wilcoxon")


def planned_tests(
    experiments: Mapping[str, Experiment], assays: Mapping[str, Collection[str]], runs: int
) -> list[PlannedTest]:
    """Return the tests that the planned assays allow at most.

    Parameters
    ----------
    experiments : mapping of str to Experiment
        Experiments by condition.
    assays : mapping of str to collection of str
        The assays of each condition.
    runs : int
        Number of runs of each condition.

    Returns
    -------
    list of PlannedTest
        One design per test.
    """
    return [
        _design(runs)
        for name, experiment in experiments.items()
        if evolves_and_learns(experiment, None)
        for criterion in load_criteria()
        if criterion.applies_to(experiment) and criterion.assay in assays[name]
        if criterion.b != CONTROL_LAST or find_control(name, experiments)
    ]


def _decide(sign: int, pairs: statistics.Pairs | None, p_holm: float) -> Verdict:
    """Return the verdict of a criterion that asks for a difference of this sign."""
    if pairs is None:
        return NOT_MEASURED
    if pairs.n > 1 and pairs.above == pairs.below == 0:
        return NO
    # NaN is undecided, too.
    if not p_holm < SIGNIFICANCE_LEVEL:
        return UNDECIDED
    effect = sign * pairs.effect
    majority = sign * (pairs.above - pairs.below)
    if effect > 0 and majority > 0:
        return YES
    return NO if effect < 0 and majority < 0 else UNDECIDED


def _numbers(condition: str, table: Table) -> Iterator[Number]:
    for measure, when in table:
        (values,), left_out = _defined(table, (measure, when))
        if values.size:
            median = float(np.median(values))
            low, high = statistics.median_interval(values)
            yield Number(condition, measure, when, values.size, left_out, median, low, high)
