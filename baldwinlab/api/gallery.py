"""All papers beside each other."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from baldwinlab import papers
from baldwinlab.api.load import load_installed
from baldwinlab.api.publish.gallery import PAGE, lead, left_out, publish
from baldwinlab.api.reproduce import are_foragers, reproduce
from baldwinlab.core import console
from baldwinlab.core.errors import require_positive
from baldwinlab.core.output_paths import REPORT, require_writable

ALL = "all"  # the word for every paper, where one could be named


def compare_papers(
    folder: str | Path = "results",
    out: str | Path | None = None,
    *,
    last: int = 10,
    force: bool = False,
) -> Path:
    """Write the page of all papers whose studies lie in a folder, with one table and one figure across them; gives its path.

    `out` is gallery.html in the folder unless given; gallery.json and figures/ are written beside the studies. Raises
    RefusedError where no study of a paper is there, or `out` would be written over what no report is.
    """
    require_positive("last", last)
    load_installed()
    page = Path(folder) / PAGE if out is None else Path(out)
    if out is not None:
        require_writable("--out", page, REPORT.encode(), force=force)
    found = publish(Path(folder), page, last, console.info)
    for sentence in (*lead(found), *left_out(found)):
        console.info(sentence)
    console.info(f"gallery: {page}")
    return page


def reproduce_all(
    folder: str | Path = "results", *, steps: int | None = None, last: int = 10, **how: Any
) -> Path:
    """Reproduce every paper that comes with baldwinlab, each in a folder of `folder`, and write the gallery; gives its page.

    `steps` is the length of foragers' lives; `how` is as in `reproduce`, without `variant`, which is of one paper. What is stored
    is not run again. Raises as `reproduce` does.
    """
    load_installed()
    for number, name in enumerate(papers.built_in(), 1):
        console.info(f"{name}, paper {number} of {len(papers.built_in())}")
        foragers = are_foragers(papers.load(name).experiments())
        place = Path(folder) / ("paper" if name == papers.DEFAULT else name)
        reproduce(name, out=place, steps=steps if foragers else None, last=last, **how)
    return compare_papers(folder, last=last)
