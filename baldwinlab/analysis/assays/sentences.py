"""Sentences on the Baldwin effect, composed from the answers of an analysis."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Final

from baldwinlab.analysis.assays.analysis import Analysis, Answer, ConditionResult
from baldwinlab.analysis.assays.criteria import NO, NOT_MEASURED, UNDECIDED, YES
from baldwinlab.analysis.report.phrases import format_number
from baldwinlab.papers.texts import Inference

# Signs of a difference.
MORE: Final = "more"
LESS: Final = "less"
SAME: Final = "the same"

BOTH_PHASES: Final = (
    "both phases of the Baldwin effect: learning guides evolution (phase 1), and learned behavior "
    "becomes innate (phase 2)"
)
PHASE_1_ALONE: Final = (
    "only phase 1 of the Baldwin effect: learning guides evolution, but learned behavior does not "
    "become innate"
)
HEADLINES: Final[Mapping[tuple[str, str], str]] = {
    (YES, YES): BOTH_PHASES,
    (YES, NO): PHASE_1_ALONE,
    (YES, UNDECIDED): "phase 1 of the Baldwin effect: learning guides evolution; phase 2 is "
    "undecided",
    (YES, NOT_MEASURED): "phase 1 of the Baldwin effect: learning guides evolution; phase 2 was "
    "not measured",
}
NOTHING_INNATE: Final = (
    "only phase 1 of the Baldwin effect: learning guides evolution, but nothing becomes innate, "
    "because no agent eats without learning"
)
TOO_FEW_FOR_PHASE_1: Final = "too few runs for a verdict on phase 1 of the Baldwin effect"
PHASE_1: Final = {
    NO: "no Baldwin effect: learning does not guide evolution",
    UNDECIDED: "undecided: the runs do not show whether learning guides evolution",
    NOT_MEASURED: "unknown: phase 1 of the Baldwin effect was not measured",
}
PHASE_2: Final = {
    YES: "; but innate fitness and the innate share rise",
    NO: "; learned behavior does not become innate",
}


def describe_condition(result: ConditionResult) -> str:
    """Return the map and the learner of a condition, or its name if it has no map."""
    learner = result.factors.learner
    map_name = result.factors.map
    return f"map {map_name} ({learner})" if map_name else result.condition


def describe_phases(result: ConditionResult) -> str:
    """Return which phases of the Baldwin effect a condition reaches."""
    first = result.phase_verdict(1)
    second = result.phase_verdict(2)
    if (first, second) == (YES, NO) and result.eats_only_with_learning:
        return NOTHING_INNATE
    if (first, second) in HEADLINES:
        return HEADLINES[first, second]
    has_too_few = any(answer.has_too_few_runs for answer in result.answers_of_phase(1))
    headline = TOO_FEW_FOR_PHASE_1 if first == UNDECIDED and has_too_few else PHASE_1[first]
    return headline + PHASE_2.get(second, "")


def compose_headline(result: ConditionResult) -> str:
    """Return the verdict on a condition, with the criteria that fail or were not measured."""
    text = f"{describe_phases(result)}."
    if {result.phase_verdict(1), result.phase_verdict(2)} != {NOT_MEASURED}:
        failed = _list_questions(result, NO, 1)
        unmeasured = _list_questions(result, NOT_MEASURED, 1, 2)
        text += f" Answered no: {failed}" if failed else ""
        text += f" Not measured: {unmeasured}" if unmeasured else ""
    if result.is_lamarckian:
        text += (
            " Agents inherit learned weights here (Lamarckian inheritance), so a rise of innate "
            "fitness is not evidence for the Baldwin effect."
        )
    return text


def _list_questions(result: ConditionResult, verdict: str, *phases: int) -> str:
    questions = [
        answer.criterion.question
        for phase in phases
        for answer in result.answers_of_phase(phase)
        if answer.verdict == verdict
    ]
    return " ".join(questions)


def compare_with_paper(analysis: Analysis, inference: Inference) -> str:
    """Return how the inference of a paper compares with the analysis.

    Parameters
    ----------
    analysis : Analysis
        The analysis.
    inference : Inference
        The comparison from which the paper infers the Baldwin effect.

    Returns
    -------
    str
        Sentences.
    """
    verdicts = {
        result.condition: result.answer(inference.question).verdict for result in analysis.results
    }
    sentences = [inference.text]
    opposed = [condition for condition, verdict in verdicts.items() if verdict == NO]
    if set(verdicts.values()) == {YES}:
        sentences.append("This study confirms that comparison.")
    elif opposed:
        sentences.append(f"This study contradicts that comparison in {', '.join(opposed)}.")
    sentences.append(inference.limit)
    for verdict, answer in ((YES, "it does"), (NO, "it does not")):
        names = [
            result.condition for result in analysis.results if result.phase_verdict(2) == verdict
        ]
        if names:
            sentences.append(f"Measured directly, {answer} in {' and '.join(names)}.")
    return " ".join(filter(None, sentences))


def compose_sentences(analysis: Analysis, result: ConditionResult) -> list[str]:
    """Return one or two sentences on each measured part of a condition.

    Parameters
    ----------
    analysis : Analysis
        The analysis.
    result : ConditionResult
        A condition of the analysis.

    Returns
    -------
    list of str
        Sentences.
    """
    return [
        *_describe_gain(analysis, result),
        *_describe_drift(result),
        *_describe_newborns(result),
        *_describe_innate(result, analysis.last),
        *_describe_change(result),
        *_describe_cost(result),
        *_describe_selection(result),
        *_describe_modules(analysis, result),
    ]


def _describe_gain(analysis: Analysis, result: ConditionResult) -> Iterator[str]:
    gain = result.answer("gain")
    on = analysis.find_number(result.condition, "on", "last")
    off = analysis.find_number(result.condition, "off", "last")
    if gain.numbers and on and off:
        yield (
            "Over all generations, the average agent eats "
            f"{format_number(gain.numbers.median_a)} with learning on and "
            f"{format_number(gain.numbers.median_b)} with learning off{_describe_doubt(gain)}. "
            f"In the last {analysis.last} generations, it eats {format_number(on.median)} and "
            f"{format_number(off.median)}."
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
            f"{format_number(newborns.numbers.median_b)}{_describe_doubt(newborns)}."
        )


def _describe_innate(result: ConditionResult, last: int) -> Iterator[str]:
    if result.eats_only_with_learning:
        yield _explain_nothing_innate(result)
        return
    innate = result.answer("innate")
    if innate.numbers:
        yield (
            "With learning off, agents eat "
            f"{format_number(innate.numbers.median_b)} in the first {last} generations and "
            f"{format_number(innate.numbers.median_a)} in the last{_describe_doubt(innate)}."
        )
    share = result.answer("share")
    if share.numbers:
        falls = _direction(share) == LESS
        meaning = (
            " This is the opposite of genetic assimilation: agents rely more on learning."
            if falls
            else ""
        )
        yield (
            "The innate share is "
            f"{format_number(100 * share.numbers.median_b)} % of the fitness with learning in the "
            f"first generations and {format_number(100 * share.numbers.median_a)} % in the "
            f"last{_describe_doubt(share)}.{meaning}"
        )
    yield from _describe_guidance(result)


def _explain_nothing_innate(result: ConditionResult) -> str:
    evolves_to_learn = result.answer("newborns").verdict == YES
    ability = (
        " Evolution improves the ability to learn, not innate behavior." if evolves_to_learn else ""
    )
    return (
        "With learning off, no agent ate an item in any run and any tested generation, so innate "
        "fitness cannot rise. Without learning, an agent repeats one action until it senses food, "
        f"and its path does not reach food.{ability}"
    )


def _describe_guidance(result: ConditionResult) -> Iterator[str]:
    guidance = result.answer("guidance")
    if guidance.numbers:
        meaning = {
            MORE: "Evolution with learning produces better innate behavior than evolution without.",
            LESS: "Evolution with learning produces worse innate behavior than evolution without: "
            "learning hides innate differences from selection (hiding effect).",
            SAME: "Both are the same.",
            UNDECIDED: "The runs do not show a difference.",
        }
        yield (
            "With learning off, agents of the last generations eat "
            f"{format_number(guidance.numbers.median_a)}; agents of the no-learning control "
            f"({result.control}) eat {format_number(guidance.numbers.median_b)}. "
            f"{meaning[_direction(guidance)]}"
        )


def _describe_change(result: ConditionResult) -> Iterator[str]:
    change = result.answer("need")
    if change.numbers:
        verb = {
            MORE: "rises",
            LESS: "falls",
            SAME: "does not change",
            UNDECIDED: "does not change significantly",
        }
        yield (
            f"The gain from learning {verb[_direction(change)]}: "
            f"{format_number(change.numbers.median_b)} in the first generations, "
            f"{format_number(change.numbers.median_a)} in the last."
        )


def _describe_cost(result: ConditionResult) -> Iterator[str]:
    cost = result.answer("cost")
    if cost.numbers and _direction(cost) == MORE:
        yield (
            f"Learning has a cost of {format_number(cost.numbers.effect)}: agents eat this much "
            "more if they are born with their weights at death."
        )
    if cost.numbers and _direction(cost) == LESS:
        yield (
            "Agents that are born with their weights at death and do not learn eat only "
            f"{format_number(cost.numbers.median_a)}. These weights do not suffice: agents must "
            "learn during their lifetime."
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
        improving = [
            answer.criterion.id for answer in (reinforcement, action) if answer.verdict == YES
        ]
        meaning = {
            0: "Neither evolved module alone significantly improves fitness",
            1: f"Of the two evolved modules, only the {''.join(improving)} module alone improves "
            "fitness",
            2: "Each of the two evolved modules alone improves fitness",
        }
        yield (
            f"{meaning[len(improving)]}: agents eat "
            f"{format_number(reinforcement.numbers.median_a)} with an evolved reinforcement module "
            f"and a random action module, {format_number(action.numbers.median_a)} with a random "
            "reinforcement module and an evolved action module, "
            f"{format_number(action.numbers.median_b)} with both random, and "
            f"{format_number(both.median)} with both evolved."
        )


def _direction(answer: Answer) -> str:
    """Return the sign of the difference, whatever the criterion asks for."""
    if answer.numbers is None or answer.verdict == UNDECIDED:
        return UNDECIDED
    if answer.numbers.effect == 0:
        return SAME
    return MORE if answer.numbers.effect > 0 else LESS


def _describe_doubt(answer: Answer) -> str:
    """Return a remark if the difference is not significant."""
    if answer.has_too_few_runs:
        return " (too few runs to establish a difference)"
    return " (the difference is not significant)" if answer.verdict == UNDECIDED else ""
