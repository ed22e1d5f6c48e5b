"""Headlines and sentences on the Baldwin effect, composed from the answers of an analysis.

The criteria compare fitness with and without learning. Whether learning guides selection and
whether learned behavior becomes innate are questions of `analysis.estimands`.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from functools import cache
from itertools import chain
from pathlib import Path
from typing import Final

from baldwinlab.analysis.assays.analysis import Analysis, Answer, ConditionResult
from baldwinlab.analysis.assays.criteria import Terms
from baldwinlab.analysis.results.numbers import format_number, format_numbers
from baldwinlab.analysis.results.table import format_medians
from baldwinlab.analysis.results.verdicts import (
    EQUAL,
    NO,
    NOT_MEASURABLE,
    NOT_MEASURED,
    UNDECIDED,
    YES,
)
from baldwinlab.experiment.conditions import describe_map
from baldwinlab.papers.paper import Inference

# Words for the sign of a difference a - b.
MORE: Final = "more"
LESS: Final = "less"
SAME: Final = "the same"
NOTHING_INNATE_HEADLINE: Final = "learning raises fitness; no agent eats without learning"
TOO_FEW_RUNS_NOTE: Final = " (too few runs to establish a difference)"
TOO_FEW_RUNS_HEADLINE: Final = "too few runs for a verdict on the effect of learning on fitness"


def compose_sentences(analysis: Analysis, result: ConditionResult) -> list[str]:
    """Return one or two sentences on each measured aspect of a condition."""
    return [
        *_describe_gain(analysis, result),
        *_describe_answer(analysis, result, "learning"),
        *_describe_answer(analysis, result, "newborns"),
        *_describe_innate(analysis, result),
        *_describe_answer(analysis, result, "need"),
        *_describe_cost(result, analysis.terms),
        *_describe_selection(result),
        *_describe_modules(analysis, result),
    ]


def _describe_gain(analysis: Analysis, result: ConditionResult) -> Iterator[str]:
    gain = result.answer("gain")
    on = analysis.find_number(result.condition, "on", "last")
    off = analysis.find_number(result.condition, "off", "last")
    if gain.numbers and on and off:
        median_on, median_off = format_medians(gain.numbers)
        last_medians = " and ".join(format_numbers([on.median, off.median]))
        yield (
            f"Over all generations, the average agent {analysis.terms.eats} {median_on} with "
            f"learning on and {median_off} with learning off{_note_insignificance(gain)}. In the "
            f"last {analysis.last} generations, it {analysis.terms.eats} {last_medians}."
        )


@cache
def _load_texts() -> dict[str, dict[str, str]]:
    return tomllib.loads(Path(__file__).with_name("sentences.toml").read_text("utf-8"))


def _describe_answer(analysis: Analysis, result: ConditionResult, criterion: str) -> Iterator[str]:
    """Yield the sentence of `sentences.toml` on a criterion that is measured."""
    answer = result.answer(criterion)
    if answer.numbers:
        entry = _load_texts()[criterion]
        a, b = format_medians(answer.numbers)
        yield entry["text"].format(
            a=a,
            b=b,
            meaning=entry.get(_difference_sign(answer), _describe_undecided(answer)),
            note=_note_insignificance(answer),
            few=TOO_FEW_RUNS_NOTE if answer.has_too_few_runs else "",
            control=result.control,
            last=analysis.last,
            **analysis.terms._asdict(),
        )


def _describe_innate(analysis: Analysis, result: ConditionResult) -> Iterator[str]:
    if result.eats_only_with_learning:
        yield _explain_nothing_innate(result)
        return
    yield from _describe_answer(analysis, result, "innate")
    share = result.answer("share")
    if share.numbers:
        falls = _difference_sign(share) == LESS
        meaning = (
            " Agents gain a larger part of their fitness by learning than before." if falls else ""
        )
        percentages = [100 * share.numbers.median_a, 100 * share.numbers.median_b]
        last, first = format_numbers(percentages)
        yield (
            f"The innate share is {first} % of the fitness with learning in the first generations "
            f"and {last} % in the last{_note_insignificance(share)}.{meaning}"
        )
    yield from _describe_answer(analysis, result, "guidance")


def _explain_nothing_innate(result: ConditionResult) -> str:
    evolves_to_learn = result.answer("newborns").verdict == YES
    ability = " Evolution raises fitness with learning only." if evolves_to_learn else ""
    return (
        "With learning off, no agent ate an item in any run and any tested generation, so innate "
        "fitness cannot rise. Without learning, an agent repeats one action until it senses food, "
        f"and its path does not reach food.{ability}"
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
    meaning = _load_texts()["neutral"][answer.verdict]
    if answer.has_too_few_runs:
        meaning = "too few runs to decide the effect of selection"
    return f"{' against '.join(format_medians(answer.numbers))} ({meaning})"


def _describe_modules(analysis: Analysis, result: ConditionResult) -> Iterator[str]:
    both = analysis.find_number(result.condition, "modules", "both evolved")
    reinforcement = result.answer("reinforcement")
    action = result.answer("action")
    if both and reinforcement.numbers and action.numbers:
        improving_modules = [
            answer.criterion.id for answer in (reinforcement, action) if answer.verdict == YES
        ]
        has_too_few_runs = reinforcement.has_too_few_runs or action.has_too_few_runs
        note = TOO_FEW_RUNS_NOTE if has_too_few_runs else ""
        meaning = {
            0: "Neither evolved module alone significantly improves fitness",
            1: f"Of the two evolved modules, only the {''.join(improving_modules)} module alone "
            "improves fitness",
            2: "Each of the two evolved modules alone improves fitness",
        }
        medians = [reinforcement.numbers.median_a, action.numbers.median_a]
        texts = format_numbers([*medians, action.numbers.median_b, both.median])
        yield (
            f"{meaning[len(improving_modules)]}{note}: agents eat {texts[0]} with an evolved "
            f"reinforcement module and a random action module, {texts[1]} with a random "
            f"reinforcement module and an evolved action module, {texts[2]} with both random, and "
            f"{texts[3]} with both evolved."
        )


def _difference_sign(answer: Answer) -> str:
    """Return the sign of a significant difference in words, for either rule of a criterion."""
    if answer.numbers is None or answer.verdict == UNDECIDED:
        return UNDECIDED
    if answer.numbers.effect == 0:
        return SAME
    return MORE if answer.numbers.effect > 0 else LESS


def _describe_undecided(answer: Answer) -> str:
    if answer.has_too_few_runs:
        return "The runs are too few to establish a difference."
    return "The runs do not show a difference."


def _note_insignificance(answer: Answer) -> str:
    """Return a remark if the difference is not significant."""
    if answer.has_too_few_runs:
        return TOO_FEW_RUNS_NOTE
    return " (the difference is not significant)" if answer.verdict == UNDECIDED else ""


def describe_condition(result: ConditionResult) -> str:
    """Return "map A (evo+self-taught)", or the name of a condition without a map."""
    learner = result.factors.learner
    map_name = result.factors.map
    return f"{describe_map(map_name)} ({learner})" if map_name else result.condition


def _describe_phases(result: ConditionResult) -> str:
    """Return the verdicts of both phases in words, without a period."""
    first_phase = result.phase_verdict(1)
    second_phase = result.phase_verdict(2)
    has_no_innate_rise = second_phase in (NO, NOT_MEASURABLE)
    if first_phase == YES and has_no_innate_rise and result.eats_only_with_learning:
        return NOTHING_INNATE_HEADLINE
    has_too_few_runs = any(answer.has_too_few_runs for answer in result.answers_of_phase(1))
    headline = (
        TOO_FEW_RUNS_HEADLINE
        if first_phase == UNDECIDED and has_too_few_runs
        else _load_texts()["phase 1"][first_phase]
    )
    if first_phase != YES and second_phase in (UNDECIDED, NOT_MEASURABLE, NOT_MEASURED):
        return headline
    return headline + _load_texts()["phase 2"][second_phase]


def compose_headline(result: ConditionResult, terms: Terms) -> str:
    """Return the verdict on a condition, with the criteria that fail or were not measured."""
    text = f"{_describe_phases(result)}."
    if {result.phase_verdict(1), result.phase_verdict(2)} != {NOT_MEASURED}:
        failed = _list_questions(result, NO, 1)
        unmeasured = _list_questions(result, NOT_MEASURED, 1, 2)
        equal = _list_questions(result, EQUAL, 1)
        text += f" Answered no: {failed}" if failed else ""
        text += f" Equal in every run: {equal}" if equal else ""
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
