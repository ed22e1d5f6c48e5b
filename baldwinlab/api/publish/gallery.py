"""Write the gallery: one page, one table and one figure for the studies of papers in a folder."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from math import isnan
from pathlib import Path
from typing import Any, Final

from baldwinlab.analysis.assays.criteria import NO, YES
from baldwinlab.analysis.gallery.analysis import EFFECTS, Size, System, TimeToLevel
from baldwinlab.analysis.gallery.figures import draw_effect_sizes
from baldwinlab.analysis.report import Section, render, write_page
from baldwinlab.analysis.report.embedding import ReportFigure, save_and_inline
from baldwinlab.analysis.statistics.csv import finite_or_none
from baldwinlab.analysis.statistics.rules import FAILS, HOLDS, UNDECIDED
from baldwinlab.api.publish.gallery_entries import Entry, read_entries
from baldwinlab.core.file_writing import write_atomically

GALLERY_FILE: Final = "gallery.html"
RECORD_FILE: Final = "gallery.json"
TITLE: Final = "Is there a Baldwin effect?"


def publish_gallery(folder: Path, out: Path, last: int, log: Callable[[str], None]) -> list[Entry]:
    """Write gallery.json, the figure and the page of the papers whose studies are in a folder.

    Parameters
    ----------
    folder : Path
        Folder with the studies.
    out : Path
        HTML file to write.
    last : int
        Number of final generations to average in each run.
    log : callable
        Called with progress messages.

    Returns
    -------
    list of Entry
        The papers, sorted by year.

    Raises
    ------
    RefusedError
        The folder has no study of a paper.
    OSError
        A file cannot be written.
    """
    entries = read_entries(folder, last, log)
    record = {"last": last, "papers": [_entry_record(entry) for entry in entries]}
    text = json.dumps(record, indent=2, ensure_ascii=False, allow_nan=False)
    write_atomically(folder / RECORD_FILE, f"{text}\n".encode())
    log("drawing the figure")
    figures = folder / "figures"
    clocks = render("gallery/clocks.html", rows=list(_list_times_to_level(entries)))
    claims = render("gallery/claims.html", entries=entries, verdicts=(HOLDS, UNDECIDED, FAILS))
    sections = [
        Section("answers", "Effects by system", _render_answers(entries, figures, last)),
        Section("clocks", "Time to half of the final fitness", clocks),
        Section("claims", "Claims of the papers", claims),
    ]
    write_page(TITLE, " ".join(summarize(entries)), sections, out, figures)
    return entries


def summarize(entries: Sequence[Entry]) -> Iterator[str]:
    """Yield the summary of the gallery, one sentence at a time.

    Parameters
    ----------
    entries : sequence of Entry
        The papers.

    Yields
    ------
    str
        Sentences.
    """
    systems = [system for entry in entries for system in entry.systems]
    n_papers = sum(bool(entry.systems) for entry in entries)
    yield (
        f"This page tests {_count(len(systems), 'system')} of {_count(n_papers, 'paper')} with the "
        "same assays. A system is a condition that evolves and learns."
    )
    yield from _summarize_phases(systems)
    yield _summarize_guidance(systems)
    for entry in entries:
        if entry.changes:
            changes = ", ".join(entry.changes)
            yield f"{entry.paper.name} is a changed model ({changes}) and is included."
    yield _summarize_claims(entries)


def _summarize_phases(systems: Sequence[System]) -> Iterator[str]:
    n_phase_1 = sum(system.phases[0] == YES for system in systems)
    n_without_phase_1 = sum(system.phases[0] == NO for system in systems)
    n_both_phases = sum(system.phases == (YES, YES) for system in systems)
    yield (
        f"Learning guides evolution (phase 1) in {_count(n_phase_1, 'system')} and does not in "
        f"{n_without_phase_1}; the others are undecided."
    )
    yield f"Learned behavior also becomes innate (phase 2) in {n_both_phases}."


def _summarize_guidance(systems: Sequence[System]) -> str:
    answers = [system.effects["guidance"] for system in systems if system.control]
    n_higher = sum(answer.verdict == YES for answer in answers)
    # The verdict NO includes differences that are not negative.
    n_lower = sum(
        answer.verdict == NO and answer.size is not None and answer.size.median < 0
        for answer in answers
    )
    return (
        f"Compared with the no-learning control, final innate fitness is higher in {n_higher} of "
        f"{_count(len(answers), 'system')} and lower in {n_lower}."
    )


def _summarize_claims(entries: Sequence[Entry]) -> str:
    verdicts = [verdict for entry in entries for verdict in entry.claims.values()]
    return (
        f"Verdicts on {_count(len(verdicts), 'claim')} of {_count(len(entries), 'paper')}: "
        f"{HOLDS} {verdicts.count(HOLDS)}, {FAILS} {verdicts.count(FAILS)}, "
        f"{UNDECIDED} {verdicts.count(UNDECIDED)}."
    )


def _count(count: int, noun: str) -> str:
    """Return a number with its noun, such as "1 paper" or "2 papers"."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def explain_omissions(entries: Sequence[Entry]) -> Iterator[str]:
    """Yield a sentence for each paper without a system, with the reason and the commands.

    Parameters
    ----------
    entries : sequence of Entry
        The papers.

    Yields
    ------
    str
        Sentences.
    """
    for entry in entries:
        if entry.reason:
            commands = " and then ".join(f"`{command}`" for command in entry.commands)
            fix = f" To include it, run {commands}." if entry.commands else ""
            yield f"{entry.paper.name} is not included: {entry.reason}.{fix}"


