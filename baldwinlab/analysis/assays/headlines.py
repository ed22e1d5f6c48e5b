"""Headlines of assay reports: what was measured in each condition.

The criteria compare fitness with and without learning. Whether learning guides selection and
whether learned behavior becomes innate are questions of `analysis.estimands`.
"""

from __future__ import annotations

from itertools import chain
from typing import Final

from baldwinlab.analysis.assays.analysis import Analysis, ConditionResult
from baldwinlab.analysis.assays.criteria import NO, NOT_MEASURED, UNDECIDED, YES
from baldwinlab.analysis.assays.phrases import Terms
from baldwinlab.papers.texts import Inference

NOTHING_INNATE_HEADLINE: Final = "learning raises fitness; no agent eats without learning"
TOO_FEW_RUNS_HEADLINE: Final = "too few runs for a verdict on the effect of learning on fitness"
PHASE_1_HEADLINES: Final = {
    YES: "learning raises fitness",
    NO: "not all comparisons show that learning raises fitness",
    UNDECIDED: "undecided: the runs do not show whether learning raises fitness",
    NOT_MEASURED: "unknown: fitness with and without learning was not compared",
}
PHASE_2_ADDITIONS: Final = {
    YES: "; innate fitness and the innate share rise",
    NO: "; innate fitness or the innate share does not rise",
    UNDECIDED: "; whether innate fitness and the innate share rise is undecided",
    NOT_MEASURED: "; innate fitness over the generations was not measured",
}


def describe_condition(result: ConditionResult) -> str:
    """Return the map and the learner of a condition, or its name if it has no map."""
    learner = result.factors.learner
    map_name = result.factors.map
    return f"map {map_name} ({learner})" if map_name else result.condition


def _describe_phases(result: ConditionResult) -> str:
    """Return whether learning raises fitness, and whether innate fitness and its share rise."""
    first_phase = result.phase_verdict(1)
    second_phase = result.phase_verdict(2)
    if (first_phase, second_phase) == (YES, NO) and result.eats_only_with_learning:
        return NOTHING_INNATE_HEADLINE
    has_too_few_runs = any(answer.has_too_few_runs for answer in result.answers_of_phase(1))
    headline = (
        TOO_FEW_RUNS_HEADLINE
        if first_phase == UNDECIDED and has_too_few_runs
        else PHASE_1_HEADLINES[first_phase]
    )
    if first_phase != YES and second_phase in (UNDECIDED, NOT_MEASURED):
        return headline
    return headline + PHASE_2_ADDITIONS[second_phase]


def compose_headline(result: ConditionResult, terms: Terms) -> str:
    """Return the verdict on a condition, with the criteria that fail or were not measured."""
    text = f"{_describe_phases(result)}."
    if {result.phase_verdict(1), result.phase_verdict(2)} != {NOT_MEASURED}:
        failed = _list_questions(result, NO, 1)
        unmeasured = _list_questions(result, NOT_MEASURED, 1, 2)
        text += f" Answered no: {failed}" if failed else ""
        text += f" Not measured: {unmeasured}" if unmeasured else ""
    if result.is_lamarckian:
        text += (
            f" Agents inherit learned {terms.weights} here (Lamarckian inheritance), so a rise "
            "of innate fitness is not evidence for the Baldwin effect."
        )
    return text


def _list_questions(result: ConditionResult, verdict: str, *phases: int) -> str:
    answers = chain.from_iterable(result.answers_of_phase(phase) for phase in phases)
    return " ".join(answer.criterion.question for answer in answers if answer.verdict == verdict)


def compare_with_paper(analysis: Analysis, inference: Inference) -> str:
    """Return how the inference of a paper compares with the analysis."""
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
    for verdict, verb in ((YES, "rise"), (NO, "do not both rise")):
        names = [
            result.condition for result in analysis.results if result.phase_verdict(2) == verdict
        ]
        if names:
            sentences.append(
                f"Innate fitness and the innate share {verb} in {' and '.join(names)}."
            )
    return " ".join(filter(None, sentences))
