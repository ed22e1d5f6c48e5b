"""Headlines of assay reports: the verdict of each condition."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import chain
from typing import Final

from baldwinlab.analysis.assays.analysis import Analysis, ConditionResult
from baldwinlab.analysis.assays.criteria import NO, NOT_MEASURED, UNDECIDED, YES
from baldwinlab.papers.texts import Inference

PHASE_1_ALONE_HEADLINE: Final = (
    "only phase 1 of the Baldwin effect: learning guides evolution, but learned behavior does not "
    "become innate"
)
NOTHING_INNATE_HEADLINE: Final = (
    "only phase 1 of the Baldwin effect: learning guides evolution, but nothing becomes innate, "
    "because no agent eats without learning"
)
TOO_FEW_RUNS_HEADLINE: Final = "too few runs for a verdict on phase 1 of the Baldwin effect"
PHASE_1_HEADLINES: Final = {
    NO: "no Baldwin effect: learning does not guide evolution",
    UNDECIDED: "undecided: the runs do not show whether learning guides evolution",
    NOT_MEASURED: "unknown: phase 1 of the Baldwin effect was not measured",
}
PHASE_2_ADDITIONS: Final = {
    YES: "; but innate fitness and the innate share rise",
    NO: "; learned behavior does not become innate",
}
BOTH_PHASES_HEADLINE: Final = (
    "both phases of the Baldwin effect: learning guides evolution (phase 1), and learned behavior "
    "becomes innate (phase 2)"
)
HEADLINES: Final[Mapping[tuple[str, str], str]] = {
    (YES, YES): BOTH_PHASES_HEADLINE,
    (YES, NO): PHASE_1_ALONE_HEADLINE,
    (YES, UNDECIDED): "phase 1 of the Baldwin effect: learning guides evolution; phase 2 is "
    "undecided",
    (YES, NOT_MEASURED): "phase 1 of the Baldwin effect: learning guides evolution; phase 2 was "
    "not measured",
}


def describe_condition(result: ConditionResult) -> str:
    """Return the map and the learner of a condition, or its name if it has no map."""
    learner = result.factors.learner
    map_name = result.factors.map
    return f"map {map_name} ({learner})" if map_name else result.condition


def describe_phases(result: ConditionResult) -> str:
    """Return which phases of the Baldwin effect a condition reaches."""
    first_phase = result.phase_verdict(1)
    second_phase = result.phase_verdict(2)
    if (first_phase, second_phase) == (YES, NO) and result.eats_only_with_learning:
        return NOTHING_INNATE_HEADLINE
    if (first_phase, second_phase) in HEADLINES:
        return HEADLINES[first_phase, second_phase]
    has_too_few_runs = any(answer.has_too_few_runs for answer in result.answers_of_phase(1))
    headline = (
        TOO_FEW_RUNS_HEADLINE
        if first_phase == UNDECIDED and has_too_few_runs
        else PHASE_1_HEADLINES[first_phase]
    )
    return headline + PHASE_2_ADDITIONS.get(second_phase, "")


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
    answers = chain.from_iterable(result.answers_of_phase(phase) for phase in phases)
    return " ".join(answer.criterion.question for answer in answers if answer.verdict == verdict)


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
