"""Which ways of learning find food that evolution alone does not, what of it becomes innate, and what each costs.

Of a study in which many learners live on the same maps: the verdicts of its claims beside those of its assays, as sentences, one
table, and data.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from baldwinlab.analysis.assays.analysis import NO, NOT_MEASURED, YES, Analysis, Answer, Verdict
from baldwinlab.analysis.claims import ClaimResult, Finding
from baldwinlab.analysis.report.phrases import signed
from baldwinlab.analysis.report.sections import InShort, render
from baldwinlab.analysis.statistics.csv import finite_or_none, to_csv
from baldwinlab.analysis.statistics.rules import FAILS, HOLDS
from baldwinlab.core.files import write_atomically
from baldwinlab.experiment.factors import Factors

# What the table shows of the assays: criteria of questions.toml.
CRITERIA = {"innate": "built-innate", "learned": "built-learned", "cost": "cost"}

Places = Mapping[str, Sequence[str]]  # maps by learner, of those that have any


class Way(NamedTuple):
    """A way of learning on a map."""

    learner: str
    map: str
    eats: Finding  # its average agent against that of evolution alone
    answers: Mapping[
        str, Answer
    ]  # of the assays, by what the table calls them; those that were measured

    def answered(self, name: str, verdict: Verdict) -> bool:
        return name in self.answers and self.answers[name].verdict == verdict

    def record(self) -> dict[str, Any]:
        """For JSON and CSV: None where a number does not exist."""
        found = self.eats.numbers
        numbers = {
            "median": found.median_a,
            "median_alone": found.median_b,
            "effect": found.effect,
            "p_holm": self.eats.p_holm,
        }
        row: dict[str, Any] = {
            "learner": self.learner,
            "map": self.map,
            **numbers,
            "verdict": self.eats.verdict,
        }
        for name in CRITERIA:
            answer = self.answers.get(name)
            pairs = answer.numbers if answer else None
            row |= {name: pairs and pairs.median_a, f"{name}_against": pairs and pairs.median_b}
            row |= {
                f"{name}_effect": pairs and pairs.effect,
                f"{name}_p_holm": answer and answer.p_holm,
            }
            row |= {f"{name}_verdict": answer.verdict if answer else NOT_MEASURED}
        return {
            name: finite_or_none(value) if isinstance(value, float) else value
            for name, value in row.items()
        }


@dataclass(frozen=True)
class Ways:
    alone: str  # the learner that all others are held against: who does not learn
    maps: tuple[str, ...]
    all: tuple[Way, ...]

    @property
    def learners(self) -> list[str]:
        return list(dict.fromkeys(way.learner for way in self.all))

    @property
    def held_against(self) -> set[str]:
        """The conditions of who is alone."""
        return {way.eats.comparison.other for way in self.all}

    @property
    def without_food(self) -> list[str]:
        """The maps on which evolution alone finds nothing, in the median of its runs."""
        return [
            place
            for place in self.maps
            if all(way.eats.numbers.median_b == 0 for way in self.all if way.map == place)
        ]

    @property
    def measured(self) -> list[str]:
        """Of what the assays tell, that which is there of any."""
        return [name for name in CRITERIA if any(name in way.answers for way in self.all)]

    @property
    def finding(self) -> Places:
        """Who finds food on a map on which evolution alone finds none; on any map, where there is none such."""
        asked = self.without_food or self.maps
        return _places(way for way in self.all if way.eats.verdict == HOLDS and way.map in asked)

    @property
    def innate(self) -> Places:
        """Who eats more than evolution alone where newborns eat more without learning than their neutral twins."""
        return _places(
            way for way in self.all if way.answered("innate", YES) and way.eats.verdict == HOLDS
        )

    @property
    def innate_all_the_same(self) -> Places:
        """Whose newborns do so where the way of learning does not eat more than evolution alone."""
        return _places(
            way for way in self.all if way.answered("innate", YES) and way.eats.verdict != HOLDS
        )

    @property
    def costing(self) -> Places:
        """Who eats less than evolution alone."""
        return _places(way for way in self.all if way.eats.verdict == FAILS)

    @property
    def costly_to_learn(self) -> Places:
        """Who would eat more if born with what is known at death."""
        return _places(way for way in self.all if way.answered("cost", YES))


def _places(which: Iterator[Way]) -> Places:
    found: dict[str, list[str]] = {}
    for way in which:
        found.setdefault(way.learner, []).append(way.map)
    return found


def ways(
    results: Sequence[ClaimResult], factors: Mapping[str, Factors], analysis: Analysis | None
) -> Ways | None:
    """As the claims of a study hold average agents against one learner, map by map; None where they do not."""
    found = {
        finding.comparison.a: finding
        for result in results
        for finding in result.findings
        if (finding.comparison.rule, finding.comparison.measure) == ("greater", "mean")
        and finding.comparison.b in factors
    }
    pairs = [(factors[name], factors[finding.comparison.b]) for name, finding in found.items()]
    against = {rival.learner for _, rival in pairs}
    if len(against) != 1 or not all(
        own.map and own.map == rival.map and own.learner != rival.learner for own, rival in pairs
    ):
        return None
    (alone,) = against
    known = {name: one for name, one in factors.items() if name in found}  # in the study's order
    made = [
        Way(one.learner.removeprefix(f"{alone}+"), one.map, found[name], _answers(name, analysis))
        for name, one in known.items()
    ]
    return Ways(alone, tuple(dict.fromkeys(way.map for way in made)), tuple(made))


def _answers(condition: str, analysis: Analysis | None) -> dict[str, Answer]:
    """Those that were measured, by what the table calls them."""
    subject = (
        next((one for one in analysis.subjects if one.condition == condition), None)
        if analysis
        else None
    )
    asked = (
        {name: subject.answer(criterion) for name, criterion in CRITERIA.items()} if subject else {}
    )
    return {name: answer for name, answer in asked.items() if answer.verdict != NOT_MEASURED}


def in_short(found: Ways, directory: Path) -> InShort:
    """What the head of a report says of them; writes ways.json and figures/ways.csv to `directory`. Raises OSError."""
    _write(found, directory)
    return InShort(
        [*_sentences(found)],
        render("assays/learner_comparison.html", ways=found, rows=_rows(found)),
    )


def _sentences(found: Ways) -> Iterator[str]:
    count = f"{len(found.finding)} of {len(found.learners)} ways of learning"
    if found.without_food:
        where, names = _on(found.without_food), _named(found.finding, found.without_food)
        yield f"{count} find food where evolution alone ({found.alone}) finds none ({where}): {names}."
    else:
        yield f"{count} eat more than evolution alone ({found.alone}) on some map: {_named(found.finding)}."
    yield " ".join(_of_innate(found))
    yield " ".join(_of_cost(found))


def _of_innate(found: Ways) -> Iterator[str]:
    if "innate" not in found.measured:
        yield "Whether what was learned became innate was not measured; the assay neutral does it."
        return
    if found.innate:
        yield (
            f"What was learned may have become innate in {_named(found.innate)}, which eat more than evolution alone, and whose "
            "newborns, with learning off, eat more than their neutral twins (of parents drawn at random)."
        )
    else:
        yield (
            "What was learned became innate in none of them: where a way of learning eats more than evolution alone, its "
            "newborns, with learning off, are not established to eat more than their neutral twins (of parents drawn at random)."
        )
    if found.innate_all_the_same:
        yield f"Where it does not, those of {_named(found.innate_all_the_same)} do."


def _of_cost(found: Ways) -> Iterator[str]:
    if found.costing:
        where = [
            place for place in found.maps if any(place in maps for maps in found.costing.values())
        ]
        yield f"Learning costs on {_on(where)}, where these eat less than evolution alone: {_named(found.costing, where)}."
    else:
        yield "None is established to eat less than evolution alone."
    if "cost" in found.measured:
        yield f"Who would eat more if born with the weights of its own death: {_named(found.costly_to_learn)}."


def _named(places: Places, said: Sequence[str] = ()) -> str:
    """Names, with their maps unless these are, of all, those that are said already."""
    known = all(list(maps) == list(said) for maps in places.values())
    return (
        ", ".join(name if known else f"{name} ({', '.join(maps)})" for name, maps in places.items())
        or "none"
    )


def _on(maps: Sequence[str]) -> str:
    *others, last = maps
    return f"maps {', '.join(others)} and {last}" if others else f"map {last}"


class Row(NamedTuple):
    """What is established of a way of learning, by map: a line of the table."""

    learner: str
    more: str
    less: str
    innate: str
    learned: str
    cost: str


def _rows(found: Ways) -> list[Row]:
    return [
        _row(learner, [way for way in found.all if way.learner == learner])
        for learner in found.learners
    ]


def _row(learner: str, own: Sequence[Way]) -> Row:
    def sizes(name: str) -> dict[str, float]:
        found = {
            way.map: way.answers[name]
            for way in own
            if way.answered(name, YES) or way.answered(name, NO)
        }
        return {
            place: answer.numbers.effect
            for place, answer in found.items()
            if answer.numbers and answer.numbers.effect
        }

    more = [way.map for way in own if way.eats.verdict == HOLDS]
    less = {way.map: way.eats.numbers.effect for way in own if way.eats.verdict == FAILS}
    return Row(learner, ", ".join(more), _sized(less), *(_sized(sizes(name)) for name in CRITERIA))


def _sized(effects: Mapping[str, float]) -> str:
    return ", ".join(
        f"{place}\N{NO-BREAK SPACE}{signed(effect)}" for place, effect in effects.items()
    )


def _write(found: Ways, directory: Path) -> None:
    """Each file appears whole or not at all."""
    rows = [way.record() for way in found.all]
    said = {
        "finding": found.finding,
        "innate": found.innate,
        "innate_all_the_same": found.innate_all_the_same,
    }
    said |= {"costing": found.costing, "costly_to_learn": found.costly_to_learn}
    record = (
        {"alone": found.alone, "maps": found.maps, "without_food": found.without_food}
        | said
        | {"ways": rows}
    )
    text = json.dumps(record, indent=2, ensure_ascii=False, allow_nan=False)
    write_atomically(directory / "ways.json", f"{text}\n".encode())
    write_atomically(directory / "figures" / "ways.csv", to_csv(list(rows[0]), rows))
