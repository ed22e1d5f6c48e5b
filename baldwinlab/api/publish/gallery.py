"""Write the gallery: one page, one table and one figure for the studies of papers in a folder."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import isnan
from pathlib import Path
from typing import Any, Final

from markupsafe import Markup

from baldwinlab.analysis.gallery.analysis import TimeToLevel
from baldwinlab.analysis.gallery.decisions import (
    COLUMNS,
    Decision,
    SystemName,
    decide,
    describe_too_few_runs,
)
from baldwinlab.analysis.gallery.summary import (
    TITLES,
    QuestionSummary,
    conclude,
    draw_forest,
    summarize_questions,
    tabulate_measurements,
    tabulate_verdicts,
)
from baldwinlab.analysis.report.data import link_paper
from baldwinlab.analysis.report.sections import (
    ReportFigure,
    Section,
    render,
    save_and_inline,
    write_page,
)
from baldwinlab.analysis.report.tables import Table, add_detail, badge, tabulate
from baldwinlab.analysis.results.numbers import replace_undefined, to_csv
from baldwinlab.analysis.results.verdicts import FAILS, HOLDS, UNDECIDED
from baldwinlab.api.publish.gallery_entries import Entry, read_entries
from baldwinlab.core import console
from baldwinlab.core.file_writing import write_atomically, write_json
from baldwinlab.core.files import REPORT_MARK, require_writable
from baldwinlab.core.numbers import format_count
from baldwinlab.papers.claims import EXPLORATORY, KINDS

TITLE: Final = "Is there a Baldwin effect?"


def compare_papers(
    folder: Path, out: Path | None = None, *, last: int = 10, force: bool = False
) -> Path:
    """Write a page that compares all papers whose studies are in a folder; return the path.

    The function also writes into the folder: gallery.json and gallery.csv with one row per system
    and question, papers.json with one record per paper, and figures/. No simulation runs.
    """
    page = out or folder / "gallery.html"
    if out is not None:
        require_writable("--out", page, REPORT_MARK.encode(), force=force, suffixes=[".html"])
    entries, decisions = publish_gallery(folder, page, last)
    sentences = [*conclude(decisions), *_list_notes(entries, decisions)]
    for sentence in (*sentences, *explain_omissions(entries)):
        console.info(sentence)
    console.info(f"gallery: {page}")
    return page


def publish_gallery(folder: Path, out: Path, last: int) -> tuple[list[Entry], list[Decision]]:
    """Write the tables, the figure and the page of the papers whose studies are in a folder."""
    entries = read_entries(folder, last)
    console.info("deciding the questions")
    decisions = decide(
        {
            SystemName(entry.paper.name, system.condition): system.estimates
            for entry in entries
            for system in entry.systems
        }
    )
    rows = [decision.row() for decision in decisions]
    write_json(folder / "gallery.json", rows)
    write_atomically(folder / "gallery.csv", to_csv(COLUMNS, rows))
    papers = [_entry_record(entry) for entry in entries]
    write_json(folder / "papers.json", {"last": last, "papers": papers})
    console.info("drawing the figure")
    figures = folder / "figures"
    clocks = render("gallery/clocks.html", times=_tabulate_times(entries))
    claims = render("gallery/claims.html", claims=_tabulate_claims(entries))
    # The answer to the first question is the lead. The first section has the other answers.
    count, *conclusions = conclude(decisions)
    lead, note = (conclusions[0], count) if conclusions else (count, "")
    answers = _render_answers(entries, decisions, conclusions[1:], figures, last)
    sections = [
        Section("answers", "Answers by system", answers),
        Section("clocks", "Time to half of the final fitness", clocks),
        Section("claims", "Claims of the papers", claims),
    ]
    write_page(TITLE, lead, sections, out, figures, note)
    return entries, decisions


def _list_notes(entries: Sequence[Entry], decisions: Sequence[Decision]) -> Iterator[str]:
    """Yield the notes on changed models and on too few runs."""
    for entry in entries:
        if entry.changes:
            changes = ", ".join(entry.changes)
            yield f"{entry.paper.name} is a changed model ({changes}) and is included."
    if too_few := describe_too_few_runs(decisions):
        yield f"{too_few} To add runs: baldwinlab reproduce PAPER --runs N"


def explain_omissions(entries: Sequence[Entry]) -> Iterator[str]:
    """Yield a sentence for each paper without a system, with the reason and the commands."""
    for entry in entries:
        if entry.reason:
            commands = " and then ".join(f"`{command}`" for command in entry.commands)
            fix = f" To include it, run {commands}." if entry.commands else ""
            yield f"{entry.paper.name} is not included: {entry.reason}.{fix}"


def _render_answers(
    entries: Sequence[Entry],
    decisions: Sequence[Decision],
    conclusions: Sequence[str],
    folder: Path,
    last: int,
) -> str:
    summaries = summarize_questions(decisions)
    figures = []
    if summaries:
        figures.append(save_and_inline(_draw_figure(decisions, summaries, last), folder))
    return render(
        "gallery/answers.html",
        figures=figures,
        verdicts=tabulate_verdicts(summaries),
        answers={summary.title: tabulate_measurements(summary) for summary in summaries},
        conclusions=conclusions,
        reasons=_group_reasons(decisions),
        titles=TITLES,
        notes=list(_list_notes(entries, decisions)),
        omitted=[entry for entry in entries if entry.reason],
    )


def _group_reasons(decisions: Sequence[Decision]) -> dict[tuple[str, str, str], list[SystemName]]:
    """Return the systems in which a question is not measured, by question, class and reason."""
    systems: dict[tuple[str, str, str], list[SystemName]] = {}
    for decision in decisions:
        if decision.measurement is None:
            entry = decision.estimate
            key = (entry.question, entry.measurability, entry.reason)
            systems.setdefault(key, []).append(decision.system)
    return systems


def _draw_figure(
    decisions: Sequence[Decision], summaries: Sequence[QuestionSummary], last: int
) -> ReportFigure:
    # A system without an effect would be an empty row.
    measured = [decision.system for decision in decisions if decision.measurement]
    systems = list(dict.fromkeys(measured))
    return ReportFigure(
        title="Effects of learning on evolution, by paper",
        caption=(
            "Medians over runs with 95 % intervals (sign test), from six runs. 0 means no effect. "
            "The pale band is the equivalence bound. A verdict uses the q-value over all systems "
            "and questions, and not the interval. The last row is the random-effects mean of the "
            "papers with its 95 % interval (thick) and the prediction interval for another paper "
            "(thin). Windows have "
            f"{last} generations."
        ),
        alternative=" ".join(conclude(decisions)),
        figure=draw_forest(systems, summaries),
        table=[decision.row() for decision in decisions],
        links=[link_paper(name) for name in dict.fromkeys(system.paper for system in systems)],
        name="gallery",
    )


def _tabulate_times(entries: Sequence[Entry]) -> Table | None:
    """Return the times until half of the final fitness, or None without a control."""
    rows = [
        [
            f"{entry.name}: {system.condition}",
            time.evaluation_unit,
            _describe_sooner(time),
            *(
                "–" if isnan(number) else f"{number:,.0f}"
                for number in (
                    *(time.generations, time.control_generations),
                    *(time.evaluations, time.control_evaluations),
                )
            ),
        ]
        for entry in entries
        for system in entry.systems
        if (time := system.time_to_level)
    ]
    texts = ("System", "Evaluations are", "Faster condition")
    numbers = [
        f"{clock}, {life}"
        for clock in ("Generations", "Evaluations")
        for life in ("with learning", "no-learning control")
    ]
    return tabulate("Time to half of the final fitness", texts, numbers, rows) if rows else None


def _tabulate_claims(entries: Sequence[Entry]) -> Table:
    """Return the numbers of claims of each paper by kind and verdict, and the other claims."""
    verdicts = (HOLDS, UNDECIDED, FAILS)
    groups = []
    for entry in entries:
        titles = {claim.id: claim.title for claim in entry.paper.claims}
        rows = []
        for kind, claims in entry.claims_by_kind.items():
            others = [
                Markup("{} {} {}").format(name, titles[name], badge(verdict))
                for name, verdict in claims.items()
                if verdict != HOLDS
            ]
            counts: list[object] = [list(claims.values()).count(verdict) for verdict in verdicts]
            if kind == KINDS[EXPLORATORY][1]:
                counts = ["–"] * len(verdicts)
            rows.append([kind, *counts, Markup("; ").join(others)])
        if rows:
            year = str(entry.paper.metadata.year)
            groups.append((add_detail(entry.name, year, format_count(entry.runs, "run")), rows))
    columns: dict[str, str] = {"Paper": "", "Kind": ""} | dict.fromkeys(verdicts, "right")
    columns["Claims that do not hold or are undecided"] = ""
    return Table("Claims of the papers", columns, groups)


def _describe_sooner(time: TimeToLevel) -> str:
    """Return which condition reaches the level sooner, such as "with learning by both"."""
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
        "systems": [
            {
                "condition": system.condition,
                "control": system.control or None,
                "clock": _time_record(system.time_to_level) if system.time_to_level else None,
            }
            for system in entry.systems
        ],
    }


def _time_record(time: TimeToLevel) -> dict[str, Any]:
    keys = ["level", "generations", "generations_without", "evaluations", "evaluations_without"]
    return replace_undefined(dict(zip([*keys, "counted"], time, strict=True)))
