"""Sentences about the comparisons of a study, for readers who do not know its conditions.

For example "Agents that learn eat 15.8 more items than agents that do not on map A [2.88, 44.6],
and 2.27 more on map B [1.68, 9.22]". The numbers are differences of medians over runs, and the
sentences are the same in reports, the lab and terminals.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import isnan
from typing import Final

from baldwinlab.analysis.results.contrasts import Contrast, Contrasts
from baldwinlab.analysis.results.numbers import format_numbers, join_names
from baldwinlab.analysis.results.verdicts import HIGHER, LOWER, TOO_FEW_RUNS, UNDECIDED
from baldwinlab.experiment.conditions import describe_map
from baldwinlab.experiment.outcome import ITEMS

# Measure of the sentences: the average agent.
SUMMARY_MEASURE: Final = "mean"
# Largest number of pairs of learners with a sentence of their own.
MAX_SENTENCES: Final = 3
LEARNERS: Final = ("agents that learn", "agents that do not learn")


def summarize_contrasts(contrasts: Contrasts) -> list[str]:
    """Return sentences on the average agent: one per pair of learners, with all of its maps.

    The largest decided effect is first. Without a decision, or with more pairs than sentences, the
    number of each verdict is before it.
    """
    rows = [row for row in contrasts.rows if row.measure == SUMMARY_MEASURE]
    groups: dict[tuple[str, str], list[Contrast]] = {}
    for row in rows:
        groups.setdefault(_name_pair(contrasts, row), []).append(row)
    pairs = sorted(groups.items(), key=lambda entry: -_measure_decided(entry[1]))
    decided = [entry for entry in pairs if any(row.is_decided for row in entry[1])]
    has_count = len(pairs) > MAX_SENTENCES or (len(pairs) > 1 and not decided)
    shown = decided[:MAX_SENTENCES] if has_count else pairs
    sentences = [_describe_pair(contrasts, *names, pair) for names, pair in shown]
    return [_count_verdicts(rows), *sentences] if has_count else sentences


def name_learners(contrasts: Contrasts) -> dict[str, str]:
    """Return both learners of a study in words, by name; {} if they do not differ in learning.

    For example {"evo+self-taught": "agents that learn", "evo": "agents that do not learn"}.
    """
    pairs = {_name_pair(contrasts, row): row for row in contrasts.rows}
    if len(pairs) != 1:
        return {}
    ((pair, row),) = pairs.items()
    learns = [contrasts.learns.get(name) for name in (row.condition, row.reference)]
    return dict(zip(pair, LEARNERS, strict=True)) if learns == [True, False] else {}


def describe_statistic(contrasts: Contrasts) -> str:
    """Return what the numbers of the sentences are, or "" without a comparison."""
    if not contrasts.rows:
        return ""
    sizes = sorted({size for row in contrasts.rows for size in (row.numbers.n_a, row.numbers.n_b)})
    runs = " to ".join(str(size) for size in dict.fromkeys((sizes[0], sizes[-1])))
    return (
        f"Differences of medians over {runs} runs per condition, with 95 % intervals; average "
        f"agent, last {contrasts.last} generations."
    )


def _measure_decided(rows: Sequence[Contrast]) -> float:
    """Return the largest absolute effect with a decision, or 0."""
    return max((abs(row.numbers.effect) for row in rows if row.is_decided), default=0.0)


def _name_pair(contrasts: Contrasts, row: Contrast) -> tuple[str, str]:
    """Return the names of the compared agents: without the map if both conditions share it."""
    condition, reference = contrasts.factors[row.condition], contrasts.factors[row.reference]
    if condition.place == reference.place:
        has_map = condition.learner and condition.map
        return (condition.learner, reference.learner) if has_map else (row.condition, row.reference)
    return (
        _name_with_map(row.condition, condition.map),
        _name_with_map(row.reference, reference.map),
    )


def _name_with_map(condition: str, map_name: str) -> str:
    return f"{condition} on {describe_map(map_name)}" if map_name else condition


def _describe_pair(
    contrasts: Contrasts, learner: str, reference: str, rows: Sequence[Contrast]
) -> str:
    """Return the verdicts on two learners on all of their maps, as one sentence."""
    subject, other = _name_agents(learner), _name_agents(reference)
    if names := name_learners(contrasts):
        # A sentence does not repeat the verb: "agents that learn eat more than agents that do not".
        subject, other = names[learner], names[reference].removesuffix(" learn")

    def locate(row: Contrast) -> str:
        levels = contrasts.factors[row.condition]
        # Without a common map, `learner` is not the learner of the condition.
        has_map = bool(levels.map) and learner == levels.learner
        place = f" on {describe_map(levels.map)}" if has_map else ""
        return f"{place}{_format_interval(row)}"

    clauses = []
    if decided := [row for row in rows if row.is_decided]:
        clauses.append(_describe_decided(subject, other, decided, locate))
    for verdict, opening, pronoun in (
        (UNDECIDED, "it is undecided whether {} differ", "they"),
        (TOO_FEW_RUNS, "the runs are too few to compare {}", "them"),
    ):
        if same := [row for row in rows if row.verdict == verdict]:
            text = opening.format(pronoun if clauses else f"{subject} and {other}")
            outcome = "" if clauses else f" in {rows[0].outcome}"
            clauses.append(f"{text}{outcome}{' and'.join(map(locate, same))}")
    sentence = "; ".join(clauses)
    return f"{sentence[:1].upper()}{sentence[1:]}."


def _describe_decided(
    subject: str, other: str, rows: Sequence[Contrast], locate: Callable[[Contrast], str]
) -> str:
    """Return, for example, "agents that learn eat 3 more items than agents that do not [2, 4]"."""
    first, *further = rows
    outcome = first.outcome
    if outcome == ITEMS:
        words = ("more", "fewer")
        text = f"{subject} eat {_compare(first, *words)} items than {other}"
    else:
        words = ("higher", "lower")
        text = f"the {outcome} of {subject} is {_compare(first, *words)} than that of {other}"
    parts = [f"{_compare(row, *words)}{locate(row)}" for row in further]
    return f"{text}{locate(first)}{', and ' if parts else ''}{join_names(parts)}"


def _compare(row: Contrast, more: str, fewer: str) -> str:
    return f"{_format_effect(row)[0]} {more if row.numbers.effect > 0 else fewer}"


def _format_interval(row: Contrast) -> str:
    _, low, high = _format_effect(row)
    return "" if isnan(row.numbers.low) else f" [{low}, {high}]"


def _format_effect(row: Contrast) -> list[str]:
    """Return the size of an effect and its interval as texts."""
    return format_numbers([abs(row.numbers.effect), row.numbers.low, row.numbers.high])


def _name_agents(condition: str) -> str:
    """Return the agents of a condition, or of a point of a sweep, such as "x = 1"."""
    return f"agents {'with' if ' = ' in condition else 'of'} {condition}"


def _count_verdicts(rows: Sequence[Contrast]) -> str:
    """Return how many conditions are higher, lower and undecided."""
    verdicts = [row.verdict for row in rows]
    counts = [
        f"{verdicts.count(verdict)} {verdict}"
        for verdict in (HIGHER, LOWER, UNDECIDED, TOO_FEW_RUNS)
        if verdict in verdicts
    ]
    references = {row.reference for row in rows}
    reference = references.pop() if len(references) == 1 else "the first in their world"
    return (
        f"{len(rows)} conditions compared with {reference} in {rows[0].outcome}: "
        f"{', '.join(counts)}."
    )
