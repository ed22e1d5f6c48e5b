"""HTML report of a study: claims, figures, tables, and the experiments."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from baldwinlab.analysis.claim_results import ClaimResult
from baldwinlab.analysis.claims import describe_claims_too_few
from baldwinlab.analysis.report import content, settings, setup, tables
from baldwinlab.analysis.report.data import ReportData
from baldwinlab.analysis.report.embedding import save_and_inline
from baldwinlab.analysis.report.figures import draw_figures
from baldwinlab.analysis.report.headline import compose_headline
from baldwinlab.analysis.report.phrases import name_measures
from baldwinlab.analysis.report.replays import link_conditions
from baldwinlab.analysis.report.sections import (
    ReportSummary,
    Section,
    complete_page,
    render,
)
from baldwinlab.analysis.results.numbers import format_number
from baldwinlab.analysis.results.table import summarize_contrasts
from baldwinlab.analysis.statistics import fitness
from baldwinlab.analysis.statistics.fitness import summarize_conditions
from baldwinlab.core.file_writing import write_atomically


def draw_report(report: ReportData) -> dict[str, Any]:
    """Draw the figures of a report and compute its contents.

    `report`: figures are written to `report.directory`/figures.
    """
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
        "main_figure": _choose_main_figure(drawn),
        "headline": compose_headline(report),
        "setup_note": setup.abridge_setup(report.data, report.experiments),
        "comparison_note": summarize_contrasts(contrasts)[0] if contrasts else "",
        "condition_links": link_conditions(report.lives),
        "last": report.last,
        "changed_settings": _list_changed_settings(report),
        "summary_table": _tabulate_summary(report),
        "experiments": content.read_experiment_texts(report.data),
        "provenance": report.provenance,
        "timing": content.format_timing(report.provenance),
        **_summarize_claims(report),
    }


def _tabulate_summary(report: ReportData) -> tables.Table:
    """Return the table of the final values of each condition."""
    names = name_measures(fitness.outcome(report.data))
    rows = [
        [condition, names[measure], n_runs, *map(format_number, numbers)]
        for row in summarize_conditions(report.data, report.last)
        for condition, measure, n_runs, *numbers in [row.values()]
    ]
    headings = ("Runs", "Median", "Mean", "Lower quartile", "Upper quartile", "Minimum", "Maximum")
    return tables.tabulate("Statistics of each condition", ("Condition", "Measure"), headings, rows)


def _choose_main_figure(drawn: Sequence[Mapping[str, Any]]) -> str:
    """Return the name of the figure on the first screen: the first result."""
    names = [str(figure["name"]) for figure in drawn if not figure["is_setup"]]
    return next(iter(names), "")


def _list_changed_settings(report: ReportData) -> list[str]:
    if report.paper is None:
        return []
    return settings.describe_changed_settings(report, report.paper)


def _summarize_claims(report: ReportData) -> dict[str, Any]:
    """Return the contents of a report that depend on its claims."""
    results: Sequence[ClaimResult] = report.results
    findings = [finding for result in results for finding in result.findings]
    differing = content.select_differing_claims(results)
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
        "open_choices": settings.select_open_choices(differing, report.experiments),
    }


def write_report(
    directory: Path,
    contents: Mapping[str, Any],
    out: Path,
    sections: Sequence[Section] = (),
    summary: ReportSummary | None = None,
) -> Path:
    """Write a report as one HTML file, atomically."""
    page = render("report/report.html", sections=sections, top=summary, **contents)
    links = contents["condition_links"]
    watch = render("report/watch.html", links=links) if links else ""
    return write_atomically(out, complete_page(page, out, directory / "figures", watch).encode())
