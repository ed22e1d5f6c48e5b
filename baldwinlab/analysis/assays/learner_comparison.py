"""Comparison of learners with the learner that only evolves, on the same maps.

The comparison combines verdicts on the claims of the study with results of its assays.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

from baldwinlab.analysis.assays.analysis import Analysis, Answer
from baldwinlab.analysis.assays.criteria import NOT_MEASURED, YES, Verdict
from baldwinlab.analysis.claim_results import ClaimResult, Finding
from baldwinlab.analysis.statistics.csv import finite_or_none
from baldwinlab.analysis.statistics.rules import FAILS, HOLDS
from baldwinlab.experiment.factors import Factors

# A column of the table of learners shows one criterion of `questions.toml`: its key and its name.
CRITERIA_BY_COLUMN: Final = {"innate": "built-innate", "learned": "built-learned", "cost": "cost"}

# Names of maps by learner.
MapsByLearner = Mapping[str, Sequence[str]]


class LearnerOnMap(NamedTuple):
    """A learner on a map, compared with evolution alone."""

    learner: str
    map: str
    # Fitness of the average agent, compared with evolution alone.
    finding: Finding
    # The answers that the assays give, by column of the table of learners.
    answers: Mapping[str, Answer]

    def has_answer(self, name: str, *verdicts: Verdict) -> bool:
        """Return whether a criterion has one of the given verdicts."""
        return name in self.answers and self.answers[name].verdict in verdicts

    def record(self) -> dict[str, Any]:
        """Return the comparison for JSON and CSV, with None for undefined numbers."""
        numbers = self.finding.numbers
        row: dict[str, Any] = {
            "learner": self.learner,
            "map": self.map,
            "median": numbers.median_a,
            "median_reference": numbers.median_b,
            "effect": numbers.effect,
            "p_holm": self.finding.p_holm,
            "verdict": self.finding.verdict,
        }
        for name in CRITERIA_BY_COLUMN:
            row |= _make_answer_record(name, self.answers.get(name))
        return {
            name: finite_or_none(value) if isinstance(value, float) else value
            for name, value in row.items()
        }


def _make_answer_record(name: str, answer: Answer | None) -> dict[str, Any]:
    numbers = answer.numbers if answer else None
    return {
        name: numbers.median_a if numbers else None,
        f"{name}_reference": numbers.median_b if numbers else None,
        f"{name}_effect": numbers.effect if numbers else None,
        f"{name}_p_holm": answer.p_holm if answer else None,
        f"{name}_verdict": answer.verdict if answer else NOT_MEASURED,
    }


@dataclass(frozen=True)
class LearnerComparison:
    """All learners on all maps, compared with the learner that only evolves."""

    # The learner that only evolves.
    reference: str
    maps: tuple[str, ...]
    entries: tuple[LearnerOnMap, ...]

    @property
    def learners(self) -> list[str]:
        """The compared learners."""
        return list(dict.fromkeys(entry.learner for entry in self.entries))

    @property
    def reference_conditions(self) -> set[str]:
        """The conditions of the learner that only evolves."""
        return {entry.finding.comparison.reference for entry in self.entries}

    @property
    def maps_without_food(self) -> list[str]:
        """The maps on which the reference eats nothing, in the median over runs."""
        return [map_name for map_name in self.maps if self._reference_starves(map_name)]

    def _reference_starves(self, map_name: str) -> bool:
        entries = [entry for entry in self.entries if entry.map == map_name]
        return all(entry.finding.numbers.median_b == 0 for entry in entries)

    @property
    def measured_criteria(self) -> list[str]:
        """The criteria that were measured for a learner."""
        return [
            name
            for name in CRITERIA_BY_COLUMN
            if any(name in entry.answers for entry in self.entries)
        ]

    @property
    def successful_learners(self) -> MapsByLearner:
        """Learners that eat more than the reference, on `maps_without_food` if there are any."""
        maps = self.maps_without_food or self.maps
        return _group_maps_by_learner(
            entry for entry in self.entries if entry.finding.verdict == HOLDS and entry.map in maps
        )

    @property
    def innate_with_gain(self) -> MapsByLearner:
        """Learners whose innate fitness evolved and that eat more than the reference."""
        return _group_maps_by_learner(
            entry
            for entry in self.entries
            if entry.has_answer("innate", YES) and entry.finding.verdict == HOLDS
        )

    @property
    def innate_without_gain(self) -> MapsByLearner:
        """Learners whose innate fitness evolved but that do not eat more than the reference."""
        return _group_maps_by_learner(
            entry
            for entry in self.entries
            if entry.has_answer("innate", YES) and entry.finding.verdict != HOLDS
        )

    @property
    def worse_learners(self) -> MapsByLearner:
        """Learners that eat less than the reference."""
        return _group_maps_by_learner(
            entry for entry in self.entries if entry.finding.verdict == FAILS
        )

    @property
    def learning_costs(self) -> MapsByLearner:
        """Learners that lose food while they learn: born with learned weights, they eat more."""
        return _group_maps_by_learner(
            entry for entry in self.entries if entry.has_answer("cost", YES)
        )


def _group_maps_by_learner(entries: Iterable[LearnerOnMap]) -> MapsByLearner:
    maps: dict[str, list[str]] = {}
    for entry in entries:
        maps.setdefault(entry.learner, []).append(entry.map)
    return maps


def compare_learners(
    results: Sequence[ClaimResult], factors: Mapping[str, Factors], analysis: Analysis | None
) -> LearnerComparison | None:
    """Compare all learners with evolution alone, map by map.

    Parameters
    ----------
    results : sequence of ClaimResult
        The evaluated claims.
    factors : mapping of str to Factors
        Factors by condition, in the order of the study.
    analysis : Analysis or None
        The analysis of the study's assays.

    Returns
    -------
    LearnerComparison or None
        The comparison, or None if the claims do not compare all learners with one reference
        learner on the same map.
    """
    findings = {
        finding.comparison.a: finding
        for result in results
        for finding in result.findings
        if _compares_averages(finding) and finding.comparison.b in factors
    }
    references = {factors[finding.comparison.b].learner for finding in findings.values()}
    if len(references) != 1:
        return None
    if not all(_is_same_map(finding, factors) for finding in findings.values()):
        return None
    (reference,) = references
    entries = tuple(
        LearnerOnMap(
            learner=condition.learner.removeprefix(f"{reference}+"),
            map=condition.map,
            finding=findings[name],
            answers=_select_measured_answers(name, analysis),
        )
        for name, condition in factors.items()
        if name in findings
    )
    maps = tuple(dict.fromkeys(entry.map for entry in entries))
    return LearnerComparison(reference=reference, maps=maps, entries=entries)


def _compares_averages(finding: Finding) -> bool:
    return finding.comparison.rule == "greater" and finding.comparison.measure == "mean"


def _is_same_map(finding: Finding, factors: Mapping[str, Factors]) -> bool:
    """Return whether a finding compares two learners on the same map."""
    learner = factors[finding.comparison.a]
    reference = factors[finding.comparison.b]
    is_same_map = bool(learner.map) and learner.map == reference.map
    return is_same_map and learner.learner != reference.learner


def _select_measured_answers(condition: str, analysis: Analysis | None) -> dict[str, Answer]:
    """Return the measured answers of a condition, by their column in the table of learners."""
    condition_results = analysis.results if analysis else ()
    result = next((item for item in condition_results if item.condition == condition), None)
    if result is None:
        return {}
    answers = {column: result.answer(name) for column, name in CRITERIA_BY_COLUMN.items()}
    return {name: answer for name, answer in answers.items() if answer.verdict != NOT_MEASURED}
