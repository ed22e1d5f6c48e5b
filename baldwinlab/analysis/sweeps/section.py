"""Page of a sweep: its design, the response of fitness to its fields, and all points."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import product
from operator import attrgetter
from pathlib import Path
from typing import Any, Final

import numpy as np
import xarray as xr

from baldwinlab.analysis.report import content
from baldwinlab.analysis.report.data import MAX_LINKED_LIVES, Link, StoredLife, make_link
from baldwinlab.analysis.report.sections import (
    ReportFigure,
    Section,
    render,
    save_and_inline,
    write_page,
)
from baldwinlab.analysis.report.tables import Table, name_measures, tabulate
from baldwinlab.analysis.results.contrasts import Contrasts
from baldwinlab.analysis.results.headlines import (
    SUMMARY_MEASURE,
    describe_statistic,
    summarize_contrasts,
)
from baldwinlab.analysis.results.numbers import (
    format_estimate,
    format_levels,
    format_number,
    format_numbers,
    format_p_value,
    format_signed,
    join_names,
)
from baldwinlab.analysis.results.table import AGENT_NAMES
from baldwinlab.analysis.statistics import fitness
from baldwinlab.analysis.statistics.significance import SIGNIFICANCE_LEVEL
from baldwinlab.analysis.sweeps import analysis, figures
from baldwinlab.analysis.sweeps.analysis import Response
from baldwinlab.experiment.outcome import name_outcome_of

# Name of the figure of single fields.
RESPONSES: Final = "responses"
DESIGN_DESCRIPTIONS: Final = {
    "grid": "grid: all combinations of the fields' values",
    "list": "list: one value of each field per point",
    "random": "random sample",
    "sobol": "Sobol sample: quasi-random points, which cover the space more evenly",
}


def write_sweep_report(
    directory: Path,
    finals: xr.Dataset,
    provenance: Mapping[str, Any],
    out: Path,
    last: int = 10,
    *,
    contrasts: Contrasts | None = None,
    links: Sequence[Link] = (),
) -> Path:
    """Write the page of a sweep, and its figures in the folder `figures`, each atomically."""
    title = f"{finals.attrs['base']}: sweep of {join_names(finals.attrs['fields'])}"
    lead, note = compose_answer(finals, contrasts)
    note = note or f"The value of a run is its average over the last {last} generations."
    sections = [make_section(directory, finals, provenance, contrasts, links)]
    return write_page(title, lead, sections, out, directory / "figures", note)


def compose_answer(finals: xr.Dataset, contrasts: Contrasts | None) -> tuple[str, str]:
    """Return the answer of a sweep, and what its numbers are, or "" for means over points."""
    if contrasts and contrasts.rows:
        return summarize_contrasts(contrasts)[0], describe_statistic(contrasts)
    effects = describe_effects(finals) if analysis.is_sampled(finals) else describe_ranges(finals)
    return " ".join(effects), ""


def make_section(
    directory: Path,
    finals: xr.Dataset,
    provenance: Mapping[str, Any],
    contrasts: Contrasts | None = None,
    links: Sequence[Link] = (),
) -> Section:
    """Make the section of a sweep, and save its figures in the folder `figures`.

    The heat maps are first, because they show how the effects of two fields depend on each other.
    """
    fields = finals.attrs["fields"]
    is_sampled = analysis.is_sampled(finals)
    shown_contrasts = contrasts if contrasts and contrasts.rows else None
    body = render(
        "sweeps/section.html",
        overview=summarize_design(finals),
        findings=list(describe_effects(finals)),
        contrasts=shown_contrasts,
        figures=[
            save_and_inline(figure._replace(links=links), directory / "figures")
            for figure in sorted(draw_figures(finals), key=lambda item: item.name == RESPONSES)
        ],
        has_links=bool(links),
        sampled=is_sampled,
        fields=fields,
        responses={field: _tabulate_responses(finals, field) for field in fields},
        correlations=_tabulate_correlations(finals) if is_sampled else None,
        points=_tabulate_points(finals),
        provenance=provenance,
        timing=content.format_timing(provenance),
    )
    return Section(anchor="responses", title="Responses", body=body)


def summarize_design(finals: xr.Dataset) -> list[tuple[str, str]]:
    """Return the design of a sweep, as pairs of a heading and a text."""
    fields = [
        (field, f"{_list_values(finals, field)} ({finals[field].attrs['long_name']})")
        for field in finals.attrs["fields"]
    ]
    settings = [assignment.replace("=", " = ", 1) for assignment in finals.attrs["set"]]
    n_runs = finals[SUMMARY_MEASURE].count("run").values.tolist()
    return [
        ("experiment", ", ".join([finals.attrs["base"], *settings])),
        ("design", DESIGN_DESCRIPTIONS[finals.attrs["design"]]),
        *fields,
        ("points", f"{finals.sizes['point']:,}"),
        ("runs per point", content.format_range(n_runs)),
        ("seed", str(finals.attrs["seed"])),
    ]


def _list_values(finals: xr.Dataset, field: str) -> str:
    values = format_levels(analysis.list_values(finals[field]))
    if len(values) <= analysis.MAX_GROUPS or not analysis.is_number(finals[field]):
        return ", ".join(values)
    return f"{values[0]} to {values[-1]}, {len(values)} different values"


def _name_measures(finals: xr.Dataset) -> list[str]:
    names = name_measures(fitness.outcome(finals))
    return [names[measure] for measure in fitness.MEASURES]


def _tabulate_responses(finals: xr.Dataset, field: str) -> Table:
    """Return the means of all measures for each group of a field's values."""
    responses = [analysis.compute_responses(finals, field, measure) for measure in fitness.MEASURES]
    rows = [
        [row[0].group, row[0].points, *(format_estimate(*response[-3:]) for response in row)]
        for row in zip(*responses, strict=True)
    ]
    return tabulate(f"By {field}", [field], ["Points", *_name_measures(finals)], rows)


