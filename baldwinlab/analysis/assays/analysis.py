"""Test for the Baldwin effect: apply the criteria of `questions.toml` to the stored assays.

Every condition that evolves and learns is tested. A test compares two quantities run by run, for
example fitness with and without learning. All p-values are one family, corrected by Holm's method.
`section.py` shows the answers in a report.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import nan
from typing import NamedTuple

import numpy as np
import xarray as xr

from baldwinlab.analysis import statistics
from baldwinlab.analysis.assays.criteria import (
    CONTROL_LAST,
    INNATE_LAST,
    RULE_SIGNS,
    Criterion,
    Quantity,
    Terms,
    Verdict,
    combine_verdicts,
    has_foragers,
    load_criteria,
    select_terms,
)
from baldwinlab.analysis.assays.evaluation import (
    Assays,
    compute_quantities,
    drop_labels,
    evolves_and_learns,
    find_learning_conditions,
    parse_experiments,
    read_factors,
)
from baldwinlab.analysis.results.verdicts import (
    EQUAL,
    NO,
    NOT_MEASURABLE,
    NOT_MEASURED,
    TOO_FEW_RUNS,
    UNDECIDED,
    YES,
    FamilyTest,
    correct_family,
)
from baldwinlab.analysis.statistics.hypothesis_tests import sign_interval
from baldwinlab.analysis.statistics.significance import (
    PlannedTest,
    describe_too_few,
    plan_paired_test,
)
from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.experiment.conditions import Factors, find_control

# Values (run) of the quantities of a condition.
Table = Mapping[Quantity, xr.DataArray]


class _QuantityComparison(NamedTuple):
    """The comparison of the two quantities of a criterion."""

    # None if a quantity is not stored, or if no run defines both quantities.
    pairs: statistics.Pairs | None
    # Number of runs in which a quantity is undefined.
    left_out: int = 0
    # Whether all values of both quantities are equal, so that no test is possible.
    is_constant: bool = False

    @property
    def is_tested(self) -> bool:
        """Whether the quantities differ in a run. Equal quantities need no test."""
        return self.pairs is not None and bool(self.pairs.above or self.pairs.below)


@dataclass(frozen=True)
class Answer:
    """The answer to a criterion."""

    criterion: Criterion
    # Comparison of `a` with `b`. None if one is not measured, or if no run defines both.
    numbers: statistics.Pairs | None
    # Number of runs in which `a` or `b` of the criterion is undefined.
    left_out: int
    verdict: Verdict
    # Test with the p-value corrected for all tests of the analysis. None without a comparison, or
    # if a and b are equal in every run.
    test: FamilyTest | None = None

    @property
    def p_holm(self) -> float:
        """The corrected p-value, or NaN without a test."""
        return self.test.p_holm if self.test else nan

    @property
    def has_too_few_runs(self) -> bool:
        """Whether the answer is undecided because it has too few runs."""
        has_too_few_runs = self.test is not None and self.test.has_too_few_runs
        return self.verdict == UNDECIDED and has_too_few_runs

    @property
    def label(self) -> str:
        """The verdict in a report: "too few runs" can replace "undecided"."""
        return TOO_FEW_RUNS if self.has_too_few_runs else self.verdict

    @property
    def note(self) -> str:
        """The reason for the verdict and the required number of runs, or "" without a need."""
        if self.numbers is None or self.test is None:
            return ""
        is_decided = self.verdict != UNDECIDED
        return self.test.explain(self.numbers.low, self.numbers.high, is_decided=is_decided)


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
        """Return the answer to a criterion: "not measured" if the criterion does not apply."""
        answers = {answer.criterion.id: answer for answer in self.answers}
        if criterion in answers:
            return answers[criterion]
        criteria = {entry.id: entry for entry in load_criteria()}
        return Answer(criteria[criterion], numbers=None, left_out=0, verdict=NOT_MEASURED)

    def answers_of_phase(self, phase: int | None) -> list[Answer]:
        """Return the answers to the criteria of a phase of the Baldwin effect."""
        return [answer for answer in self.answers if answer.criterion.phase == phase]

    def phase_verdict(self, phase: int) -> Verdict:
        """Return the verdict over the measured criteria of a phase."""
        return combine_verdicts([answer.verdict for answer in self.answers_of_phase(phase)])


@dataclass(frozen=True)
class Number:
    """Median of a quantity over the runs that define it, with the 95 % interval."""

    condition: str
    # The two parts of a `Quantity`: a measure, and its time or its agents.
    measure: str
    when: str
    # Number of runs that define the quantity, and of runs that do not.
    runs: int
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
    # Quantities by condition, also of conditions that do not learn.
    tables: Mapping[str, Table]
    # Whether any condition uses the MiniWorld model.
    is_foraging: bool
    # Sentence on adding runs. "{runs}" stands for the number of runs that is needed.
    instruction: str = ""

    @property
    def too_few(self) -> str:
        """Sentences if the runs are too few for the tests, else ""."""
        answers = [answer for result in self.results for answer in result.answers]
        tests = [answer.test.planned for answer in answers if answer.test]
        return describe_too_few(tests, instruction=self.instruction)

    @property
    def applicable_criteria(self) -> list[Criterion]:
        """The criteria that apply to at least one condition."""
        applicable = {answer.criterion for result in self.results for answer in result.answers}
        criteria = load_criteria(self.is_foraging)
        return [criterion for criterion in criteria if criterion in applicable]

    @property
    def terms(self) -> Terms:
        """The terms of the texts about the conditions."""
        return select_terms(self.is_foraging)

    def find_number(self, condition: str, measure: str, when: str) -> Number | None:
        """Return the number of a quantity of a condition, or None if it does not exist."""
        key = (condition, measure, when)
        for number in self.numbers:
            if (number.condition, number.measure, number.when) == key:
                return number
        return None


def evaluate_assays(assays: Assays, last: int = 10, instruction: str = "") -> Analysis:
    """Test every criterion for every condition that evolves and learns.

    `last`: number of generations in the first and the last window, at least 1.
    """
    experiments = parse_experiments(assays)
    factors = {
        name: read_factors(data) for stored in assays.values() for name, data in stored.items()
    }
    tables = {name: compute_quantities(assays, name, last) for name in experiments}
    numbers = tuple(
        number for name, table in tables.items() for number in _compute_numbers(name, table)
    )
    learning_conditions = find_learning_conditions(assays, experiments)
    controls = {name: find_control(name, experiments) for name in learning_conditions}
    for name, control in controls.items():
        if control and INNATE_LAST in tables[control]:
            # A criterion compares quantities of one table, so this table needs the value, too.
            tables[name][CONTROL_LAST] = tables[control][INNATE_LAST]
    is_foraging = has_foragers(experiments.values())
    learning_experiments = {name: experiments[name] for name in learning_conditions}
    answers = _answer_criteria(tables, learning_experiments, load_criteria(is_foraging))
    results = [
        ConditionResult(
            condition=name,
            factors=factors[name],
            control=controls[name],
            answers=answers[name],
            eats_only_with_learning=isinstance(experiments[name], Experiment)
            and _eats_only_with_learning(assays, name),
            is_lamarckian=experiments[name].evolution.lamarckian_share > 0,
        )
        for name in learning_conditions
    ]
    return Analysis(tuple(results), numbers, last, tables, is_foraging, instruction)


def _answer_criteria(
    tables: Mapping[str, Table],
    experiments: Mapping[str, BaseExperiment],
    criteria: Sequence[Criterion],
) -> dict[str, tuple[Answer, ...]]:
    """Answer the criteria of all conditions. All tests together are one family."""
    comparisons = {
        (name, criterion): _compare_quantities(tables[name], criterion)
        for name, experiment in experiments.items()
        for criterion in criteria
        if criterion.applies_to(experiment)
    }
    family = correct_family(
        {
            key: (plan_paired_test(comparison.pairs.n), comparison.pairs.p)
            for key, comparison in comparisons.items()
            if comparison.pairs and comparison.is_tested
        }
    )
    answers: dict[str, list[Answer]] = {name: [] for name in experiments}
    for (name, criterion), comparison in comparisons.items():
        test = family.get((name, criterion))
        verdict = _decide(RULE_SIGNS[criterion.rule], comparison, test)
        answers[name].append(
            Answer(criterion, comparison.pairs, comparison.left_out, verdict, test)
        )
    return {name: tuple(condition_answers) for name, condition_answers in answers.items()}


def _eats_only_with_learning(assays: Assays, condition: str) -> bool:
    """Return whether no agent of a condition ate with learning off."""
    data = assays.get("innate", {}).get(condition)
    return data is not None and not bool((data["energy"].sel(life="off") > 0).any())


def _select_defined(table: Table, *names: Quantity) -> tuple[list[np.ndarray], int]:
    """Return values [run] in the runs that define all quantities, and the number of other runs."""
    columns = [drop_labels(table[name]) for name in names]
    aligned = xr.align(*columns, join="inner")  # Runs that have all quantities.
    # [quantity, run]
    values = np.stack([np.asarray(column.values, np.float64) for column in aligned])
    is_defined = np.isfinite(values).all(axis=0)
    n_undefined = int((~is_defined).sum())
    return list(values[:, is_defined]), n_undefined


def _compare_quantities(table: Table, criterion: Criterion) -> _QuantityComparison:
    if criterion.a not in table or criterion.b not in table:
        return _QuantityComparison(None)
    (a, b), left_out = _select_defined(table, criterion.a, criterion.b)
    if not a.size:
        return _QuantityComparison(None, left_out)
    is_constant = bool((a == a[0]).all() and (b == a[0]).all())
    pairs = statistics.compare_pairs(a, b)
    if criterion.is_ratio:
        # The signs of the differences and of the logarithms are equal, and so are their tests.
        changes = 100 * np.expm1(statistics.log_ratio(a, b))
        low, high = sign_interval(changes)
        pairs = pairs._replace(effect=float(np.median(changes)), low=low, high=high)
    return _QuantityComparison(pairs, left_out, is_constant)


def planned_tests(
    experiments: Mapping[str, Experiment], assays: Mapping[str, Collection[str]], runs: int
) -> list[PlannedTest]:
    """Return the tests of planned assays, assuming that every run defines every quantity."""
    tests = []
    for name, experiment in experiments.items():
        if not evolves_and_learns(experiment, None):
            continue
        has_control = bool(find_control(name, experiments))
        for criterion in load_criteria():
            is_measured = criterion.applies_to(experiment) and criterion.assay in assays[name]
            if is_measured and (has_control or criterion.b != CONTROL_LAST):
                tests.append(plan_paired_test(runs))
    return tests


def _decide(sign: int, comparison: _QuantityComparison, test: FamilyTest | None) -> Verdict:
    """Return the verdict of a criterion that requires a difference with the sign `sign`."""
    pairs = comparison.pairs
    if pairs is None:
        return NOT_MEASURED
    if test is None:
        return NOT_MEASURABLE if comparison.is_constant else EQUAL
    verdicts: Mapping[int, Verdict] = {1: YES, 0: UNDECIDED, -1: NO}
    return verdicts[sign * test.find_direction(pairs)]


def _compute_numbers(condition: str, table: Table) -> Iterator[Number]:
    for measure, when in table:
        (values,), left_out = _select_defined(table, (measure, when))
        if values.size:
            estimate = (float(np.median(values)), *statistics.median_interval(values))
            yield Number(condition, measure, when, values.size, left_out, *estimate)
