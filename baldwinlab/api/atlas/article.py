"""Article of the atlas: Markdown, or PDF. Each number is computed from stored results."""

from __future__ import annotations

import re
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final

import matplotlib
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
    read_results,
)
from baldwinlab.api.atlas.run import AtlasRequest
from baldwinlab.core.errors import RefusedError
from baldwinlab.core.extras import missing_extra_error
from baldwinlab.core.file_writing import write_atomically
from baldwinlab.papers.atlas_design import CLAIMS_FILE

FORMATS: Final = (".md", ".pdf")
TABLE: Final = re.compile("<table>.*?</table>", re.DOTALL)
CELL: Final = re.compile("<t[dh]>(.*?)</t[dh]>", re.DOTALL)
# Smallest weight of the width of a column, and width of a picture, in points.
MIN_COLUMN: Final = 4.5
PICTURE_WIDTH: Final = 520
# Time of creation in the PDF, so that equal results give equal bytes.
CREATED: Final = datetime(2026, 1, 1, tzinfo=UTC)


def write_article(request: AtlasRequest, out: Path) -> Path:
    """Write the article of a finished atlas.

    Parameters
    ----------
    request : AtlasRequest
        Directory, seed and size of the atlas.
    out : Path
        File to write, .md or .pdf.

    Returns
    -------
    Path
        `out`.

    Raises
    ------
    RefusedError
        The format does not exist, or the atlas is not finished.
    OSError
        The file cannot be written.
    """
    if out.suffix not in FORMATS:
        raise RefusedError(f"--out {out}: the format must be {' or '.join(FORMATS)}")
    text = render_article(read_results(request))
    if out.suffix == ".pdf":
        return write_atomically(out, convert_to_pdf(text, request.directory))
    return write_atomically(out, text.encode())


def render_article(results: AtlasResults) -> str:
    """Return the article as Markdown.

    Parameters
    ----------
    results : AtlasResults
        The results.
    """
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


def convert_to_pdf(text: str, folder: Path) -> bytes:
    """Return the article as PDF.

    Parameters
    ----------
    text : str
        Markdown.
    folder : Path
        Folder of the pictures to which the text refers.

    Raises
    ------
    RefusedError
        The extra `pdf` is not installed.
    """
    try:
        from fpdf import FPDF
    except ImportError:
        raise missing_extra_error("pdf", "a PDF") from None
    from markdown_it import MarkdownIt

    html = MarkdownIt("commonmark").enable("table").render(text)
    pdf = FPDF()
    pdf.set_creation_date(CREATED)
    fonts = Path(matplotlib.get_data_path()) / "fonts" / "ttf"
    for style, name in (("", "DejaVuSans"), ("B", "DejaVuSans-Bold"), ("I", "DejaVuSans-Oblique")):
        pdf.add_font("DejaVu", style, fonts / f"{name}.ttf")
    pdf.set_font("DejaVu", size=9)
    pdf.add_page()
    html = html.replace('src="figures/', f'width="{PICTURE_WIDTH}" src="{folder / "figures"}/')
    pdf.write_html(TABLE.sub(_align_table, html))
    return bytes(pdf.output())


def _align_table(table: re.Match[str]) -> str:
    """Return a table with text at the left, and with wide columns for long texts."""
    rows = [CELL.findall(row) for row in table[0].split("</tr>")]
    lengths = [max(map(len, column)) for column in zip(*filter(None, rows), strict=True)]
    weights = [max(MIN_COLUMN, length**0.5) for length in lengths]
    widths = iter([round(100 * weight / sum(weights)) for weight in weights])
    # Without a background, text is bold as the header is.
    aligned = table[0].replace("<td>", '<td align="left" bgcolor="white">')
    aligned = aligned.replace("<table>", '<table cellpadding="1">')
    return re.sub("<th>", lambda _: f'<th align="left" width="{next(widths)}%">', aligned)
