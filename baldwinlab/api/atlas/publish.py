"""Write the results of the atlas: page, figures, tables, netCDF files, and an article in Markdown.

Every number in the article is computed from stored results.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Final

import numpy as np
from scipy import stats

from baldwinlab._version import __version__
from baldwinlab.analysis.atlas.claims import (
    AtlasClaimResult,
    evaluate_claims,
    refuse_verdicts,
)
from baldwinlab.analysis.atlas.figures import LawPoints, choose_outcome, draw_laws, draw_maps
from baldwinlab.analysis.atlas.grids import (
    HEIGHT,
    WIDTH,
    arrange_grids,
    describe_cells,
    name_letter,
)
from baldwinlab.analysis.atlas.laws import LAWS, Law
from baldwinlab.analysis.atlas.outcomes import MEASURE_PREFIX, OUTCOMES, compute_outcomes
from baldwinlab.analysis.atlas.tables import (
    COLUMNS,
    RESIDUAL,
    describe_settings,
    format_fall,
    list_cells,
    tabulate,
)
from baldwinlab.analysis.report.sections import (
    ReportFigure,
    Section,
    render,
    save_and_inline,
    write_page,
)
from baldwinlab.analysis.results.numbers import to_csv
from baldwinlab.api.atlas.run import AtlasRequest, PlannedMap, plan_maps, read_map, stack_cells
from baldwinlab.api.cells import read_digests
from baldwinlab.api.publish.registered_claims import (
    describe_claims,
    record_claim,
    tabulate_claims,
)
from baldwinlab.core import console
from baldwinlab.core.deferred import xr
from baldwinlab.core.file_writing import write_atomically, write_json
from baldwinlab.core.netcdf import to_bytes
from baldwinlab.papers.atlas_design import (
    CLAIMS_FILE,
    REGISTERED_FILE,
    AtlasDesign,
    digest_atlas,
    read_atlas,
)

PAGE_FILE: Final = "atlas.html"
TABLE_FILE: Final = "atlas.csv"
CLAIM_RESULTS_FILE: Final = "claims.json"
ARTICLE_FILE: Final = "article.md"
CAPTIONS: Final = {
    "assimilation": "Assimilation A: fall of the learned distance, log(d_first / d_last), minus "
    "that of genomes that evolved without learning. Above 0: learning makes behavior innate.",
    "innate_response": "Innate response I to learning, in standard deviations of the founders. "
    "Above 0: learning speeds innate evolution.",
}
QUICK_REASON: Final = "The quick form has too few cells and runs for verdicts, so it prints none."


@dataclass(frozen=True)
class MapResults:
    """The cells of a map by name, and the outcomes of the cells, in the confirmatory runs."""

    planned: PlannedMap
    cells: Mapping[str, xr.Dataset]
    outcomes: xr.Dataset

    @property
    def name(self) -> str:
        """Name of the map."""
        return self.planned.atlas_map.name

    @property
    def title(self) -> str:
        """Title of the map."""
        return self.planned.atlas_map.title

    @property
    def law(self) -> Law | None:
        """Law of the map, or None without a law."""
        return LAWS.get(self.planned.atlas_map.law)

    @cached_property
    def rows(self) -> list[dict[str, Any]]:
        """Return the rows of the table of all outcomes."""
        return tabulate(self.name, self.outcomes, self.law)


@dataclass(frozen=True)
class AtlasResults:
    """The results that the page and the article show."""

    design: AtlasDesign
    maps: Sequence[MapResults]
    claims: Sequence[AtlasClaimResult]
    digests: Mapping[str, str]  # SHA-256 by file of the design, at the first start.
    exploration_runs: int
    seed: int


def read_results(request: AtlasRequest) -> AtlasResults:
    """Return the results of a finished atlas."""
    design = read_atlas()
    size = request.choose_size(design)
    maps = [
        _read_map(planned, request.seed, size.exploration_runs)
        for planned in plan_maps(request, design)
    ]
    confirmatory = {
        result.name: result.outcomes
        for result in maps
        if not result.planned.atlas_map.is_exploratory
    }
    results = (
        refuse_verdicts(design.claims, QUICK_REASON)
        if request.is_quick
        else evaluate_claims(design.claims, confirmatory)
    )
    # The claims are registered before any atlas, so the digest of this file is always the same.
    registered = {REGISTERED_FILE: digest_atlas(design)[REGISTERED_FILE]}
    digests = read_digests(request.directory) | registered
    return AtlasResults(design, maps, results, digests, size.exploration_runs, request.seed)


def _read_map(planned: PlannedMap, seed: int, exploration_runs: int) -> MapResults:
    # The exploratory runs are the first runs, and are left out.
    cells = {
        name: cell.isel(run=slice(exploration_runs, None))
        for name, cell in read_map(planned, seed).items()
    }
    outcomes = {}
    for name, cell in cells.items():
        measures = [key for key in cell.data_vars if str(key).startswith(MEASURE_PREFIX)]
        outcomes[name] = xr.merge([compute_outcomes(cell), cell[measures]])
    return MapResults(planned, cells, stack_cells(planned, outcomes))


def publish_atlas(request: AtlasRequest) -> AtlasResults:
    """Write the page, the figures, the tables and the netCDF files of a finished atlas."""
    folder = request.directory
    results = read_results(request)
    rows = [row for result in results.maps for row in result.rows]
    write_atomically(folder / TABLE_FILE, to_csv(COLUMNS, rows))
    for result in results.maps:
        write_atomically(folder / f"{result.name}.nc", to_bytes(_encode_labels(result.outcomes)))
    write_json(folder / CLAIM_RESULTS_FILE, [record_claim(result) for result in results.claims])
    figures = folder / "figures"
    console.info("drawing the figures")
    sections = [
        Section("laws", "Residual learning and the laws", _render_laws(results, figures)),
        Section("claims", "Claims", _render_claims(results)),
        *(
            Section(result.name, result.title, _render_map(result, results, figures))
            for result in results.maps
        ),
    ]
    lead = QUICK_REASON if request.is_quick else describe_claims(results.claims)
    write_page(results.design.title, lead, sections, folder / PAGE_FILE, figures)
    console.info(f"{folder / PAGE_FILE}", has_address=True)
    return results


def _encode_labels(outcomes: xr.Dataset) -> xr.Dataset:
    """Return the outcomes with attributes as text, which netCDF can store."""
    attributes = {name: str(value) for name, value in outcomes.attrs.items()}
    return outcomes.assign_attrs(attributes)


def _render_laws(results: AtlasResults, figures: Path) -> str:
    points = [collect_points(result) for result in results.maps if result.law]
    figure = ReportFigure(
        name="laws",
        title="Residual learning against the laws",
        caption=(
            "One panel per map, one point per cell: mean over runs with 95 % interval (Student's "
            "t). On the line, the measurement equals the law. Nothing is fitted."
        ),
        alternative="Measured residual learning against the prediction, one point per cell.",
        figure=draw_laws([group for group in points if group.predicted]),
        table=[row for result in results.maps for row in result.rows if row["outcome"] == RESIDUAL],
    )
    style = render("atlas/style.html")
    return style + render("atlas/laws.html", figure=save_and_inline(figure, figures))


def collect_points(result: MapResults) -> LawPoints:
    """Return residual learning, measured and predicted, of the cells of a map that have both."""
    rows = [
        row
        for row in result.rows
        if row["outcome"] == RESIDUAL and None not in (row["mean"], row["law"])
    ]
    columns = {
        name: [np.nan if row[name] is None else row[name] for row in rows]
        for name in ("law", "mean", "low", "high")
    }
    quantity = result.law.quantity if result.law else ""
    return LawPoints(
        result.title, quantity, columns["law"], columns["mean"], columns["low"], columns["high"]
    )


def _render_claims(results: AtlasResults) -> str:
    return render(
        "atlas/claims.html",
        claims=tabulate_claims("Claims of the atlas", results.claims),
        claims_file=CLAIMS_FILE,
        digest=results.digests[CLAIMS_FILE],
        registered_file=REGISTERED_FILE,
        registered_digest=results.digests[REGISTERED_FILE],
    )


def _render_map(result: MapResults, results: AtlasResults, figures: Path) -> str:
    atlas_map = result.planned.atlas_map
    outcome = choose_outcome(result.outcomes)
    figure = ReportFigure(
        name=result.name,
        title=result.title,
        caption=f"{CAPTIONS[outcome.name]} Mean over runs and the other axes."
        + (f" White lines: the law. It predicts: {result.law.describe()}." if result.law else ""),
        alternative=f"{outcome.label.capitalize()} in the cells of the map {result.title}.",
        figure=draw_maps(result.outcomes, atlas_map.axes, result.law),
        table=result.rows,
    )
    cells = describe_cells(
        result.name, result.outcomes, atlas_map.axes, list(result.cells.values()), result.law
    )
    for cell, experiment in zip(cells, result.planned.cells, strict=True):
        file = f"{result.name}/runs/{experiment.name}/experiment.toml"
        cell["command"] = (
            f"baldwinlab run {file} --seed {results.seed} --runs {len(result.planned.runs)}"
        )
    first = next(iter(result.cells.values()))  # The runs and generations of all cells.
    return render(
        "atlas/map.html",
        title=result.title,
        letter=name_letter(result.outcomes),
        description=atlas_map.complete_description,
        figure=save_and_inline(figure, figures),
        law=result.law.describe() if result.law else "",
        grids=arrange_grids(result.title, result.outcomes, atlas_map.axes, cells),
        cells=cells,
        width=WIDTH,
        height=HEIGHT,
        generations=[int(first["generation"][0]), int(first["generation"][-1])],
        runs=first.sizes["run"],
        first_run=int(first["run"][0]),
    )


def write_article(results: AtlasResults, directory: Path) -> Path:
    """Write the article of a finished atlas."""
    return write_atomically(directory / ARTICLE_FILE, render_article(results).encode())


def render_article(results: AtlasResults) -> str:
    """Return the article as Markdown."""
    runs = next(iter(results.maps[0].cells.values()))["run"].values.tolist()
    maps = [_describe_map(result) for result in results.maps]
    return render(
        "atlas/article.md",
        design=results.design,
        maps=maps,
        n_cells=sum(entry["n_cells"] for entry in maps),
        n_claims=len(results.claims),
        verdicts=describe_claims(results.claims),
        results=results.claims,
        runs=len(runs),
        first_run=runs[0],
        last_run=runs[-1],
        seed=results.seed,
        outcomes=OUTCOMES,
        digest=results.digests[CLAIMS_FILE],
        registered_digest=results.digests[REGISTERED_FILE],
        version=__version__,
    )


def _describe_map(result: MapResults) -> dict[str, Any]:
    atlas_map = result.planned.atlas_map
    return {
        "name": result.name,
        "title": result.title,
        "description": atlas_map.complete_description,
        "axes": "; ".join(atlas_map.axes.values()),
        "n_cells": len(result.cells),
        "law": result.law.describe() if result.law else "",
        "share": _describe_share(result),
        "fit": _describe_fit(result),
    }


def _describe_share(result: MapResults) -> dict[str, str] | None:
    """Return mean, lowest and highest A of the cells, as text. None if no cell has a value."""
    rows = [
        row for row in result.rows if row["outcome"] == "assimilation" and row["mean"] is not None
    ]
    if not rows:
        return None
    settings = dict(zip(result.cells, list_cells(result.outcomes), strict=True))
    lowest, highest = (
        (row["mean"], describe_settings(settings[row["cell"]], result.planned.atlas_map.axes))
        for row in (choose(rows, key=lambda row: row["mean"]) for choose in (min, max))
    )
    return {
        "cells": str(len(rows)),
        "mean": format_fall(float(np.mean([row["mean"] for row in rows]))),
        "lowest": f"{format_fall(lowest[0])} ({lowest[1]})",
        "highest": f"{format_fall(highest[0])} ({highest[1]})",
    }


def _describe_fit(result: MapResults) -> dict[str, str] | None:
    """Return the errors of the law, as text. None without a law or with fewer than 3 cells.

    An error is the measured quantity minus the law.
    """
    if not result.law:
        return None
    points = collect_points(result)
    if len(points.predicted) < 3:
        return None
    errors = np.array(points.measured) - np.array(points.predicted)
    # A law that predicts the same value in all cells has no correlation.
    is_constant = np.ptp(points.predicted) == 0
    correlation = (
        "" if is_constant else f"{stats.spearmanr(points.measured, points.predicted).statistic:.2f}"
    )
    return {
        "cells": str(errors.size),
        "mean_error": f"{errors.mean():+.3f}",
        "absolute_error": f"{np.abs(errors).mean():.3f}",
        "largest_error": f"{np.abs(errors).max():.3f}",
        "correlation": correlation,
    }
