"""Whether it is the Baldwin effect, in words: sentences composed from what was found, whatever that is."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from baldwinlab.analysis.assays.analysis import (
    NO,
    NOT_MEASURED,
    UNDECIDED,
    YES,
    Analysis,
    Answer,
    Subject,
)
from baldwinlab.analysis.report.phrases import number
from baldwinlab.papers.texts import Inference

MORE, LESS, SAME = "more", "less", "the same"

HEADLINES: Mapping[tuple[str, str], str] = {
    (
        YES,
        YES,
    ): "the Baldwin effect in both its phases: learning guides selection, and what was learned becomes innate",
    (
        YES,
        NO,
    ): "only its first phase: learning guides selection, but what is learned does not become innate",
    (
        YES,
        UNDECIDED,
    ): "its first phase, in which learning guides selection; whether what is learned becomes innate is undecided",
    (
        YES,
        NOT_MEASURED,
    ): "its first phase, in which learning guides selection; whether what is learned becomes innate was not "
    "measured",
}
NOTHING_TO_ASSIMILATE = (
    "only its first phase: learning guides selection, but nothing becomes innate, because nobody eats without learning: what "
    "evolves is the ability to learn"
)
TOO_FEW_FOR_PHASE_ONE = "too few runs: no verdict on whether learning guides selection is possible"
FIRST_PHASE = {
    NO: "no Baldwin effect: learning does not guide selection",
    UNDECIDED: "undecided: the runs do not tell whether learning guides selection",
    NOT_MEASURED: "not known: whether learning guides selection was not measured",
}
SECOND_PHASE = {
    YES: "; but what agents eat without learning rises, and so does its share",
    NO: "; nor does anything become innate",
}


def where(subject: Subject) -> str:
    """The condition in words: by its map, if it has one."""
    learner, map_name = subject.factors.learner, subject.factors.map
    return f"map {map_name} ({learner})" if map_name else subject.condition


def phases(subject: Subject) -> str:
    """Which phases of the effect it reached, in words."""
    first, second = subject.phase(1), subject.phase(2)
    if (first, second) == (YES, NO) and subject.without_learning_nobody_ate:
        return NOTHING_TO_ASSIMILATE
    if first == UNDECIDED and any(answer.has_too_few_runs for answer in subject.of_phase(1)):
        return TOO_FEW_FOR_PHASE_ONE + SECOND_PHASE.get(second, "")
    return HEADLINES.get((first, second)) or FIRST_PHASE[first] + SECOND_PHASE.get(second, "")


def headline(subject: Subject) -> str:
    first, second = subject.phase(1), subject.phase(2)
    said = f"{phases(subject)}."
    for verdict, words in ((NO, "Answered no"), (NOT_MEASURED, "Not measured")):
        parts = (1,) if verdict == NO else (1, 2)
        questions = [
            one.criterion.question
            for part in parts
            for one in subject.of_phase(part)
            if one.verdict == verdict
        ]
        if questions and {first, second} != {NOT_MEASURED}:
            said += f" {words}: {' '.join(questions)}"
    if subject.lamarckian:
        said += " But here what is learned is inherited (Lamarckian), so what becomes innate is no sign of the Baldwin effect."
    return said


def beside_the_paper(analysis: Analysis, inference: Inference) -> str:
    """The paper rests on one comparison, and this says how that comes out and what the others add."""
    verdicts = {
        subject.condition: subject.answer(inference.question).verdict
        for subject in analysis.subjects
    }
    said = inference.says
    if set(verdicts.values()) == {YES}:
        said += " That comparison comes out here as it does there."
    elif against := [condition for condition, verdict in verdicts.items() if verdict == NO]:
        said += f" That comparison contradicts the paper here, in {', '.join(against)}."
    said += f" {inference.limit}".rstrip()
    for verdict, found in ((YES, "it does"), (NO, "it does not")):
        if conditions := [
            subject.condition for subject in analysis.subjects if subject.phase(2) == verdict
        ]:
            said += f" Measured directly, {found} in {' and '.join(conditions)}."
    return said


def sentences(analysis: Analysis, subject: Subject) -> list[str]:
    """What was found of a condition, a sentence or two for each part of it that was measured."""
    phases = [*_first_phase(analysis, subject), *_second_phase(subject, analysis.last)]
    return [
        *phases,
        *_change_in_life(subject),
        *_selection(subject),
        *_knowledge(analysis, subject),
    ]


def _first_phase(analysis: Analysis, subject: Subject) -> Iterator[str]:
    gain, on, off = (
        subject.answer("gain"),
        *(analysis.number(subject.condition, life, "last") for life in ("on", "off")),
    )
    if gain.numbers and on and off:
        yield (
            f"Over all generations the average agent eats {number(gain.numbers.median_a)} when it learns, and "
            f"{number(gain.numbers.median_b)} when its learning is turned off{_doubt(gain)}; in the last {analysis.last} "
            f"generations it eats {number(on.median)} and {number(off.median)}."
        )
    if drift := subject.answer("learning").numbers:
        meaning = {
            YES: "so it is learning that counts",
            NO: "so it is not learning that counts: any change does as well",
            UNDECIDED: "and the runs do not tell the two apart",
        }
        yield (
            f"With random changes of the weights in place of learning it eats {number(drift.median_b)} where it would else eat "
            f"{number(drift.median_a)}, {meaning[subject.answer('learning').verdict]}."
        )
    if newborns := subject.answer("newborns").numbers:
        yield (
            f"Newborns of the last generation eat {number(newborns.median_a)} in their life, random genomes that learn likewise "
            f"{number(newborns.median_b)}{_doubt(subject.answer('newborns'))}."
        )


def _second_phase(subject: Subject, last: int) -> Iterator[str]:
    if subject.without_learning_nobody_ate:
        ability = (
            "What evolves here is the ability to learn, not an innate version of what is learned."
        )
        yield (
            "Without learning no agent ate a single item, in any run and any generation that was lived again, so there is "
            "nothing innate that could grow: an agent that does not learn does the same at every step until it senses food, and "
            f"neither its circle nor its line leads there. {ability if subject.answer('newborns').verdict == YES else ''}"
        ).strip()
        return
    innate, share = subject.answer("innate"), subject.answer("share")
    if innate.numbers:
        yield (
            f"What agents eat without learning goes from {number(innate.numbers.median_b)} in the first {last} generations to "
            f"{number(innate.numbers.median_a)} in the last{_doubt(innate)}."
        )
    if share.numbers:
        first, final = (
            f"{number(100 * value)} %" for value in (share.numbers.median_b, share.numbers.median_a)
        )
        end = (
            "; this is the opposite of assimilation: agents come to rely on learning"
            if _way(share) == LESS
            else ""
        )
        yield f"Of what they eat with learning, that is {first} at first and {final} at last{_doubt(share)}{end}."
    yield from _guidance(subject)


def _guidance(subject: Subject) -> Iterator[str]:
    guidance = subject.answer("guidance")
    if guidance.numbers:
        meaning = {
            MORE: "learning has guided evolution to better innate behaviour",
            LESS: "as if learning hid from selection what is innate (the hiding effect)",
            SAME: "the same",
            UNDECIDED: "the runs do not tell which is more",
        }
        yield (
            f"Agents that evolved without learning ({subject.rival}) eat {number(guidance.numbers.median_b)} at last, those that "
            f"evolved with it and have it turned off {number(guidance.numbers.median_a)}: {meaning[_way(guidance)]}."
        )


def _change_in_life(subject: Subject) -> Iterator[str]:
    need, cost = subject.answer("need"), subject.answer("cost")
    if need.numbers:
        verb = {
            MORE: "grows",
            LESS: "falls",
            SAME: "stays what it is",
            UNDECIDED: "is not known to change",
        }[_way(need)]
        yield f"The gain from learning {verb}: {number(need.numbers.median_b)} at first, {number(need.numbers.median_a)} at last."
    if cost.numbers and _way(cost) == MORE:
        more = number(cost.numbers.effect)
        yield f"Having to learn costs {more}: so much more they eat if born with the weights of their own death."
    if cost.numbers and _way(cost) == LESS:
        yield (
            f"Born with the weights of their own death, and with learning off, they eat {number(cost.numbers.median_a)}: what "
            "they have learned by then does not do the whole of the task. It is the course of learning that does."
        )


def _selection(subject: Subject) -> Iterator[str]:
    innate, learned = subject.answer("built-innate"), subject.answer("built-learned")
    if innate.numbers and learned.numbers:
        built = {
            YES: "selection has built it",
            NO: "selection has not built it",
            UNDECIDED: "the runs do not tell what selection did",
        }
        parts = [
            f"{what} {number(answer.numbers.median_a)} against {number(answer.numbers.median_b)} ({built[answer.verdict]})"
            for what, answer in (("eat without learning", innate), ("gain from learning", learned))
            if answer.numbers
        ]
        yield f"Beside their neutral twin, whose parents were drawn at random, the last generations {' and '.join(parts)}."


def _knowledge(analysis: Analysis, subject: Subject) -> Iterator[str]:
    both = analysis.number(subject.condition, "modules", "both evolved")
    reinforcement, action = subject.answer("reinforcement"), subject.answer("action")
    if both and reinforcement.numbers and action.numbers:
        carrying = [
            answer.criterion.id for answer in (reinforcement, action) if answer.verdict == YES
        ]
        meaning = {
            0: "neither is known to carry anything by itself",
            2: "each carries something by itself",
        }
        alone = meaning.get(
            len(carrying),
            f"only the {''.join(carrying)} module is known to carry something by itself",
        )
        yield (
            f"Of the two evolved modules {alone}: agents eat {number(reinforcement.numbers.median_a)} with the reinforcement "
            f"module and a random action module, {number(action.numbers.median_a)} with the action module and a random "
            f"reinforcement module, {number(action.numbers.median_b)} with both random, {number(both.median)} with both evolved."
        )


def _way(answer: Answer) -> str:
    """In which direction the numbers of an answer lie, whatever the question asks for."""
    if answer.numbers is None or answer.verdict == UNDECIDED:
        return UNDECIDED
    return MORE if answer.numbers.effect > 0 else LESS if answer.numbers.effect < 0 else SAME


def _doubt(answer: Answer) -> str:
    if answer.has_too_few_runs:
        return ", a difference that so few runs cannot establish"
    return ", a difference that the runs do not establish" if answer.verdict == UNDECIDED else ""