def _render_answers(entries: Sequence[Entry], folder: Path, last: int) -> str:
    papers = {entry.name: entry.systems for entry in entries if entry.systems}
    figures = [save_and_inline(_draw_figure(papers, last), folder)] if papers else []
    return render(
        "gallery/answers.html",
        figures=figures,
        percent=format_percent,
        papers=papers,
        effects=EFFECTS,
        omitted=[entry for entry in entries if entry.reason],
    )


def format_percent(share: float) -> str:
    """Return a share in percent with its sign, such as +12, −3 or 0, or a dash for NaN.

    Parameters
    ----------
    share
        The share. It can be negative or above 1.
    """
    if isnan(share):
        return "–"
    # A change that rounds to 0 has no sign.
    return f"{round(100 * share):+,}".replace("+0", "0").replace("-", "−")


def _draw_figure(papers: dict[str, tuple[System, ...]], last: int) -> ReportFigure:
    systems = [(paper, system) for paper in papers for system in papers[paper]]
    rows = [row for paper, system in systems for row in _tabulate_answers(paper, system)]
    meanings = "; ".join(f"{effect.title}: {effect.meaning}" for effect in EFFECTS)
    headlines = "; ".join(
        f"{paper}, {system.condition}: {system.phases_sentence}" for paper, system in systems
    )
    return ReportFigure(
        "gallery",
        "Effects of learning on evolution, by paper",
        f"{meanings}. Sizes are in percent of the fitness with learning in the last {last} "
        "generations of the same run: medians over runs with 95 % bootstrap intervals. Verdicts "
        "are corrected within each study (Holm). Sizes above 100 % are drawn at the edge.",
        headlines,
        draw_effect_sizes(papers),
        rows,
    )


def _tabulate_answers(paper: str, system: System) -> Iterator[dict[str, Any]]:
    for criterion, answer in system.effects.items():
        if answer.size:
            yield {
                "paper": paper,
                "condition": system.condition,
                "question": criterion,
                **answer.size._asdict(),
                "verdict": answer.verdict,
            }


def _list_times_to_level(entries: Sequence[Entry]) -> Iterator[dict[str, Any]]:
    for entry in entries:
        for system in entry.systems:
            if system.time_to_level:
                yield {
                    "paper": entry.name,
                    "system": system,
                    "time": system.time_to_level,
                    "sooner": _describe_sooner(system.time_to_level),
                }


def _describe_sooner(time: TimeToLevel) -> str:
    """Return whether the level is reached sooner with learning, by generations and evaluations."""
    is_reached = not isnan(time.generations)
    is_reached_without = not isnan(time.control_generations)
    if not is_reached:
        return "only without learning" if is_reached_without else "neither"
    if not is_reached_without:
        return "only with learning"
    by_generations = _name_smaller(time.generations, time.control_generations)
    by_evaluations = _name_smaller(time.evaluations, time.control_evaluations)
    if by_generations == by_evaluations:
        return f"{by_generations} by both"
    return f"{by_generations} by generations, {by_evaluations} by evaluations"


def _name_smaller(with_learning: float, without_learning: float) -> str:
    if with_learning == without_learning:
        return "equal"
    return "with learning" if with_learning < without_learning else "without learning"


def _entry_record(entry: Entry) -> dict[str, Any]:
    metadata = entry.paper.metadata
    return {
        "paper": metadata.name,
        "title": metadata.title,
        "year": metadata.year,
        "changes": list(entry.changes),
        "study": entry.directory.name,
        "runs": entry.runs,
        "claims": entry.claims,
        "systems": [_system_record(system) for system in entry.systems],
    }


def _system_record(system: System) -> dict[str, Any]:
    return {
        "condition": system.condition,
        "control": system.control or None,
        "headline": system.phases_sentence,
        "phase_1": system.phases[0],
        "phase_2": system.phases[1],
        "answers": {
            name: {"verdict": answer.verdict, **_size_record(answer.size)}
            for name, answer in system.effects.items()
        },
        "correlation": _size_record(system.correlation) or None,
        "clock": _time_record(system.time_to_level) if system.time_to_level else None,
    }


def _time_record(time: TimeToLevel) -> dict[str, Any]:
    return {
        "level": finite_or_none(time.level),
        "generations": finite_or_none(time.generations),
        "generations_without": finite_or_none(time.control_generations),
        "evaluations": finite_or_none(time.evaluations),
        "evaluations_without": finite_or_none(time.control_evaluations),
        "counted": time.evaluation_unit,
    }


def _size_record(size: Size | None) -> dict[str, Any]:
    return {name: finite_or_none(value) for name, value in size._asdict().items()} if size else {}
