"""Compare the papers whose studies are in a folder, and reproduce all papers."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Final

from baldwinlab import papers
from baldwinlab.api.publish.gallery import (
    GALLERY_FILE,
    describe_table,
    explain_omissions,
    publish_gallery,
)
from baldwinlab.api.reproduce import Reproduction, are_foragers, run_reproduction
from baldwinlab.api.run_options import RunOptions
from baldwinlab.core import console
from baldwinlab.core.files import REPORT_MARK, require_writable
from baldwinlab.papers.design import read_design

# The folder of the study of the default paper.
DEFAULT_PAPER_FOLDER: Final = "paper"


def compare_papers(
    folder: Path, out: Path | None = None, *, last: int = 10, force: bool = False
) -> Path:
    """Write a page that compares all papers whose studies are in a folder, and return its path.

    The function also writes into the folder: gallery.json and gallery.csv with one row per system
    and question, papers.json with one record per paper, and figures/. No simulation runs.

    `out`: HTML file, by default gallery.html in the folder. `last`: number of final generations
    that are averaged in each run. `force`: overwrite a file that this function did not write.
    """
    page = out or folder / GALLERY_FILE
    if out is not None:
        require_writable("--out", page, REPORT_MARK.encode(), force=force)
    entries, decisions = publish_gallery(folder, page, last, console.info)
    for sentence in (*describe_table(entries, decisions), *explain_omissions(entries)):
        console.info(sentence)
    console.info(f"gallery: {page}")
    return page


def reproduce_all(folder: Path, request: Reproduction, options: RunOptions) -> Path:
    """Reproduce every built-in paper, and compare them on one page, whose path is returned.

    A paper with stages is reproduced in its quick form, and a paper without foragers ignores the
    number of steps. A repeated call simulates only the missing runs and assays.

    `folder`: has one folder per paper. `request`: the numbers of all papers.
    """
    names = list(papers.built_in())
    for paper_number, name in enumerate(names, 1):
        console.info(f"{name}, paper {paper_number} of {len(names)}")
        paper = papers.load(name)
        request_of_paper = replace(
            request,
            paper=paper,
            steps=request.steps if are_foragers(paper.experiments()) else None,
            out=folder / (DEFAULT_PAPER_FOLDER if name == papers.DEFAULT_PAPER else name),
            # The stages of a full study take longer than all other papers.
            is_quick=read_design(paper) is not None,
        )
        run_reproduction(request_of_paper, options)
    return compare_papers(folder, last=request.last)