def _tabulate_correlations(finals: xr.Dataset) -> Table | None:
    """Return the rank correlations, or None if no field has numbers."""
    names = name_measures(fitness.outcome(finals))
    rows = [
        [
            correlation.field,
            names[correlation.measure],
            correlation.points,
            format_number(correlation.rho),
            format_p_value(correlation.p),
            format_p_value(correlation.p_holm),
        ]
        for correlation in analysis.compute_correlations(finals)
    ]
    numbers = ("Points", "Correlation", "p", "Corrected p")
    return tabulate("Rank correlations", ("Field", "Measure"), numbers, rows) if rows else None


def _tabulate_points(finals: xr.Dataset) -> Table:
    """Return the settings of each point, its runs and the means of all measures."""
    fields = finals.attrs["fields"]
    settings = {field: format_levels(finals[field].values.tolist()) for field in fields}
    points: dict[int, list[Any]] = {}
    for row in analysis.tabulate_points(finals):
        point = row["point"]
        labels = [settings[field][point] for field in fields]
        cells = points.setdefault(point, [point, *labels, row["runs"]])
        cells.append(format_estimate(row["mean"], row["low"], row["high"]))
    numbers = (*fields, "Runs", *_name_measures(finals))
    return tabulate("All points", ["Point"], numbers, points.values())


def draw_figures(finals: xr.Dataset) -> Iterator[ReportFigure]:
    """Draw the response to each field, and a heat map for each pair of fields of a grid."""
    ranges = " ".join(describe_ranges(finals))
    yield ReportFigure(
        name=RESPONSES,
        title="Response to each field",
        caption=_describe_curves(finals),
        alternative=f"Fitness by {join_names(finals.attrs['fields'])}. {ranges}",
        figure=figures.draw_response_curves(finals),
        table=analysis.tabulate_points(finals),
    )
    for row, column in analysis.list_pairs(finals):
        yield _draw_heat_map(finals, row, column)


def _describe_curves(finals: xr.Dataset) -> str:
    if analysis.is_sampled(finals):
        return (
            "Each gray dot is the mean over the runs of a point. Blue marks are means over points "
            "with the same value, or over groups of neighboring values if a field has more than "
            "eight. Bars are 95 % intervals over points (Student's t)."
        )
    return (
        "Marks are means over runs and over all points that share a value. Bars are 95 % intervals "
        "over runs (Student's t)."
    )


