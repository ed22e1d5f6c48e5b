"""Report of a comparison of learners: sentences, a table and a data file."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from baldwinlab.analysis.assays.criteria import NO, YES
from baldwinlab.analysis.assays.learner_comparison import (
    CRITERIA_BY_COLUMN,
    LearnerComparison,
    LearnerOnMap,
    MapsByLearner,
)
from baldwinlab.analysis.report.sections import ReportSummary, render
from baldwinlab.analysis.statistics.csv import to_csv
from baldwinlab.analysis.statistics.numbers import format_signed
from baldwinlab.analysis.statistics.rules import FAILS, HOLDS
from baldwinlab.core.file_writing import write_atomically, write_json


def make_summary(comparison: LearnerComparison, directory: Path) -> ReportSummary:
    """Make the sentences and the table at the top of a report.

    Writes `learners.json` and `figures/learners.csv`.

    Parameters
    ----------
    comparison : LearnerComparison
        The comparison.
    directory : Path
        Directory of the study.

    Returns
    -------
    ReportSummary
        Sentences and a table.

    Raises
    ------
    OSError
        A file cannot be written.
    """
    _write_comparison(comparison, directory)
    table = render(
        "assays/learner_comparison.html", comparison=comparison, rows=_make_table_rows(comparison)
    )
    return ReportSummary(_compose_sentences(comparison), table)


def _compose_sentences(comparison: LearnerComparison) -> list[str]:
    return [
        _describe_success(comparison),
        " ".join(_describe_innate(comparison)),
        " ".join(_describe_costs(comparison)),
    ]


def _describe_success(comparison: LearnerComparison) -> str:
    count = f"{len(comparison.successful_learners)} of {len(comparison.learners)} learners"
    if comparison.maps_without_food:
        maps = _list_maps(comparison.maps_without_food)
        names = _list_learners(comparison.successful_learners, comparison.maps_without_food)
        return (
            f"{count} find food on {maps}, where evolution alone ({comparison.reference}) finds "
            f"none: {names}."
        )
    return (
        f"{count} eat more than evolution alone ({comparison.reference}) on at least one map: "
        f"{_list_learners(comparison.successful_learners)}."
    )


def _describe_innate(comparison: LearnerComparison) -> Iterator[str]:
    if "innate" not in comparison.measured_criteria:
        yield (
            "The study has no measurement of innate fitness. Run the assay neutral to compare it "
            "with the neutral control."
        )
        return
    control = "than their neutral control, whose parents are chosen at random"
    if comparison.innate_with_gain:
        yield (
            "Of the learners that eat more than evolution alone, these also eat more with learning "
            f"off {control}: {_list_learners(comparison.innate_with_gain)}."
        )
    else:
        yield (
            "No learner that eats more than evolution alone eats significantly more with learning "
            f"off {control}."
        )
    if comparison.innate_without_gain:
        yield (
            "Newborns also eat more than their neutral control in "
            f"{_list_learners(comparison.innate_without_gain)}, which do not eat more than "
            "evolution alone."
        )


def _describe_costs(comparison: LearnerComparison) -> Iterator[str]:
    worse = comparison.worse_learners
    if worse:
        maps = [
            map_name
            for map_name in comparison.maps
            if any(map_name in names for names in worse.values())
        ]
        yield (
            f"On {_list_maps(maps)}, these learners eat less than evolution alone: "
            f"{_list_learners(worse, maps)}."
        )
    else:
        yield "No learner eats significantly less than evolution alone."
    if "cost" in comparison.measured_criteria:
        yield (
            "These learners eat more if they are born with their weights at death: "
            f"{_list_learners(comparison.learning_costs)}."
        )


def _list_learners(learners: MapsByLearner, named_maps: Sequence[str] = ()) -> str:
    """Return the learners with their maps. Maps are omitted if all learners have `named_maps`."""
    are_named = all(list(maps) == list(named_maps) for maps in learners.values())
    names = [
        name if are_named else f"{name} ({', '.join(maps)})" for name, maps in learners.items()
    ]
    return ", ".join(names) or "none"


def _list_maps(maps: Sequence[str]) -> str:
    *preceding, last = maps
    return f"maps {', '.join(preceding)} and {last}" if preceding else f"map {last}"


class LearnerRow(NamedTuple):
    """Maps on which a learner differs significantly from its reference, with the effects."""

    learner: str
    more: str
    less: str
    innate: str
    learned: str
    cost: str


def _make_table_rows(comparison: LearnerComparison) -> list[LearnerRow]:
    rows = []
    for learner in comparison.learners:
        entries = [entry for entry in comparison.entries if entry.learner == learner]
        more = [entry.map for entry in entries if entry.finding.verdict == HOLDS]
        less = {
            entry.map: entry.finding.numbers.effect
            for entry in entries
            if entry.finding.verdict == FAILS
        }
        effects = {
            name: _list_effects(_select_significant_effects(entries, name))
            for name in CRITERIA_BY_COLUMN
        }
        rows.append(
            LearnerRow(
                learner=learner,
                more=", ".join(more),
                less=_list_effects(less),
                innate=effects["innate"],
                learned=effects["learned"],
                cost=effects["cost"],
            )
        )
    return rows


def _select_significant_effects(entries: Sequence[LearnerOnMap], name: str) -> dict[str, float]:
    """Return the effects of a criterion by map, without effects that are undecided or 0."""
    effects = {}
    for entry in entries:
        if entry.has_answer(name, YES, NO):
            numbers = entry.answers[name].numbers
            if numbers and numbers.effect:
                effects[entry.map] = numbers.effect
    return effects


def _list_effects(effects: Mapping[str, float]) -> str:
    return ", ".join(
        f"{map_name}\N{NO-BREAK SPACE}{format_signed(effect)}"
        for map_name, effect in effects.items()
    )


def _write_comparison(comparison: LearnerComparison, directory: Path) -> None:
    """Write the comparison as JSON and CSV, each atomically."""
    rows = [entry.record() for entry in comparison.entries]
    record = {
        "reference": comparison.reference,
        "maps": comparison.maps,
        "maps_without_food": comparison.maps_without_food,
        "successful": comparison.successful_learners,
        "innate_with_gain": comparison.innate_with_gain,
        "innate_without_gain": comparison.innate_without_gain,
        "worse": comparison.worse_learners,
        "learning_costs": comparison.learning_costs,
        "learners": rows,
    }
    write_json(directory / "learners.json", record)
    write_atomically(directory / "figures" / "learners.csv", to_csv(list(rows[0]), rows))
