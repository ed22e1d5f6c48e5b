"""HTML report of a study: first screen, claims, figures, tables, and the experiments."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from baldwinlab.analysis.claim_results import ClaimResult
from baldwinlab.analysis.claims import describe_claims_too_few
from baldwinlab.analysis.report import content, setup, tables
from baldwinlab.analysis.report.data import (
    ReportData,
    StoredLife,
    format_replay_command,
    link_conditions,
    make_link,
)
from baldwinlab.analysis.report.figures import draw_figures
from baldwinlab.analysis.report.sections import (
    ReportSummary,
    Section,
    complete_page,
    render,
    save_and_inline,
)
from baldwinlab.analysis.report.tables import name_measures
from baldwinlab.analysis.results.contrasts import Contrast
from baldwinlab.analysis.results.headlines import describe_statistic, summarize_contrasts
from baldwinlab.analysis.results.numbers import format_number, format_numbers
from baldwinlab.analysis.results.verdicts import HOLDS
from baldwinlab.analysis.statistics import fitness
from baldwinlab.analysis.statistics.fitness import summarize_conditions
from baldwinlab.core.file_writing import write_atomically
from baldwinlab.core.numbers import format_count
from baldwinlab.experiment.outcome import name_outcome_of
from baldwinlab.papers import Paper

MAX_NAMED_AUTHORS = 2


def compose_headline(report: ReportData) -> dict[str, Any]:
    """Return the first screen of a report: the question, and its answer in at most two sentences.

    `statistic`: what the numbers of the answer are, or "" without a comparison. `watch`: link to
    the compared lifetimes. `commands`: they write these lifetimes as movies.
    """
    contrast = report.contrasts.rows[0] if report.contrasts and report.contrasts.rows else None
    lives = _select_lives(report, contrast)
    verdicts = content.describe_verdicts(report.results) if _has_findings(report) else ""
    answer = [f"{verdicts}."] if verdicts else []
    if contrast:
        assert report.contrasts
        answer.append(summarize_contrasts(report.contrasts)[0])
    elif not verdicts:
        answer += _describe_conditions(report)
        # The reason why conditions in different worlds are not compared.
        answer += [report.contrasts.pairing] if report.contrasts else []
    return {
        "question": _compose_question(report),
        "answer": answer,
        "statistic": describe_statistic(report.contrasts) if report.contrasts else "",
        "watch": make_link(lives) if lives else None,
        "commands": [format_replay_command(life) for life in lives],
    }


def _has_findings(report: ReportData) -> bool:
    return any(result.findings for result in report.results)


def _compose_question(report: ReportData) -> str:
    """Return the question of a study."""
    if report.paper and report.paper.texts.question and report.is_reproduction:
        return report.paper.texts.question
    if report.paper and _has_findings(report):
        if any(result.claim.of_paper for result in report.results):
            return f"Do the results of {cite(report.paper)} hold in new simulations?"
        return "Which questions of this study do the simulations answer with yes?"
    names = list(report.experiments)
    if len(names) == 1:
        return f"How fit do the agents of {names[0]} become?"
    if len(names) == 2:
        return f"Do {names[0]} and {names[1]} differ in fitness?"
    return f"Which of {len(names)} conditions differ in fitness?"


def cite(paper: Paper) -> str:
    """Return a short citation, such as "Hinton and Nowlan (1987)"."""
    authors = paper.metadata.authors
    if len(authors) > MAX_NAMED_AUTHORS:
        return f"{authors[0]} et al. ({paper.metadata.year})"
    return f"{' and '.join(authors)} ({paper.metadata.year})"


def _describe_conditions(report: ReportData) -> list[str]:
    """Return sentences on the final fitness of the first condition, which has no comparison."""
    name = next(iter(report.experiments))
    values = fitness.final(report.data, "mean", report.last).sel(condition=name).dropna("run")
    if not values.size:
        return [f"No run of {name} is stored."]
    low, median, high = format_numbers(values.quantile([0, 0.5, 1]).values.tolist())
    outcome = name_outcome_of(fitness.outcome(report.data), "average agent")
    return [
        f"In the last {report.last} generations, the median of {outcome} is "
        f"{median} in {format_count(values.size, 'run')} of {name}.",
        f"The runs are between {low} and {high}.",
    ]


def _select_lives(report: ReportData, contrast: Contrast | None) -> list[StoredLife]:
    """Return typical lifetimes of the compared conditions, or of the first condition."""
    names = [contrast.condition, contrast.reference] if contrast else list(report.lives)[:1]
    return [report.lives[name] for name in names if name in report.lives]


def draw_report(report: ReportData) -> dict[str, Any]:
    """Draw the figures into the folder of the study, and return the values of ``report.html``."""
    folder = report.directory / "figures"
    contrasts = report.contrasts if report.contrasts and report.contrasts.rows else None
    drawn = [save_and_inline(figure, folder) for figure in draw_figures(report)]
    return {
        "paper": report.paper,
        "is_reproduction": report.is_reproduction,
        "contrasts": contrasts,
        "overview": setup.summarize_setup(
            report.data, report.experiments, report.provenance, report.variants
        ),
        "figures": drawn,
        # The figure on the first screen is the first figure of a result.
        "main_figure": next((entry["name"] for entry in drawn if not entry["is_setup"]), ""),
        "headline": compose_headline(report),
        "setup_note": setup.abridge_setup(report.data, report.experiments),
        "comparison_note": summarize_contrasts(contrasts)[0] if contrasts else "",
        "condition_links": link_conditions(report.lives),
        "last": report.last,
        "changed_settings": setup.describe_changed_settings(report),
        "summary_table": _tabulate_summary(report),
        "experiments": content.read_experiment_texts(report.data),
        "provenance": report.provenance,
        "timing": content.format_timing(report.provenance),
        **_summarize_claims(report),
    }


def _tabulate_summary(report: ReportData) -> tables.Table:
    """Return the table of the final values of each condition."""
    names = name_measures(fitness.outcome(report.data))
    # The values of a row are in the order of `SUMMARY_COLUMNS`.
    rows = [
        [condition, names[measure], n_runs, *map(format_number, numbers)]
        for row in summarize_conditions(report.data, report.last)
        for condition, measure, n_runs, *numbers in [row.values()]
    ]
    headings = ("Runs", "Median", "Mean", "Lower quartile", "Upper quartile", "Minimum", "Maximum")
    return tables.tabulate("Statistics of each condition", ("Condition", "Measure"), headings, rows)


def _summarize_claims(report: ReportData) -> dict[str, Any]:
    """Return the values of ``report.html`` that depend on the claims."""
    results: Sequence[ClaimResult] = report.results
    findings = [finding for result in results for finding in result.findings]
    # The evaluated claims that do not hold or are undecided, or whose effect differs.
    differing = [
        result
        for result in results
        if result.findings and not (result.verdict == HOLDS and result.agrees_with_paper)
    ]
    return {
        "results": results,
        "too_few": describe_claims_too_few(results, report.instruction),
        "claims_table": tables.tabulate_claims(results),
        "findings_table": tables.tabulate_findings(results),
        "verdict_counts": content.describe_verdicts(results),
        "of_paper": any(result.claim.of_paper for result in results),
        "has_pairs": any(finding.comparison.paired for finding in findings),
        "has_survival": any(finding.comparison.rule == "survives_longer" for finding in findings),
        "has_model_measures": any(finding.meaning for finding in findings),
        "differing": differing,
        "open_choices": setup.select_open_choices(differing, report.experiments),
    }


def write_report(
    directory: Path,
    contents: Mapping[str, Any],
    out: Path,
    sections: Sequence[Section] = (),
    summary: ReportSummary | None = None,
) -> Path:
    """Write a report as one HTML file, atomically. `contents`: the result of `draw_report`."""
    page = render("report/report.html", sections=sections, top=summary, **contents)
    links = contents["condition_links"]
    watch = render("report/watch.html", links=links) if links else ""
    return write_atomically(out, complete_page(page, out, directory / "figures", watch).encode())
