"""Write the results of the atlas: page, figures, tables, netCDF files, and an article in Markdown.

Every number in the article is computed from stored results.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
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
from baldwinlab.analysis.atlas.figures import (
    HEIGHT,
    LETTERS,
    WIDTH,
    LawPoints,
    arrange_grids,
    choose_outcome,
    describe_cells,
    draw_laws,
    draw_maps,
)
from baldwinlab.analysis.atlas.laws import LAWS, Law
from baldwinlab.analysis.atlas.outcomes import MEASURE_PREFIX, OUTCOMES, compute_outcomes
from baldwinlab.analysis.atlas.tables import (
    RESIDUAL,
    describe_settings,
    format_fall,
    list_cells,
    tabulate,
)
from baldwinlab.analysis.report.sections import ReportFigure, Section, render, save_and_inline
from baldwinlab.api.atlas.run import PlannedMap, choose_size, plan_maps, read_map, stack_cells
from baldwinlab.api.cells import CellsRequest, read_digests
from baldwinlab.api.publish.registered_claims import (
    describe_claims,
    publish_results,
    render_claims,
)
from baldwinlab.core.deferred import xr
from baldwinlab.core.file_writing import write_atomically
from baldwinlab.core.netcdf import to_bytes
from baldwinlab.papers.atlas_design import (
    CLAIMS_FILE,
    REGISTERED_FILE,
    AtlasDesign,
    AtlasMap,
    digest_atlas,
    read_atlas,
)

PAGE_FILE: Final = "atlas.html"
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

    atlas_map: AtlasMap
    cells: Mapping[str, xr.Dataset]
    outcomes: xr.Dataset
    law: Law | None
    rows: Sequence[Mapping[str, Any]]  # The rows of the table of all outcomes.
    n_runs: int  # Number of runs, with the exploratory runs.


@dataclass(frozen=True)
class AtlasResults:
    """The results that the page and the article show."""

    design: AtlasDesign
    maps: Sequence[MapResults]
    claims: Sequence[AtlasClaimResult]
    digests: Mapping[str, str]  # SHA-256 by file of the design, at the first start.
    seed: int


def read_results(request: CellsRequest) -> AtlasResults:
    """Return the results of a finished atlas."""
    design = read_atlas()
    size = choose_size(request, design)
    maps = [
        _read_map(planned, request.seed, size.exploration_runs)
        for planned in plan_maps(request, design)
    ]
    confirmatory = {
        result.atlas_map.name: result.outcomes
        for result in maps
        if not result.atlas_map.is_exploratory
    }
    results = (
        refuse_verdicts(design.claims, QUICK_REASON)
        if request.is_quick
        else evaluate_claims(design.claims, confirmatory)
    )
    # The claims are registered before any atlas, so the digest of this file is always the same.
    registered = {REGISTERED_FILE: digest_atlas(design)[REGISTERED_FILE]}
    digests = read_digests(request.directory) | registered
    return AtlasResults(design, maps, results, digests, request.seed)


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
    law = LAWS.get(planned.atlas_map.law)
    stacked = stack_cells(planned, outcomes)
    rows = tabulate(planned.atlas_map.name, stacked, law)
    return MapResults(planned.atlas_map, cells, stacked, law, rows, len(planned.runs))


def publish_atlas(request: CellsRequest) -> None:
    """Write the page, figures, tables, netCDF files and article of a finished atlas."""
    folder = request.directory
    results = read_results(request)
    for result in results.maps:
        # netCDF stores attributes as text.
        attributes = {name: str(value) for name, value in result.outcomes.attrs.items()}
        data = to_bytes(result.outcomes.assign_attrs(attributes))
        write_atomically(folder / f"{result.atlas_map.name}.nc", data)
    publish_results(
        folder / PAGE_FILE,
        results.design.title,
        QUICK_REASON if request.is_quick else describe_claims(results.claims),
        [row for result in results.maps for row in result.rows],
        results.claims,
        render_article(results),
        _make_sections(results, folder / "figures"),
    )


def _make_sections(results: AtlasResults, figures: Path) -> Iterator[Section]:
    yield Section("laws", "Residual learning and the laws", _render_laws(results, figures))
    claims = render_claims(
        "Claims of the atlas",
        results.claims,
        claims_file=CLAIMS_FILE,
        digest=results.digests[CLAIMS_FILE],
        registered_file=REGISTERED_FILE,
        registered_digest=results.digests[REGISTERED_FILE],
    )
    yield Section("claims", "Claims", claims)
    for result in results.maps:
        body = _render_map(result, results.seed, figures)
        yield Section(result.atlas_map.name, result.atlas_map.title, body)


def _render_laws(results: AtlasResults, figures: Path) -> str:
    points = [
        LawPoints(result.atlas_map.title, result.law.quantity, rows)
        for result in results.maps
        if result.law and (rows := _select_predicted(result))
    ]
    figure = ReportFigure(
        name="laws",
        title="Residual learning against the laws",
        caption=(
            "One panel per map, one point per cell: mean over runs with 95 % interval (Student's "
            "t). On the line, the measurement equals the law. Nothing is fitted."
        ),
        alternative="Measured residual learning against the prediction, one point per cell.",
        figure=draw_laws(points),
        table=[row for result in results.maps for row in result.rows if row["outcome"] == RESIDUAL],
    )
    style = render("atlas/style.html")
    return style + render("atlas/laws.html", figure=save_and_inline(figure, figures))


def _select_predicted(result: MapResults) -> list[Mapping[str, Any]]:
    """Return the rows of residual learning of the cells with a measurement and a prediction."""
    return [
        row
        for row in result.rows
        if row["outcome"] == RESIDUAL and None not in (row["mean"], row["law"])
    ]


def _render_map(result: MapResults, seed: int, figures: Path) -> str:
    atlas_map = result.atlas_map
    outcome = choose_outcome(result.outcomes)
    law = result.law.describe() if result.law else ""
    figure = ReportFigure(
        name=atlas_map.name,
        title=atlas_map.title,
        caption=f"{CAPTIONS[outcome.name]} Mean over runs and the other axes."
        + (f" White lines: the law. It predicts: {law}." if law else ""),
        alternative=f"{outcome.label.capitalize()} in the cells of the map {atlas_map.title}.",
        figure=draw_maps(result.outcomes, atlas_map.axes, result.law),
        table=result.rows,
    )
    curves = list(result.cells.values())
    cells = describe_cells(atlas_map.name, result.outcomes, atlas_map.axes, curves, result.law)
    return render(
        "atlas/map.html",
        map=atlas_map,
        letter=LETTERS[outcome.name],
        figure=save_and_inline(figure, figures),
        law=law,
        grids=arrange_grids(atlas_map.title, result.outcomes, atlas_map.axes, cells),
        cells=cells,
        names=list(result.cells),
        width=WIDTH,
        height=HEIGHT,
        first=curves[0],  # The runs and generations of all cells.
        seed=seed,
        n_runs=result.n_runs,
    )


def render_article(results: AtlasResults) -> str:
    """Return the article as Markdown."""
    maps = [_describe_map(result) for result in results.maps]
    return render(
        "atlas/article.md",
        design=results.design,
        maps=maps,
        n_cells=sum(entry["n_cells"] for entry in maps),
        verdicts=describe_claims(results.claims),
        results=results.claims,
        runs=next(iter(results.maps[0].cells.values()))["run"].values,
        seed=results.seed,
        outcomes=OUTCOMES,
        digest=results.digests[CLAIMS_FILE],
        registered_digest=results.digests[REGISTERED_FILE],
        version=__version__,
    )


def _describe_map(result: MapResults) -> dict[str, Any]:
    points = _select_predicted(result)
    measured, predicted = (np.array([row[name] for row in points]) for name in ("mean", "law"))
    # A law that predicts the same value in all cells has no correlation.
    has_correlation = len(points) > 2 and np.ptp(predicted) > 0
    return {
        "design": result.atlas_map,
        "n_cells": len(result.cells),
        "law": result.law.describe() if result.law else "",
        "share": _describe_share(result),
        "errors": measured - predicted,
        "correlation": stats.spearmanr(measured, predicted).statistic if has_correlation else None,
    }


def _describe_share(result: MapResults) -> dict[str, Any] | None:
    """Return mean, lowest and highest A of the cells, as text. None if no cell has a value."""
    rows = [row for row in result.rows if row["outcome"] == "assimilation"]
    shares = {
        describe_settings(cell, result.atlas_map.axes): row["mean"]
        for cell, row in zip(list_cells(result.outcomes), rows, strict=True)
        if row["mean"] is not None
    }
    if not shares:
        return None
    lowest, highest = (choose(shares, key=shares.__getitem__) for choose in (min, max))
    return {
        "cells": len(shares),
        "mean": format_fall(float(np.mean([*shares.values()]))),
        "lowest": f"{format_fall(shares[lowest])} ({lowest})",
        "highest": f"{format_fall(shares[highest])} ({highest})",
    }
