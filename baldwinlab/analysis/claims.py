"""A paper's claims held against a study: which hold, which do not, and by how much.

The claims are data of the paper. All p-values of all claims are one family, corrected by Holm's method.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from math import nan
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt
import xarray as xr

from baldwinlab.analysis import statistics
from baldwinlab.analysis.statistics import fitness
from baldwinlab.analysis.statistics.contrasts import COLUMNS, Contrast
from baldwinlab.analysis.statistics.csv import finite_or_none, to_csv
from baldwinlab.analysis.statistics.rules import (
    BY_P_VALUE,
    OVER_RUNS,
    RULES,
    SIGNIFICANT,
    UNDECIDED,
    VERDICTS,
    Verdict,
    conjunction,
)
from baldwinlab.analysis.statistics.sample_sizes import (
    TOO_FEW,
    Design,
    describe_too_few,
    smallest_corrected,
)
from baldwinlab.analysis.statistics.summary import SUMMARY_COLUMNS, summarize_conditions
from baldwinlab.analysis.statistics.survival import Survival, compare_survival
from baldwinlab.core.files import write_atomically
from baldwinlab.papers import load
from baldwinlab.papers.claims import FIRST, OF_ALL, Claim, Comparison


@dataclass(frozen=True)
class Finding:
    """One comparison, decided. Numbers that do not exist are NaN."""

    comparison: Comparison
    numbers: statistics.Comparison
    p_holm: float
    verdict: Verdict
    meaning: str = ""  # of a model's own measure, in words
    smallest_p_holm: float = nan  # the smallest corrected p-value that the numbers of runs allow

    @property
    def has_too_few_runs(self) -> bool:
        """Whether it is undecided because no data of so few runs could decide it."""
        by_p = self.comparison.rule in BY_P_VALUE
        impossible = (
            self.smallest_p_holm >= SIGNIFICANT
            if by_p
            else 1 in self.numbers[:2] and math.isnan(self.numbers.low)
        )
        return self.verdict == UNDECIDED and impossible

    @property
    def label(self) -> str:
        """The verdict as a report shows it."""
        return TOO_FEW if self.has_too_few_runs else self.verdict

    def record(self) -> dict[str, Any]:
        """For JSON: null where a number does not exist."""
        numbers = {name: finite_or_none(value) for name, value in self.numbers._asdict().items()}
        low, high = numbers.pop("low"), numbers.pop("high")
        where = {
            "condition": self.comparison.a,
            "comparison": self.comparison.other,
            "measure": self.comparison.measure,
        }
        tested = {
            "interval": None if low is None else [low, high],
            "p_holm": finite_or_none(self.p_holm),
            "verdict": self.verdict,
        }
        tested |= {
            "smallest_p_holm": finite_or_none(self.smallest_p_holm),
            "too_few_runs": self.has_too_few_runs,
        }
        return where | numbers | tested


@dataclass(frozen=True)
class ClaimResult:
    claim: Claim
    findings: tuple[Finding, ...]
    missing: tuple[str, ...]  # conditions that the study has no run of
    unmeasured: tuple[str, ...] = ()  # measures of models that are not loaded

    @property
    def verdict(self) -> Verdict:
        return conjunction([finding.verdict for finding in self.findings])

    @property
    def has_too_few_runs(self) -> bool:
        """Whether it is undecided and more runs are needed for a verdict."""
        return self.verdict == UNDECIDED and any(
            finding.has_too_few_runs for finding in self.findings
        )

    @property
    def label(self) -> str:
        """The verdict as a report shows it."""
        return TOO_FEW if self.has_too_few_runs else self.verdict

    @property
    def why_not(self) -> str:
        """Why it is not evaluated, in words; "" where it is."""
        if self.missing:
            return f"no run of {', '.join(self.missing)}"
        if self.unmeasured:
            return f"{', '.join(map(repr, self.unmeasured))} needs a model that is not loaded: give it by --part FILE"
        return ""

    @property
    def deciding(self) -> Finding | None:
        """The weakest finding: the worst verdict, and of equals the largest corrected p."""
        weakness = [
            (VERDICTS.index(finding.verdict), finite_or_none(finding.p_holm) or 0.0)
            for finding in self.findings
        ]
        return self.findings[weakness.index(max(weakness))] if weakness else None

    @property
    def from_paper(self) -> float | None:
        """How far the deciding effect lies above the paper's figure, where there are both."""
        if (
            self.deciding is None
            or self.claim.figure is None
            or math.isnan(self.deciding.numbers.effect)
        ):
            return None
        return self.deciding.numbers.effect - self.claim.figure

    def record(self) -> dict[str, Any]:
        """For JSON: the numbers are those of the deciding comparison, and null where there are none."""
        deciding: dict[str, Any] = self.deciding.record() if self.deciding else {}
        names = ("condition", "comparison", "measure", "effect", "interval", "p", "p_holm", "a12")
        claim = self.claim
        return {
            "id": claim.id,
            "claim": claim.text,
            **{name: deciding.get(name) for name in names},
            "verdict": self.verdict,
            "too_few_runs": self.has_too_few_runs,
            "rule": claim.rule,
            "paper": claim.paper,
            "figure": claim.figure,
            "from_figure": self.from_paper,
            "missing": list(self.missing),
            "why_not": self.why_not,
            "comparisons": [finding.record() for finding in self.findings],
        }


