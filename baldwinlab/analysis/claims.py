"""Evaluate the claims of a paper in a study: which claims hold, and how large the effects are.

The claims are data of the paper. Holm's method corrects the p-values of all claims together, as one
family of tests.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from math import nan
from pathlib import Path
from typing import Any, Final

import numpy as np
import xarray as xr

from baldwinlab.analysis import statistics
from baldwinlab.analysis.claim_results import ClaimResult, Finding
from baldwinlab.analysis.claim_samples import ClaimSource, Samples
from baldwinlab.analysis.results.contrasts import COMPARISON_COLUMNS, Contrast
from baldwinlab.analysis.results.numbers import to_csv
from baldwinlab.analysis.results.verdicts import FamilyTest, correct_family, decide
from baldwinlab.analysis.statistics.comparisons import direction_stability
from baldwinlab.analysis.statistics.fitness import SUMMARY_COLUMNS, summarize_conditions
from baldwinlab.analysis.statistics.intervals import estimate_probability
from baldwinlab.analysis.statistics.significance import PlannedTest, describe_too_few
from baldwinlab.analysis.statistics.survival import compare_survival
from baldwinlab.core.file_writing import write_atomically
from baldwinlab.experiment.conditions import add_maps, read_factors
from baldwinlab.papers.claims import FIRST_GENERATIONS, Claim, ClaimComparison
from baldwinlab.papers.rules import RULES

SUMMARIES: Final[Mapping[str, Callable[..., Any]]] = {
    "mean": np.mean,
    "minimum": np.min,
    "maximum": np.max,
}
"""Statistics over runs for which no interval is computed."""
STATISTICS_COLUMNS = ("claim", *COMPARISON_COLUMNS)


def evaluate_claims(
    data: xr.Dataset, last: int = 10, source: ClaimSource | None = None
) -> list[ClaimResult]:
    """Evaluate all claims of a paper.

    A claim is not evaluated if the study has no run of a condition, if the model of a measure is
    not loaded, or if an assay is not stored.

    `data`: the runs (condition, run, generation, agent). `last`: number of averaged generations.
    `source`: the source of the claims, by default the default paper.
    """
    return evaluate_samples(Samples(data, last, source))


def evaluate_samples(samples: Samples) -> list[ClaimResult]:
    """Evaluate all claims from values that are already computed. See `evaluate_claims`."""
    claims = samples.source.claims
    missing = {claim: sorted(claim.conditions - samples.conditions_with_runs) for claim in claims}
    unmeasured = {claim: sorted(samples.unloaded_measures(claim)) for claim in claims}
    # A condition without runs lacks the assay too. Then only the missing runs are reported.
    unassayed = {
        claim: () if missing[claim] else tuple(sorted(samples.unassayed_measures(claim)))
        for claim in claims
    }
    evaluated = [
        claim for claim in claims if not (missing[claim] or unmeasured[claim] or unassayed[claim])
    ]
    findings = _find_results(evaluated, samples)
    return [
        ClaimResult(
            claim=claim,
            # A claim that cannot be evaluated has no findings.
            findings=tuple(findings[item] for item in claim.comparisons if claim in evaluated),
            missing=tuple(missing[claim]),
            unmeasured=tuple(unmeasured[claim]),
            unassayed=unassayed[claim],
        )
        for claim in claims
    ]


def _find_results(claims: Sequence[Claim], samples: Samples) -> dict[ClaimComparison, Finding]:
    """Return the finding of each comparison. The tests of all comparisons are one family."""
    comparisons = dict.fromkeys(comparison for claim in claims for comparison in claim.comparisons)
    numbers = {comparison: _measure_comparison(comparison, samples) for comparison in comparisons}
    family = correct_family(
        {
            comparison: (_planned_test(comparison, row.n_a, row.n_b), row.p)
            for comparison, row in numbers.items()
        }
    )
    return {
        comparison: _make_finding(comparison, samples, row, family.get(comparison))
        for comparison, row in numbers.items()
    }


def _make_finding(
    comparison: ClaimComparison,
    samples: Samples,
    numbers: statistics.Comparison,
    test: FamilyTest | None,
) -> Finding:
    p_holm = test.p_holm if test else nan
    return Finding(
        comparison=comparison,
        numbers=numbers,
        verdict=decide(RULES[comparison.rule], numbers, p_holm, comparison.bound),
        meaning=samples.meaning(comparison),
        test=test,
        stability=_measure_stability(comparison, samples, numbers, test),
        unused_runs=_count_unused_runs(comparison, samples, numbers),
    )


def _count_unused_runs(
    comparison: ClaimComparison, samples: Samples, numbers: statistics.Comparison
) -> dict[str, int]:
    """Return the number of stored runs that a comparison does not use, by condition, if above 0.

    The measure has no value for such a run, or for the other run of its pair.
    """
    used = {comparison.a: numbers.n_a}
    if comparison.b and comparison.b != FIRST_GENERATIONS:
        used[comparison.b] = numbers.n_b
    unused = {name: samples.n_runs[name] - n_used for name, n_used in used.items()}
    return {name: n_runs for name, n_runs in unused.items() if n_runs}


def _measure_stability(
    comparison: ClaimComparison,
    samples: Samples,
    numbers: statistics.Comparison,
    test: FamilyTest | None,
) -> float:
    """Return the stability of the direction of a rank test, NaN without a rank test."""
    if RULES[comparison.rule].kind != "direction" or test is None:
        return nan
    a, b = _get_samples(comparison, samples)
    return direction_stability(
        a.values, b.values, test.find_direction(numbers), test.level, is_paired=comparison.paired
    )


def _planned_test(comparison: ClaimComparison, n_a: int, n_b: int) -> PlannedTest:
    """Return the test of a comparison, with the numbers of runs of the two samples."""
    if comparison.rule == "survives_longer":
        return PlannedTest(n_a, n_b, "log-rank")
    return PlannedTest(n_a, n_b, "sign" if comparison.paired else "Mann-Whitney")


def describe_claims_too_few(results: Sequence[ClaimResult], instruction: str = "") -> str:
    """Return sentences if the runs are too few for the tests of the claims, else ""."""
    # Claims can share a comparison, which has one test.
    findings = {finding.comparison: finding for result in results for finding in result.findings}
    tests = [finding.test.planned for finding in findings.values() if finding.test]
    return describe_too_few(tests, instruction=instruction)


def planned_claim_tests(
    claims: Sequence[Claim], conditions: Collection[str], runs: int
) -> list[PlannedTest]:
    """Return the tests of the claims in a study with `runs` runs of each of `conditions`."""
    # A claim about a condition outside the study is not evaluated.
    evaluated = [claim for claim in claims if claim.conditions <= {*conditions}]
    tested = {comparison for claim in evaluated for comparison in claim.comparisons if comparison.b}
    return [_planned_test(comparison, n_a=runs, n_b=runs) for comparison in tested]


def _measure_comparison(comparison: ClaimComparison, samples: Samples) -> statistics.Comparison:
    """Compare two conditions, or measure one if the claim names no second condition."""
    if comparison.b:
        return _compare_conditions(comparison, samples)
    values = samples.get(comparison.a, comparison.measure)
    # A measure that a model defines may have no value.
    if not values.size:
        return statistics.Comparison(n_a=0, n_b=0)
    median = float(np.median(values))
    effect, low, high = median, nan, nan
    statistic = RULES[comparison.rule].statistic
    if statistic in SUMMARIES:
        # A mean or an extreme of all runs has no interval.
        effect = float(SUMMARIES[statistic](values))
    elif statistic == "probability":
        effect, low, high = estimate_probability(values.values)
    else:
        low, high = statistics.median_interval(values.values)
    return statistics.Comparison(
        n_a=values.size, n_b=0, median_a=median, effect=effect, low=low, high=high
    )


def _compare_conditions(comparison: ClaimComparison, samples: Samples) -> statistics.Comparison:
    """Compare two conditions, or the last and the first generations of one condition."""
    a, b = _get_samples(comparison, samples)
    # A measure that a model defines may have no value.
    if not (a.size and b.size):
        return statistics.Comparison(a.size, b.size)
    if comparison.rule == "survives_longer":
        return compare_survival(
            samples.survival(comparison.a, comparison.measure),
            samples.survival(comparison.b, comparison.measure),
        )
    compare = statistics.compare_paired if comparison.paired else statistics.compare
    return compare(a.values, b.values)


def _get_samples(
    comparison: ClaimComparison, samples: Samples
) -> tuple[xr.DataArray, xr.DataArray]:
    """Return the values [run] of both conditions, or of the last and the first generations."""
    compares_with_first = comparison.b == FIRST_GENERATIONS
    condition_b = comparison.a if compares_with_first else comparison.b
    a = samples.get(comparison.a, comparison.measure)
    b = samples.get(condition_b, comparison.measure, first=compares_with_first)
    # Pairs are the runs that both samples have.
    if comparison.paired:
        a, b = xr.align(a, b)
    return a, b


def claim_records(
    results: Sequence[ClaimResult], paper: str = "", changes: Sequence[str] = ()
) -> list[dict[str, Any]]:
    """Return the results of claims, and the changes of the paper's model, as records for JSON."""
    origin: dict[str, Any] = {"publication": paper} if paper else {}
    if changes:
        origin["changes"] = list(changes)
    return [result.record() | origin for result in results]


