"""Article of the atlas, in Markdown. Each number is computed from stored results."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined
from scipy import stats

from baldwinlab._version import __version__
from baldwinlab.analysis.atlas.outcomes import OUTCOMES
from baldwinlab.analysis.atlas.tables import describe_settings, list_cells
from baldwinlab.api.atlas.publish import (
    AtlasResults,
    MapResults,
    collect_points,
    describe_claims,
)
from baldwinlab.core.file_writing import write_atomically
from baldwinlab.papers.atlas_design import CLAIMS_FILE

ARTICLE_FILE: Final = "article.md"


def write_article(results: AtlasResults, directory: Path) -> Path:
    """Write the article of a finished atlas."""
    return write_atomically(directory / ARTICLE_FILE, render_article(results).encode())


def render_article(results: AtlasResults) -> str:
    """Return the article as Markdown."""
    environment = Environment(
        loader=PackageLoader("baldwinlab.analysis", ""),
        autoescape=False,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    runs = next(iter(results.maps[0].cells.values()))["run"].values.tolist()
    maps = [_describe_map(result) for result in results.maps]
    return environment.get_template("atlas/article.md").render(
        design=results.design,
        maps=maps,
        n_cells=sum(entry["n_cells"] for entry in maps),
        n_claims=len(results.claims),
        verdicts=" ".join(describe_claims(results.claims)),
        results=results.claims,
        runs=len(runs),
        first_run=runs[0],
        last_run=runs[-1],
        seed=results.seed,
        outcomes=OUTCOMES,
        digest=results.digests[CLAIMS_FILE],
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
        "law": result.law.quantity if result.law else "",
        "share": _describe_share(result),
        "fit": _describe_fit(result),
    }


def _describe_share(result: MapResults) -> dict[str, str] | None:
    """Return the range of A over the cells, None if it is not defined in any cell."""
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
        "mean": f"{np.mean([row['mean'] for row in rows]):.2f}",
        "lowest": f"{lowest[0]:.2f} ({lowest[1]})",
        "highest": f"{highest[0]:.2f} ({highest[1]})",
    }


def _describe_fit(result: MapResults) -> dict[str, str] | None:
    """Return the errors of the law, None without a law."""
    if not result.law:
        return None
    points = collect_points(result)
    if len(points.predicted) < 3:
        return None
    errors = np.abs(np.array(points.measured) - np.array(points.predicted))
    # A law that predicts the same value in all cells has no correlation.
    is_constant = np.ptp(points.predicted) == 0
    correlation = (
        "" if is_constant else f"{stats.spearmanr(points.measured, points.predicted).statistic:.2f}"
    )
    return {
        "cells": str(errors.size),
        "mean_error": f"{errors.mean():.3f}",
        "largest_error": f"{errors.max():.3f}",
        "correlation": correlation,
    }
