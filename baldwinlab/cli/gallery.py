"""The command `gallery`: compare all papers in a folder on one page."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from baldwinlab.api.gallery import compare_papers
from baldwinlab.cli.options import (
    FLAG,
    OVERWRITE_FORCE,
    Json,
    LastGenerations,
    Parts,
    load_parts,
)
from baldwinlab.cli.results import print_gallery
from baldwinlab.core import console


def gallery(
    folder: Annotated[Path, Parameter(help="Folder that holds the studies.")] = Path("results"),
    /,
    *,
    out: Annotated[
        Path | None, Parameter(help="HTML file. Default: gallery.html in the folder.")
    ] = None,
    last_generations: LastGenerations = 10,
    part: Parts = None,
    force: Annotated[bool, FLAG, Parameter(help=OVERWRITE_FORCE)] = False,
    json: Json = False,
) -> None:
    """Compare all papers in a folder on one page, with a table and a figure.

    The page decides the same questions for every condition that evolves and learns. No simulation
    runs. The table is also written to gallery.json and gallery.csv in the folder.

    For example:

        baldwinlab gallery results
    """
    load_parts(part)
    if json:
        console.reserve_stdout()
    page = compare_papers(folder, out, last=last_generations, force=force)
    if json:
        print_gallery(folder, page)
