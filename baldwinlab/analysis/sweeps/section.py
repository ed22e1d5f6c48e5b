"""A sweep as a page: what was swept, how fitness responds to it, and every point."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from baldwinlab.analysis.report import content
from baldwinlab.analysis.report.figures import Picture, embed
from baldwinlab.analysis.report.phrases import measures, number
from baldwinlab.analysis.report.sections import Section, render, write_page
from baldwinlab.analysis.statistics import fitness
from baldwinlab.analysis.statistics.contrasts import Contrasts
from baldwinlab.analysis.sweeps import analysis, figures
from baldwinlab.analysis.sweeps.analysis import Response

DESIGNS = {
    "grid": "grid: every combination of the fields' values",
    "list": "list: the fields take their values together, point by point",
    "random": "random sample",
    "sobol": "Sobol sample: quasi-random points, which fill the space more evenly than random ones",
}
AVERAGE = "mean"  # the measure that a reader in a hurry is told about


def write_sweep_report(
    directory: Path,
    measured: xr.Dataset,
    provenance: Mapping[str, Any],
    out: Path,
    last: int = 10,
    contrasts: Contrasts | None = None,
) -> Path:
    """Write the page of a sweep to `out`, and its figures to `directory`/figures as SVG and PNG; return `out`.

    `measured` is that of `analysis.finals`; of `provenance`, the page shows the facts that are there, as `draw_report` does;
    `contrasts` are the comparisons of the points. Each file appears whole or not at all. Raises OSError.
    """
    fields = measured.attrs["fields"]
    title = f"{measured.attrs['base']}, swept over {_listed(fields)}"
    lead = f"Each run counts with its average over its last {last} generations."
    return write_page(
        title,
        lead,
        [section(directory, measured, provenance, contrasts)],
        out,
        directory / "figures",
    )


def section(
    directory: Path,
    measured: xr.Dataset,
    provenance: Mapping[str, Any],
    contrasts: Contrasts | None = None,
) -> Section:
    """Everything that a page says of a sweep; its figures are also written to `directory`/figures. Raises OSError."""
    fields = measured.attrs["fields"]
    body = render(
        "sweeps/section.html",
        overview=overview(measured),
        findings=list(findings(measured)),
        contrasts=contrasts if contrasts and contrasts.rows else None,
        figures=[embed(picture, directory / "figures") for picture in pictures(measured)],
        sampled=analysis.is_sampled(measured),
        fields=fields,
        responses={field: side_by_side(measured, field) for field in fields},
        correlations=analysis.correlations(measured) if analysis.is_sampled(measured) else [],
        points=analysis.by_point(measured),
        label=analysis.label,
        measures=measures(measured.attrs["food"]),
        provenance=provenance,
        timing=content.timing(provenance),
    )
    return Section("responses", "Responses", body)


def _listed(names: list[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


def overview(measured: xr.Dataset) -> list[tuple[str, str]]:
    """What was swept, as pairs of a heading and what it is."""
    fields = [
        (field, f"{_values(measured, field)} ({measured[field].attrs['long_name']})")
        for field in measured.attrs["fields"]
    ]
    return [
        (
            "experiment",
            ", ".join(
                [
                    measured.attrs["base"],
                    *(text.replace("=", " = ", 1) for text in measured.attrs["set"]),
                ]
            ),
        ),
        ("design", DESIGNS[measured.attrs["design"]]),
        *fields,
        ("points", f"{measured.sizes['point']:,}"),
        (
            "independent runs of a point",
            content.span(measured[AVERAGE].count("run").values.tolist()),
        ),
        ("seed", str(measured.attrs["seed"])),
    ]


def _values(measured: xr.Dataset, field: str) -> str:
    values = measured[field].values
    distinct = (
        np.unique(values).tolist()
        if analysis.is_number(measured[field])
        else list(dict.fromkeys(values.tolist()))
    )
    if len(distinct) <= analysis.MOST_GROUPS or not analysis.is_number(measured[field]):
        return ", ".join(map(analysis.label, distinct))
    return f"{analysis.label(distinct[0])} to {analysis.label(distinct[-1])}, {len(distinct)} different values"


def findings(measured: xr.Dataset) -> Iterator[str]:
    """For a reader in a hurry: the best point, and how far each field moves the average agent."""
    means = measured[AVERAGE].mean("run")
    top = measured.isel(point=int(means.argmax("point")))
    where = ", ".join(
        f"{field} = {analysis.label(top[field].item())}" for field in measured.attrs["fields"]
    )
    yield f"The mean over runs of the average agent is highest at {where}: {number(float(means.max()))}."
    for field in measured.attrs["fields"]:
        found = [
            response
            for response in analysis.responses(measured, field, AVERAGE)
            if np.isfinite(response.mean)
        ]
        if len(found) > 1:
            low, high = min(found, key=lambda one: one.mean), max(found, key=lambda one: one.mean)
            yield f"By {field}, it ranges from {number(low.mean)} ({low.group}) to {number(high.mean)} ({high.group})."


def side_by_side(measured: xr.Dataset, field: str) -> list[tuple[Response, ...]]:
    """For each group of a field's values, the response of each measure."""
    return list(
        zip(
            *(analysis.responses(measured, field, measure) for measure in fitness.MEASURES),
            strict=True,
        )
    )


def pictures(measured: xr.Dataset) -> Iterator[Picture]:
    sampled = analysis.is_sampled(measured)
    dots = "Each gray dot is a point, the mean over its runs. Blue: the mean over the points that share a value or, where there "
    dots += "are more than eight values, have neighbouring ones (groups of about as many points, placed at their median), with "
    lines = "The mean over the points that share a value, that is over all other fields, and over runs, with "
    yield Picture(
        "responses",
        "Response to each field",
        f"{dots if sampled else lines}its 95 % interval over {'points' if sampled else 'runs'} (Student's t) as a bar.",
        f"Fitness by {_listed(measured.attrs['fields'])}. {' '.join(findings(measured))}",
        figures.response_curves(measured),
        analysis.by_point(measured),
    )
    for row, column in analysis.pairs(measured):
        values = analysis.table(measured, row, column, AVERAGE)
        known = values[np.isfinite(values)]
        spread = f"from {number(float(known.min()))} to {number(float(known.max()))}"
        yield Picture(
            f"responses-{row}-{column}",
            f"{_upper(figures.meaning(measured, row))}, and {figures.meaning(measured, column)}",
            "Means over runs, and over all other fields. Values are evenly spaced, whatever their distance.",
            f"Heat map of fitness by {row} and {column}. The average agent: {spread}.",
            figures.heat_maps(measured, row, column),
            _cells(measured, row, column),
        )


def _cells(measured: xr.Dataset, row: str, column: str) -> list[dict[str, Any]]:
    """A row a cell of the heat maps."""
    tables = {
        measure: analysis.table(measured, row, column, measure) for measure in fitness.MEASURES
    }
    down, across = analysis.groups(measured, row), analysis.groups(measured, column)
    return [
        {
            row: one.label,
            column: other.label,
            **{measure: float(values[place]) for measure, values in tables.items()},
        }
        for (i, one), (j, other) in product(enumerate(down), enumerate(across))
        for place in ((i, j),)
    ]


def _upper(text: str) -> str:
    return text[0].upper() + text[1:]
