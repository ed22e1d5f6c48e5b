"""A figure of the report as a file: SVG, PDF, PNG, or CSV with its numbers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

from baldwinlab.analysis.claim_results import ClaimResult
from baldwinlab.analysis.claim_samples import Samples
from baldwinlab.analysis.claims import evaluate_samples
from baldwinlab.analysis.figures.style import render_figure
from baldwinlab.analysis.report.content import count_runs, format_range
from baldwinlab.analysis.report.data import ReportData
from baldwinlab.analysis.report.figures import load_figure
from baldwinlab.analysis.report.figures.fitness import draw_measures
from baldwinlab.analysis.report.sections import ReportFigure
from baldwinlab.analysis.results.numbers import to_csv
from baldwinlab.analysis.statistics import fitness
from baldwinlab.analysis.sweeps import section
from baldwinlab.analysis.sweeps.analysis import compute_finals
from baldwinlab.core.deferred import xr
from baldwinlab.core.numbers import format_count
from baldwinlab.experiment.conditions import SWEEP
from baldwinlab.papers import load_stored_paper
from baldwinlab.studies.open import open_sample
from baldwinlab.studies.store import StudyStore
from baldwinlab.studies.sweeps.design import label_points

CURVES: Final = "fitness"
FIGURES_OF_CONDITIONS: Final = (CURVES, "final-fitness")
FIGURE_OF_SWEEPS: Final = "responses"
FORMATS: Final = ("svg", "pdf", "png", "csv")
MAX_CONDITIONS: Final = 60
"""Maximum number of drawn conditions. More cannot be distinguished."""


class FigureFile(NamedTuple):
    """A file with a figure or its numbers, and its name."""

    name: str
    content: bytes


def make_figure_file(
    study: StudyStore, name: str, file_format: str, conditions: Sequence[str], measure: str = ""
) -> FigureFile:
    """Make the file of a figure of the report, with the number of runs and the caption.

    `name`: one of `FIGURES_OF_CONDITIONS`, or for a sweep `FIGURE_OF_SWEEPS`. `file_format`: one of
    `FORMATS`. `measure`: the only measure of the curves, or "" for all measures of the report.
    """
    if file_format not in FORMATS:
        raise ValueError(f"format = {file_format!r} must be one of {', '.join(FORMATS)}")
    if measure and (measure not in fitness.MEASURES or name != CURVES):
        allowed = ", ".join(fitness.MEASURES)
        raise ValueError(f"measure = {measure!r} must be one of {allowed}, for the figure {CURVES}")
    figure = _draw(study, name, conditions, measure)
    if file_format == "csv":
        columns = dict.fromkeys(column for row in figure.table for column in row)
        content = to_csv(list(columns), figure.table)
    else:
        content = render_figure(figure.figure, file_format, figure.caption)
    return FigureFile(f"{figure.name}.{file_format}", content)


def _draw(study: StudyStore, name: str, conditions: Sequence[str], measure: str) -> ReportFigure:
    """Draw a figure, with the number of runs in the name, the caption and the table."""
    is_sweep = study.kind == SWEEP
    available = (FIGURE_OF_SWEEPS,) if is_sweep else FIGURES_OF_CONDITIONS
    if name not in available:
        raise ValueError(f"figure = {name!r} must be one of {', '.join(available)}")
    names = list(study.experiments) if is_sweep else list(conditions)
    if not is_sweep and not 0 < len(names) <= MAX_CONDITIONS:
        raise ValueError(f"a figure has 1 to {MAX_CONDITIONS} conditions, not {len(names)}")
    data = fitness.cache_measures(open_sample(study, names))
    if is_sweep:
        drawn = next(section.draw_figures(compute_finals(label_points(study, data))))  # "responses"
    else:
        drawn = _draw_conditions(study, data, name, measure)
    runs = format_range(count_runs(data).values())
    # The path "." has a name only after `resolve`.
    title = study.directory.resolve().name
    return drawn._replace(
        name=f"{title}-{name}-{runs.replace(' ', '-')}-runs",
        caption=f"{title}, {format_count(runs, 'run')} per condition. {drawn.caption}",
        table=[{**row, "runs": runs} for row in drawn.table],
    )


def _draw_conditions(study: StudyStore, data: xr.Dataset, name: str, measure: str) -> ReportFigure:
    names = data["condition"].values.tolist()
    results: Sequence[ClaimResult] = ()
    if study.paper and name == "final-fitness":
        # The boxes show the p-values of claims, as in the report.
        paper = load_stored_paper(study.directory, study.paper)
        results = evaluate_samples(Samples(data, source=paper))
    report = ReportData(
        directory=study.directory,
        data=data,
        experiments={condition: study.experiments[condition] for condition in names},
        results=results,
    )
    if measure:
        return draw_measures(report, [measure])
    figure = load_figure(name)(report)
    assert figure is not None
    return figure
