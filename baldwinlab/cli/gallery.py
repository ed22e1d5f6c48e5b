"""The gallery: all papers whose studies lie in a folder, on one page."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from baldwinlab.api.gallery import compare_papers
from baldwinlab.cli.options import Force, Last, Parts, load_parts


def gallery(
    folder: Annotated[Path, Parameter(help="the folder that holds the studies")] = Path("results"),
    /,
    *,
    out: Annotated[
        Path | None, Parameter(help="the page; gallery.html in the folder unless given")
    ] = None,
    last: Last = 10,
    part: Parts = None,
    force: Force = False,
) -> None:
    """Ask of all papers whose studies are stored: is it the Baldwin effect? One page, one table, one figure."""
    load_parts(part)
    compare_papers(folder, out, last=last, force=force)
