"""Compare all papers: `bl.compare_papers` and `bl.reproduce_all`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from baldwinlab import papers
from baldwinlab.api.load import load_installed_parts
from baldwinlab.api.publish.gallery import (
    GALLERY_FILE,
    describe_table,
    explain_omissions,
    publish_gallery,
)
from baldwinlab.api.reproduce import are_foragers, reproduce
from baldwinlab.core import console
from baldwinlab.core.numbers import check_numbers
from baldwinlab.core.output_paths import REPORT_MARK, require_writable
from baldwinlab.papers.design import read_design


@check_numbers
def compare_papers(
    folder: str | Path = "results",
    out: str | Path | None = None,
    *,
    last: int = 10,
    force: bool = False,
) -> Path:
    """Write a page that compares all papers whose studies are in a folder.

    The function also writes into the folder: gallery.json and gallery.csv with one row per system
    and question, papers.json with one record per paper, and figures/. No simulation runs.

    Parameters
    ----------
    folder
        Folder that holds the studies.
    out
        HTML file. By default gallery.html in the folder.
    last
        Number of final generations that are averaged in each run, at least 1.
    force
        Overwrite an HTML file that this function did not write.

    Returns
    -------
    pathlib.Path
        The path of the page.

    Raises
    ------
    ArgumentError
        `last` is less than 1.
    RefusedError
        The folder holds no study of a paper, or `out` is a file of another program.
    """
    load_installed_parts()
    page = Path(folder) / GALLERY_FILE if out is None else Path(out)
    if out is not None:
        require_writable("--out", page, REPORT_MARK.encode(), force=force)
    entries, decisions = publish_gallery(Path(folder), page, last, console.info)
    for sentence in (*describe_table(entries, decisions), *explain_omissions(entries)):
        console.info(sentence)
    console.info(f"gallery: {page}")
    return page


@check_numbers
def reproduce_all(
    folder: str | Path = "results", *, steps: int | None = None, last: int = 10, **options: Any
) -> Path:
    """Reproduce every built-in paper, and compare them on one page.

    A paper with stages is reproduced in its quick form. A repeated call simulates only the missing
    runs and assays.

    Parameters
    ----------
    folder
        Folder of the studies. It has one folder per paper.
    steps
        Number of steps of a forager's life; by default as in each paper. Papers without foragers
        ignore it.
    last
        Number of final generations that are averaged in each run, at least 1.
    **options
        Further arguments of `reproduce`, except `variant` and `set`, which apply to one paper only.

    Returns
    -------
    pathlib.Path
        The path of the page.

    Raises
    ------
    ArgumentError
        A number is out of range.
    StudyError
        A folder holds another study.
    RefusedError
        The backend cannot be used on this machine, or too little memory or disk is free.
    InterruptedStudyError
        A worker or a disk failed. The stored runs remain, and a repeated call continues.
    """
    load_installed_parts()
    names = list(papers.built_in())
    for paper_number, name in enumerate(names, 1):
        console.info(f"{name}, paper {paper_number} of {len(names)}")
        has_foragers = are_foragers(papers.load(name).experiments())
        steps_of_paper = steps if has_foragers else None
        # The stages of a full study take longer than all other papers.
        is_staged = read_design(papers.load(name)) is not None
        directory = Path(folder) / ("paper" if name == papers.DEFAULT_PAPER else name)
        reproduce(name, out=directory, steps=steps_of_paper, last=last, quick=is_staged, **options)
    return compare_papers(folder, last=last)