class Claiming(Protocol):
    """A paper, or whoever else makes claims."""

    @property
    def claims(self) -> tuple[Claim, ...]: ...

    def measures(self, name: str, /) -> Mapping[str, Any] | None:
        """The models' own measures that a condition of that name has, by name; None where its model is not loaded."""
        ...


def evaluate(
    dataset: xr.Dataset, last: int = 10, paper: Claiming | None = None
) -> list[ClaimResult]:
    """Every claim of a paper (the default unless given), decided on averages over the last `last` generations of each run.

    `dataset` has the dimensions (condition, run, generation, agent). A claim is not evaluated, and says why, where the dataset has
    no run of a condition, or where the model of a measure is not loaded. Raises ValueError unless `last` is at least 1.
    """
    paper = paper or load()
    claims, samples = paper.claims, _Samples(dataset, last, paper)
    missing = {claim: sorted(claim.conditions - samples.present) for claim in claims}
    unmeasured = {claim: sorted(samples.unmeasured(claim)) for claim in claims}
    decided = [claim for claim in claims if not (missing[claim] or unmeasured[claim])]
    numbers = {
        comparison: _measure(comparison, samples)
        for claim in decided
        for comparison in claim.comparisons
    }
    tested = [comparison for comparison, found in numbers.items() if not math.isnan(found.p)]
    corrected = statistics.holm([numbers[comparison].p for comparison in tested]).tolist()
    smallest = smallest_corrected(
        [_design(comparison, *numbers[comparison][:2]) for comparison in tested]
    ).tolist()
    family = dict(zip(tested, zip(corrected, smallest, strict=True), strict=True))

    def decide(comparison: Comparison) -> Finding:
        found, (p_holm, smallest_p) = numbers[comparison], family.get(comparison, (nan, nan))
        verdict = RULES[comparison.rule](found, p_holm, comparison.bound)
        return Finding(comparison, found, p_holm, verdict, samples.meaning(comparison), smallest_p)

    return [
        ClaimResult(
            claim,
            tuple(map(decide, claim.comparisons)) if claim in decided else (),
            tuple(missing[claim]),
            tuple(unmeasured[claim]),
        )
        for claim in claims
    ]


def _design(comparison: Comparison, n_a: int, n_b: int) -> Design:
    """Return the test of a comparison of two samples."""
    if comparison.rule == "survives_longer":
        return Design(n_a, n_b, "log-rank")
    return Design(n_a, n_b, "Wilcoxon" if comparison.paired else "Mann-Whitney")


def describe_claims_too_few(results: Sequence[ClaimResult]) -> str:
    """Say in a sentence whether the runs are too few for the tests of the claims; "" where they are not."""
    findings = {finding.comparison: finding for result in results for finding in result.findings}
    tested = [finding for finding in findings.values() if not math.isnan(finding.p_holm)]
    return describe_too_few(
        [_design(finding.comparison, *finding.numbers[:2]) for finding in tested]
    )


def planned_claim_designs(
    claims: Sequence[Claim], conditions: Collection[str], runs: int
) -> list[Design]:
    """Return the tests that these claims will make of a study with so many runs of each of these conditions."""
    decided = [claim for claim in claims if claim.conditions <= {*conditions}]
    tested = {comparison for claim in decided for comparison in claim.comparisons if comparison.b}
    return [_design(comparison, runs, runs) for comparison in tested]


def compared(
    dataset: xr.Dataset, paper: Claiming
) -> list[tuple[str, str, dict[str, npt.NDArray[np.float64]]]]:
    """The models' own measures in which claims compare conditions: name, meaning, and by condition a value a run."""
    samples = _Samples(dataset, 1, paper)
    held = {
        one.measure: one
        for claim in paper.claims
        for one in claim.comparisons
        if one.b and samples.meaning(one)
    }
    names = [str(name) for name in dataset["condition"].values]
    return [
        (
            name,
            samples.meaning(one),
            {condition: samples.get(condition, name).values for condition in names},
        )
        for name, one in held.items()
    ]


