"""From the studies of papers in a folder to one page, one table and one figure."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from math import isnan
from pathlib import Path
from typing import Any

from baldwinlab.analysis.assays.analysis import NO, YES
from baldwinlab.analysis.gallery.analysis import QUESTIONS, Clock, Size, System
from baldwinlab.analysis.gallery.figures import answers
from baldwinlab.analysis.report import Section, render, write_page
from baldwinlab.analysis.report.figures import Picture, embed
from baldwinlab.analysis.statistics.csv import finite_or_none
from baldwinlab.analysis.statistics.rules import FAILS, HOLDS
from baldwinlab.analysis.statistics.rules import UNDECIDED as OPEN
from baldwinlab.api.publish.gallery_entries import Entry, entries
from baldwinlab.core.files import write_atomically

PAGE, RECORD = "gallery.html", "gallery.json"
TITLE = "Is it the Baldwin effect?"


def publish(folder: Path, out: Path, last: int, tell: Callable[[str], None]) -> list[Entry]:
    """Write gallery.json and the figure into `folder`, and the page of all papers whose studies lie in it; gives these.

    A run counts with its average over its `last` generations. Raises RefusedError where no study of a paper is there.
    """
    found = entries(folder, last, tell)
    record = {"last": last, "papers": [_record(entry) for entry in found]}
    text = json.dumps(record, indent=2, ensure_ascii=False, allow_nan=False)
    write_atomically(folder / RECORD, f"{text}\n".encode())
    tell("drawing the figure")
    figures = folder / "figures"
    sections = [
        Section("answers", "Systems by answers", _answers(found, figures, last)),
        Section(
            "clocks", "On both clocks", render("gallery/clocks.html", rows=list(_clocks(found)))
        ),
        Section(
            "claims",
            "The papers' claims",
            render("gallery/claims.html", entries=found, verdicts=(HOLDS, OPEN, FAILS)),
        ),
    ]
    write_page(TITLE, " ".join(lead(found)), sections, out, figures)
    return found


def lead(found: Sequence[Entry]) -> Iterator[str]:
    """What came of it in some sentences, counted."""
    asked = [system for entry in found for system in entry.systems]
    papers = sum(bool(entry.systems) for entry in found)
    yield f"{len(asked)} systems of {papers} papers, conditions that evolve and learn, were asked the same by the same assays."
    first, not_first = (
        sum(system.phases[0] == verdict for system in asked) for verdict in (YES, NO)
    )
    both = sum(system.phases == (YES, YES) for system in asked)
    yield f"Learning guides selection (phase one) in {first} and does not in {not_first}; the rest is undecided."
    yield f"What was learned becomes innate as well (phase two) in {both}."
    held = [system.answers["guidance"] for system in asked if system.rival]
    higher, not_higher = (
        [answer.size for answer in held if answer.verdict == verdict] for verdict in (YES, NO)
    )
    lower = sum(size is not None and size.median < 0 for size in not_higher)
    yield f"Against evolution without learning, innate fitness ends higher in {len(higher)} of {len(held)}, and lower in {lower}."
    claims = [verdict for entry in found for verdict in entry.claims.values()]
    counts = [claims.count(verdict) for verdict in (HOLDS, FAILS, OPEN)]
    for entry in found:
        if entry.changes:
            yield f"{entry.paper.name} is a changed model ({', '.join(entry.changes)}), and counts in these numbers."
    yield "Of {} claims of {} papers, {} hold, {} do not, and {} are undecided.".format(
        len(claims), len(found), *counts
    )


def left_out(found: Sequence[Entry]) -> Iterator[str]:
    """A sentence for each paper that is not asked, which says why."""
    for entry in found:
        if entry.why_not:
            mend = (
                f"; {' and then '.join(f'`{one}`' for one in entry.mend)} bring it in"
                if entry.mend
                else ""
            )
            yield f"{entry.paper.name} is not asked: {entry.why_not}{mend}."


def _answers(found: Sequence[Entry], folder: Path, last: int) -> str:
    asked = {entry.name: entry.systems for entry in found if entry.systems}
    shown = [embed(_picture(asked, last), folder)] if asked else []
    said = {
        "papers": asked,
        "questions": QUESTIONS,
        "left_out": [entry for entry in found if entry.why_not],
    }
    return render("gallery/answers.html", figures=shown, percent=_percent, **said)


def _percent(share: float) -> str:
    """Such as: +12, −3, 0; a dash where there is no number."""
    return "–" if isnan(share) else f"{round(100 * share):+,}".replace("+0", "0").replace("-", "−")


def _picture(asked: dict[str, tuple[System, ...]], last: int) -> Picture:
    rows = [
        row for paper, found in asked.items() for system in found for row in _rows(paper, system)
    ]
    meanings = "; ".join(f"{one.title}: {one.meaning}" for one in QUESTIONS)
    headlines = "; ".join(
        f"{paper}, {system.condition}: {system.headline}"
        for paper, found in asked.items()
        for system in found
    )
    return Picture(
        "gallery",
        "What learning gives evolution, paper by paper",
        f"{meanings}. In percent of the fitness that agents have with learning in the last {last} generations of the same run; "
        "medians over runs with 95 % bootstrap intervals, verdicts corrected within each study (Holm). What lies beyond 100 % "
        "stands at the edge.",
        headlines,
        answers(asked),
        rows,
    )


def _rows(paper: str, system: System) -> Iterator[dict[str, Any]]:
    """Of the figure's table, a row an answer."""
    for criterion, answer in system.answers.items():
        if answer.size:
            yield {
                "paper": paper,
                "condition": system.condition,
                "question": criterion,
                **answer.size._asdict(),
                "verdict": answer.verdict,
            }


