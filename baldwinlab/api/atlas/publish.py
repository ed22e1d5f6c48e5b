"""Write the results of the atlas: page, figures, tables and netCDF files."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Final

import numpy as np
from markupsafe import Markup

from baldwinlab.analysis.atlas.claims import AtlasClaimResult, evaluate_claims
from baldwinlab.analysis.atlas.figures import (
    LawPoints,
    choose_outcome,
    draw_laws,
    draw_maps,
)
from baldwinlab.analysis.atlas.grids import (
    HEIGHT,
    WIDTH,
    arrange_grids,
    describe_cells,
    name_letter,
)
from baldwinlab.analysis.atlas.laws import LAWS, Law
from baldwinlab.analysis.atlas.outcomes import MEASURE_PREFIX, compute_outcomes
from baldwinlab.analysis.atlas.tables import COLUMNS, RESIDUAL, tabulate
from baldwinlab.analysis.report.sections import (
    ReportFigure,
    Section,
    render,
    save_and_inline,
    write_page,
)
from baldwinlab.analysis.report.tables import Table, add_detail, badge
from baldwinlab.analysis.results.numbers import to_csv
from baldwinlab.analysis.results.verdicts import VERDICTS
from baldwinlab.api.atlas.run import AtlasRequest, PlannedMap, plan_maps, read_map, stack_cells
from baldwinlab.core import console
from baldwinlab.core.deferred import xr
from baldwinlab.core.file_writing import write_atomically, write_json
from baldwinlab.core.netcdf import to_bytes
from baldwinlab.papers.atlas_design import CLAIMS_FILE, AtlasDesign, read_atlas
from baldwinlab.papers.design import FROZEN_FILE

PAGE_FILE: Final = "atlas.html"
TABLE_FILE: Final = "atlas.csv"
CLAIM_RESULTS_FILE: Final = "claims.json"
CAPTIONS: Final = {
    "assimilation": "Share A of the learned distance that has become innate. 1: nothing remains "
    "to be learned; 0: no change or growth.",
    "innate_response": "Innate response I to learning, in standard deviations of the founders. "
    "Above 0: learning speeds innate evolution.",
}


@dataclass(frozen=True)
class MapResults:
    """The stored cells of a map, and their outcomes in the confirmatory runs."""

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
        """Law of the map, None if it has none."""
        return LAWS.get(self.planned.atlas_map.law)

    @cached_property
    def rows(self) -> list[dict[str, Any]]:
        """Return the rows of the table of all outcomes."""
        return tabulate(self.name, self.outcomes, self.law)


@dataclass(frozen=True)
class AtlasResults:
    """Everything that the page and the article state."""

    design: AtlasDesign
    maps: Sequence[MapResults]
    claims: Sequence[AtlasClaimResult]
    digests: Mapping[str, str]
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
    results = evaluate_claims(design.claims, confirmatory)
    digests = json.loads((request.directory / FROZEN_FILE).read_text("utf-8"))
    return AtlasResults(design, maps, results, digests, size.exploration_runs, request.seed)


def _read_map(planned: PlannedMap, seed: int, exploration_runs: int) -> MapResults:
    cells = {
        name: cell.isel(run=slice(exploration_runs, None))
        for name, cell in read_map(planned, seed).items()
    }
    outcomes = {
        name: xr.merge([compute_outcomes(cell), _select_measures(cell)])
        for name, cell in cells.items()
    }
    return MapResults(planned, cells, stack_cells(planned, outcomes))


def _select_measures(cell: xr.Dataset) -> xr.Dataset:
    return cell[[name for name in cell.data_vars if str(name).startswith(MEASURE_PREFIX)]]


def publish_atlas(request: AtlasRequest) -> AtlasResults:
    """Write the page, the figures, the tables and the netCDF files of a finished atlas."""
    folder = request.directory
    results = read_results(request)
    rows = [row for result in results.maps for row in result.rows]
    write_atomically(folder / TABLE_FILE, to_csv(COLUMNS, rows))
    for result in results.maps:
        write_atomically(folder / f"{result.name}.nc", to_bytes(_encode_labels(result.outcomes)))
    write_json(folder / CLAIM_RESULTS_FILE, [_claim_record(result) for result in results.claims])
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
    lead = " ".join(describe_claims(results.claims))
    write_page(results.design.title, lead, sections, folder / PAGE_FILE, figures)
    console.info(f"{folder / PAGE_FILE}", has_address=True)
    return results


def _encode_labels(outcomes: xr.Dataset) -> xr.Dataset:
    """Return outcomes whose attributes netCDF can hold."""
    attributes = {name: str(value) for name, value in outcomes.attrs.items()}
    return outcomes.assign_attrs(attributes)


def _claim_record(result: AtlasClaimResult) -> dict[str, Any]:
    claim, evaluation = result
    return {
        "id": claim.id,
        "claim": claim.claim,
        "rule": claim.complete_rule,
        **evaluation._asdict(),
    }


def describe_claims(claims: Sequence[AtlasClaimResult]) -> list[str]:
    """Return sentences with the claims of each verdict."""
    sentences = []
    for verdict in VERDICTS:
        names = [claim.id for claim, evaluation in claims if evaluation.verdict == verdict]
        if names:
            sentences.append(f"{verdict.capitalize()}: {', '.join(names)}.")
    return sentences


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
    """Return the measured and the predicted residual learning of the cells of a map."""
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
        claims=_tabulate_claims(results.claims),
        claims_file=CLAIMS_FILE,
        digest=results.digests[CLAIMS_FILE],
    )


def _tabulate_claims(results: Sequence[AtlasClaimResult]) -> Table:
    rows = []
    for claim, evaluation in results:
        note = f" Note: {claim.note}" if claim.note else ""
        name = Markup("<strong>{}.</strong> {}").format(claim.id, claim.claim)
        heading = add_detail(name, f"{claim.complete_rule}{note}")
        cells = [badge(evaluation.verdict), evaluation.numbers, evaluation.runs]
        rows.append((heading, [cells]))
    columns = {"Claim": "", "Verdict": "plain", "Numbers": "", "Runs": "plain"}
    return Table("Claims of the atlas", columns, rows, "claims")


def _render_map(result: MapResults, results: AtlasResults, figures: Path) -> str:
    atlas_map = result.planned.atlas_map
    outcome = choose_outcome(result.outcomes)
    figure = ReportFigure(
        name=result.name,
        title=result.title,
        caption=f"{CAPTIONS[outcome.name]} Mean over runs and the other axes."
        + (" White lines: the law." if result.law else ""),
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
    first = next(iter(result.cells.values()))
    return render(
        "atlas/map.html",
        title=result.title,
        letter=name_letter(result.outcomes),
        description=atlas_map.complete_description,
        figure=save_and_inline(figure, figures),
        law=result.law.quantity if result.law else "",
        grids=arrange_grids(result.title, result.outcomes, atlas_map.axes, cells),
        cells=cells,
        width=WIDTH,
        height=HEIGHT,
        generations=[int(first["generation"][0]), int(first["generation"][-1])],
        runs=first.sizes["run"],
        first_run=int(first["run"][0]),
    )