def _draw_heat_map(finals: xr.Dataset, row: str, column: str) -> ReportFigure:
    values = analysis.compute_table(finals, row, column, SUMMARY_MEASURE)
    finite = values[np.isfinite(values)]
    limits = format_numbers([finite.min(), finite.max()]) if finite.size else []
    answer = f"The average agent: from {' to '.join(limits)}." if limits else "No point has runs."
    row_title = figures.describe_field(finals, row)
    column_title = figures.describe_field(finals, column)
    return ReportFigure(
        name=f"responses-{row}-{column}",
        title=f"{row_title[0].upper()}{row_title[1:]}, and {column_title}",
        caption=(
            "Means over runs and over all other fields. The axes are not to scale: all values are "
            "evenly spaced."
        ),
        alternative=f"Heat map of fitness by {row} and {column}. {answer}",
        figure=figures.draw_heat_maps(finals, row, column),
        table=_tabulate_cells(finals, row, column),
    )


def _tabulate_cells(finals: xr.Dataset, row: str, column: str) -> list[dict[str, Any]]:
    tables = [analysis.compute_table(finals, row, column, name) for name in fitness.MEASURES]
    settings = product(*(analysis.list_values(finals[field]) for field in (row, column)))
    return [
        dict(zip((row, column, *fitness.MEASURES), (*pair, *map(float, values)), strict=True))
        for pair, *values in zip(settings, *(table.ravel() for table in tables), strict=True)
    ]


def describe_effects(finals: xr.Dataset) -> Iterator[str]:
    """Yield the correlations of a sample as sentences, or a sentence that nothing is tested."""
    if analysis.is_sampled(finals):
        yield from _describe_correlations(finals)
    else:
        yield "This report compares no points by a test."


def _describe_correlations(finals: xr.Dataset) -> Iterator[str]:
    correlations = [
        correlation
        for correlation in analysis.compute_correlations(finals)
        if correlation.measure == SUMMARY_MEASURE and correlation.p_holm < SIGNIFICANCE_LEVEL
    ]
    for correlation in correlations:
        yield (
            f"{correlation.field} is correlated with {_name_outcome(finals)}: rank correlation "
            f"{format_signed(correlation.rho)}, corrected p {format_p_value(correlation.p_holm)}, "
            f"{correlation.points} points."
        )
    if not correlations:
        yield (
            f"No field of numbers has a significant rank correlation with {_name_outcome(finals)}."
        )


def _name_outcome(finals: xr.Dataset) -> str:
    return name_outcome_of(fitness.outcome(finals), AGENT_NAMES[SUMMARY_MEASURE])


def describe_ranges(finals: xr.Dataset) -> Iterator[str]:
    """Yield a sentence per field: the groups with the lowest and the highest mean."""
    for field in finals.attrs["fields"]:
        responses = [
            response
            for response in analysis.compute_responses(finals, field, SUMMARY_MEASURE)
            if np.isfinite(response.mean)
        ]
        if len(responses) > 1:
            lowest = min(responses, key=attrgetter("mean"))
            highest = max(responses, key=attrgetter("mean"))
            yield (
                f"By {field}, the mean of {_name_outcome(finals)} is between "
                f"{_format_response(lowest)} and {_format_response(highest)}."
            )


def _format_response(response: Response) -> str:
    estimate = format_estimate(response.mean, response.low, response.high)
    return f"{estimate} ({response.group})"


def link_points(
    finals: xr.Dataset, conditions: Sequence[str], generations: Sequence[int]
) -> list[Link]:
    """Return links to the last generation of a typical run, one link per point with runs.

    If there are too many points, only two have links: the points with the lowest and the highest
    fitness of the average agent.
    """
    values = finals[SUMMARY_MEASURE]
    links = []
    for point in _select_points(values.mean("run").values):
        runs = values.isel(point=point).dropna("run")
        nearest = int(abs(runs - runs.median()).argmin("run"))  # Index of the typical run.
        life = StoredLife(conditions[point], int(runs["run"][nearest]), generations[point] - 1)
        links.append(make_link([life], _label_point(finals, point)))
    return links


def _select_points(means: np.ndarray) -> list[int]:
    """Return the linked points in their order. The mean of a point without runs is NaN."""
    measured = np.flatnonzero(np.isfinite(means))
    if len(measured) <= MAX_LINKED_LIVES:
        return measured.tolist()
    return sorted({int(np.nanargmin(means)), int(np.nanargmax(means))})


def _label_point(finals: xr.Dataset, point: int) -> str:
    return ", ".join(
        f"{field} = {format_levels(finals[field].values.tolist())[point]}"
        for field in finals.attrs["fields"]
    )