def write_statistics(
    results: Sequence[ClaimResult],
    data: xr.Dataset,
    directory: Path,
    last: int = 10,
    contrasts: Sequence[Contrast] = (),
) -> None:
    """Write `statistics.csv` and `summary.csv`, each atomically.

    `data`: the runs, with the dimensions (condition, run, generation, agent). `last`: number of
    averaged generations. `contrasts`: comparisons of conditions, which are the first rows of
    `statistics.csv`, with an empty column `claim`.
    """
    rows = [{"claim": ""} | contrast.row() for contrast in contrasts]
    rows += [
        _make_row(result.claim.id, finding) for result in results for finding in result.findings
    ]
    factors = read_factors(data)
    for name, columns, table in (
        ("statistics.csv", STATISTICS_COLUMNS, rows),
        ("summary.csv", SUMMARY_COLUMNS, summarize_conditions(data, last)),
    ):
        write_atomically(directory / name, to_csv(*add_maps(columns, table, factors)))


def _make_row(claim: str, finding: Finding) -> dict[str, Any]:
    return {
        "claim": claim,
        "condition_a": finding.comparison.a,
        "condition_b": finding.comparison.reference,
        "measure": finding.comparison.measure,
        "p_holm": finding.p_holm,
        "verdict": finding.label,
        **finding.numbers._asdict(),
    }
