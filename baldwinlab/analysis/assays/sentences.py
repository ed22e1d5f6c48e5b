"""Sentences on the Baldwin effect, composed from the answers of an analysis."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from baldwinlab.analysis.assays.analysis import Analysis, Answer, ConditionResult
from baldwinlab.analysis.assays.criteria import NO, UNDECIDED, YES
from baldwinlab.analysis.assays.phrases import Terms
from baldwinlab.analysis.statistics.numbers import format_number

# Signs of a difference.
MORE: Final = "more"
LESS: Final = "less"
SAME: Final = "the same"


def compose_sentences(analysis: Analysis, result: ConditionResult) -> list[str]:
    """Return one or two sentences on each measured part of a condition."""
    return [
        *_describe_gain(analysis, result),
        *_describe_drift(result),
        *_describe_newborns(result),
        *_describe_innate(analysis, result),
        *_describe_gain_change(result),
        *_describe_cost(result, analysis.terms),
        *_describe_selection(result),
        *_describe_modules(analysis, result),
    ]


def _describe_gain(analysis: Analysis, result: ConditionResult) -> Iterator[str]:
    gain = result.answer("gain")
    on = analysis.find_number(result.condition, "on", "last")
    off = analysis.find_number(result.condition, "off", "last")
    if gain.numbers and on and off:
        yield (
            f"Over all generations, the average agent {analysis.terms.eats} "
            f"{format_number(gain.numbers.median_a)} with learning on and "
            f"{format_number(gain.numbers.median_b)} with learning off"
            f"{_note_insignificance(gain)}. In the last {analysis.last} generations, it "
            f"{analysis.terms.eats} "
            f"{format_number(on.median)} and {format_number(off.median)}."
        )


def _describe_drift(result: ConditionResult) -> Iterator[str]:
    drift = result.answer("learning")
    if drift.numbers:
        meaning = {
            YES: "Learning helps more than random changes.",
            NO: "Random changes help as much as learning.",
            UNDECIDED: "The runs do not show a difference.",
        }
        yield (
            "With random weight changes instead of learning (drift), it eats "
            f"{format_number(drift.numbers.median_b)}; in the same generations it eats "
            f"{format_number(drift.numbers.median_a)} with learning. {meaning[drift.verdict]}"
        )


def _describe_newborns(result: ConditionResult) -> Iterator[str]:
    newborns = result.answer("newborns")
    if newborns.numbers:
        yield (
            "In their lifetime, newborns of the last generation eat "
            f"{format_number(newborns.numbers.median_a)}, and random genomes that also learn eat "
            f"{format_number(newborns.numbers.median_b)}{_note_insignificance(newborns)}."
        )


def _describe_innate(analysis: Analysis, result: ConditionResult) -> Iterator[str]:
    if result.eats_only_with_learning:
        yield _explain_nothing_innate(result)
        return
    innate = result.answer("innate")
    if innate.numbers:
        yield (
            f"With learning off, agents {analysis.terms.eat} "
            f"{format_number(innate.numbers.median_b)} in the first {analysis.last} generations "
            f"and {format_number(innate.numbers.median_a)} in the last"
            f"{_note_insignificance(innate)}."
        )
    share = result.answer("share")
    if share.numbers:
        falls = _difference_sign(share) == LESS
        meaning = (
            " Agents gain a larger part of their fitness by learning than before." if falls else ""
        )
        yield (
            "The innate share is "
            f"{format_number(100 * share.numbers.median_b)} % of the fitness with learning in the "
            f"first generations and {format_number(100 * share.numbers.median_a)} % in the "
            f"last{_note_insignificance(share)}.{meaning}"
        )
    yield from _describe_guidance(result, analysis.terms)


def _explain_nothing_innate(result: ConditionResult) -> str:
    evolves_to_learn = result.answer("newborns").verdict == YES
    ability = " Evolution raises fitness with learning only." if evolves_to_learn else ""
    return (
        "With learning off, no agent ate an item in any run and any tested generation, so innate "
        "fitness cannot rise. Without learning, an agent repeats one action until it senses food, "
        f"and its path does not reach food.{ability}"
    )


def _describe_guidance(result: ConditionResult, terms: Terms) -> Iterator[str]:
    guidance = result.answer("guidance")
    if guidance.numbers:
        meaning = {
            MORE: "Innate fitness is higher after evolution with learning than without.",
            LESS: "Innate fitness is lower after evolution with learning than without. This "
            "comparison does not show why: the assay fork separates relaxed selection from worse "
            "genomes.",
            SAME: "Both are the same.",
            UNDECIDED: "The runs do not show a difference.",
        }
        yield (
            f"With learning off, agents of the last generations {terms.eat} "
            f"{format_number(guidance.numbers.median_a)}; agents of the no-learning control "
            f"({result.control}) {terms.eat} {format_number(guidance.numbers.median_b)}. "
            f"{meaning[_difference_sign(guidance)]}"
        )


def _describe_gain_change(result: ConditionResult) -> Iterator[str]:
    change = result.answer("need")
    if change.numbers:
        verb = {
            MORE: "rises",
            LESS: "falls",
            SAME: "does not change",
            UNDECIDED: "does not change significantly",
        }
        yield (
            f"The gain from learning {verb[_difference_sign(change)]}: "
            f"{format_number(change.numbers.median_b)} in the first generations, "
            f"{format_number(change.numbers.median_a)} in the last."
        )


def _describe_cost(result: ConditionResult, terms: Terms) -> Iterator[str]:
    cost = result.answer("cost")
    if cost.numbers and _difference_sign(cost) == MORE:
        yield (
            f"Learning has a cost of {format_number(cost.numbers.effect)}: agents {terms.eat} "
            f"this much more if they are born with their {terms.weights} at death."
        )
    if cost.numbers and _difference_sign(cost) == LESS:
        yield (
            f"Agents that are born with their {terms.weights} at death and do not learn "
            f"{terms.eat} only {format_number(cost.numbers.median_a)}. These {terms.weights} do "
            "not suffice: agents must learn during their lifetime."
        )


def _describe_selection(result: ConditionResult) -> Iterator[str]:
    innate = result.answer("built-innate")
    learned = result.answer("built-learned")
    if innate.numbers and learned.numbers:
        yield (
            "Compared with the neutral control, whose parents are chosen at random, innate fitness "
            f"is {_compare_with_neutral(innate)}, and the gain from learning is "
            f"{_compare_with_neutral(learned)}."
        )


def _compare_with_neutral(answer: Answer) -> str:
    if answer.numbers is None:
        return ""
    meaning = {
        YES: "selection increases it",
        NO: "selection does not increase it",
        UNDECIDED: "the effect of selection is undecided",
    }
    return (
        f"{format_number(answer.numbers.median_a)} against "
        f"{format_number(answer.numbers.median_b)} ({meaning[answer.verdict]})"
    )


def _describe_modules(analysis: Analysis, result: ConditionResult) -> Iterator[str]:
    both = analysis.find_number(result.condition, "modules", "both evolved")
    reinforcement = result.answer("reinforcement")
    action = result.answer("action")
    if both and reinforcement.numbers and action.numbers:
        improving_modules = [
            answer.criterion.id for answer in (reinforcement, action) if answer.verdict == YES
        ]
        meaning = {
            0: "Neither evolved module alone significantly improves fitness",
            1: f"Of the two evolved modules, only the {''.join(improving_modules)} module alone "
            "improves fitness",
            2: "Each of the two evolved modules alone improves fitness",
        }
        yield (
            f"{meaning[len(improving_modules)]}: agents eat "
            f"{format_number(reinforcement.numbers.median_a)} with an evolved reinforcement module "
            f"and a random action module, {format_number(action.numbers.median_a)} with a random "
            "reinforcement module and an evolved action module, "
            f"{format_number(action.numbers.median_b)} with both random, and "
            f"{format_number(both.median)} with both evolved."
        )


def _difference_sign(answer: Answer) -> str:
    """Return the sign of the difference, whatever the criterion asks for."""
    if answer.numbers is None or answer.verdict == UNDECIDED:
        return UNDECIDED
    if answer.numbers.effect == 0:
        return SAME
    return MORE if answer.numbers.effect > 0 else LESS


def _note_insignificance(answer: Answer) -> str:
    """Return a remark if the difference is not significant."""
    if answer.has_too_few_runs:
        return " (too few runs to establish a difference)"
    return " (the difference is not significant)" if answer.verdict == UNDECIDED else ""