def _clocks(found: Sequence[Entry]) -> Iterator[dict[str, Any]]:
    for entry in found:
        for system in entry.systems:
            if system.clock:
                yield {
                    "paper": entry.name,
                    "system": system,
                    "clock": system.clock,
                    "said": _sooner(system.clock),
                }


def _sooner(clock: Clock) -> str:
    """Which of the two is half-way sooner, on either clock."""
    if isnan(clock.generations) or isnan(clock.generations_without):
        only = {
            (True, True): "neither",
            (False, True): "only with learning",
            (True, False): "only without learning",
        }
        return only[isnan(clock.generations), isnan(clock.generations_without)]
    pairs = (
        (clock.generations, clock.generations_without),
        (clock.evaluations, clock.evaluations_without),
    )
    words = ["with" if one < other else "without" if one > other else "" for one, other in pairs]
    if words[0] == words[1]:
        return f"{words[0]} learning, on both" if words[0] else "alike, on both"
    said = (f"{word} learning" if word else "alike" for word in words)
    return "by generations {}, by evaluations {}".format(*said)


def _record(entry: Entry) -> dict[str, Any]:
    about = entry.paper.about
    return {
        "paper": about.name,
        "title": about.title,
        "year": about.year,
        "changes": list(entry.changes),
        "study": entry.directory.name,
        "runs": entry.runs,
        "claims": entry.claims,
        "systems": [_system_record(system) for system in entry.systems],
    }


def _system_record(system: System) -> dict[str, Any]:
    answered = {
        name: {"verdict": answer.verdict, **_numbers(answer.size)}
        for name, answer in system.answers.items()
    }
    phases = {f"phase_{number}": verdict for number, verdict in enumerate(system.phases, 1)}
    clock = {
        name: finite_or_none(value) if isinstance(value, float) else value
        for name, value in (system.clock._asdict() if system.clock else {}).items()
    }
    named = {
        "condition": system.condition,
        "rival": system.rival or None,
        "headline": system.headline,
    }
    return (
        named
        | phases
        | {"answers": answered, "seen": _numbers(system.seen) or None, "clock": clock or None}
    )


def _numbers(size: Size | None) -> dict[str, Any]:
    return {name: finite_or_none(value) for name, value in size._asdict().items()} if size else {}