class _Samples:
    """One value a run: what a measure comes to in a condition's last generations, or its first; or a model's own measure."""

    def __init__(self, dataset: xr.Dataset, last: int, paper: Claiming) -> None:
        dataset = fitness.with_curves(dataset)
        self._study, self._paper = dataset, paper
        self._last = {
            measure: fitness.final(dataset, measure, last) for measure in fitness.MEASURES
        }
        self._last["most"] = fitness.largest_gain(dataset)
        self._first = {
            measure: fitness.initial(dataset, measure, last) for measure in fitness.MEASURES
        }
        self._own: dict[tuple[str, str], xr.DataArray] = {}  # of the models, by condition and name
        runs = self._last["best"].notnull().any("run")
        self.present = {str(name) for name in dataset["condition"].values[runs.values]}

    def unmeasured(self, claim: Claim) -> set[str]:
        """The measures of a claim whose model is not loaded."""
        return {
            comparison.measure
            for comparison in claim.comparisons
            if comparison.measure not in OF_ALL
            and any(self._paper.measures(name) is None for name in comparison.conditions)
        }

    def meaning(self, comparison: Comparison) -> str:
        own = {} if comparison.measure in OF_ALL else self._paper.measures(comparison.a) or {}
        return own[comparison.measure].meaning if comparison.measure in own else ""

    def get(self, condition: str, measure: str, first: bool = False) -> xr.DataArray:
        """By run; of none where the measure is that of a model which is not loaded."""
        if measure not in OF_ALL:
            if (condition, measure) not in self._own:
                self._own[condition, measure] = self._ask(condition, measure)
            return self._own[condition, measure]
        table = self._first if first else self._last
        return table[measure].sel(condition=condition).dropna("run").astype(np.float64)

    def survival(self, condition: str, measure: str) -> Survival:
        """By run; which are censored says the measure."""
        own = self._paper.measures(condition) or {}
        times, tells = self.get(condition, measure), own[measure].censored
        runs = self._study.sel(condition=condition, run=times["run"].values)
        return Survival(times.values, tells(_without_gaps(runs)).values)

    def _ask(self, condition: str, measure: str) -> xr.DataArray:
        own = self._paper.measures(condition) or {}
        if measure not in own:
            return xr.DataArray(np.empty(0), {"run": np.empty(0, np.int64)})
        found: xr.DataArray = own[measure].of(_without_gaps(self._study.sel(condition=condition)))
        return found.dropna("run").astype(np.float64)


def _without_gaps(runs: xr.Dataset) -> xr.Dataset:
    """Without the runs, generations and agents that others have and these have not; nothing is copied where none is missing."""
    for dim in ("run", "generation", "agent"):
        lived = (
            runs["energy"].notnull().any([other for other in runs["energy"].dims if other != dim])
        )
        runs = runs if bool(lived.all()) else runs.isel({dim: lived.values})
    return runs


def _measure(comparison: Comparison, samples: _Samples) -> statistics.Comparison:
    a = samples.get(comparison.a, comparison.measure)
    other = comparison.a if comparison.b == FIRST else comparison.b
    b = samples.get(other, comparison.measure, first=comparison.b == FIRST) if comparison.b else a
    if comparison.paired:
        a, b = xr.align(a, b)
    if not (a.size and b.size):  # a model's own measure may be of no run
        return statistics.Comparison(a.size, b.size if comparison.b else 0, *[nan] * 8)
    if comparison.rule == "survives_longer":
        return compare_survival(
            *(samples.survival(name, comparison.measure) for name in (comparison.a, comparison.b))
        )
    if comparison.b:
        return (statistics.compare_paired if comparison.paired else statistics.compare)(
            a.values, b.values
        )
    median = float(np.median(a))
    if comparison.measure == "most" or comparison.rule in OVER_RUNS:
        found = float(OVER_RUNS.get(comparison.rule, np.max)(a))
        return statistics.Comparison(a.size, 0, median, nan, found, nan, nan, nan, nan, nan)
    return statistics.Comparison(
        a.size, 0, median, nan, median, *statistics.median_interval(a.values), nan, nan, nan
    )


def claim_records(
    results: Sequence[ClaimResult], paper: str = "", changes: Sequence[str] = ()
) -> list[dict[str, Any]]:
    """Return the claims for JSON, each with the name of the paper that made the study, and the changes of its model."""
    belongs: dict[str, Any] = {"publication": paper} if paper else {}
    belongs |= {"changes": list(changes)} if changes else {}
    return [result.record() | belongs for result in results]


STATISTICS_COLUMNS = ("claim", *COLUMNS)


def write(
    results: Sequence[ClaimResult],
    dataset: xr.Dataset,
    directory: Path,
    last: int = 10,
    contrasts: Sequence[Contrast] = (),
) -> None:
    """Write `statistics.csv` (a row per comparison) and `summary.csv` (a row per condition and measure).

    `statistics.csv` has the comparisons of conditions first, without a claim, and then those of the
    claims. Each file appears whole or not at all. Raises OSError.
    """
    rows = [{"claim": ""} | contrast.row() for contrast in contrasts]
    rows += [_row(result.claim.id, finding) for result in results for finding in result.findings]
    write_atomically(directory / "statistics.csv", to_csv(STATISTICS_COLUMNS, rows))
    write_atomically(
        directory / "summary.csv", to_csv(SUMMARY_COLUMNS, summarize_conditions(dataset, last))
    )


def _row(claim: str, finding: Finding) -> dict[str, Any]:
    where = {
        "claim": claim,
        "condition_a": finding.comparison.a,
        "condition_b": finding.comparison.other,
    }
    return (
        where
        | {"measure": finding.comparison.measure, "p_holm": finding.p_holm}
        | finding.numbers._asdict()
    )
