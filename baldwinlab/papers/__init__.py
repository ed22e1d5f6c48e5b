"""The papers of baldwinlab, one folder each, and custom papers in any folder.

A study of a paper contains the name of the paper in `study.toml`, and a copy of a custom paper in
`DIR/paper`. The report can therefore be written again on any machine. A paper is data; baldwinlab
executes nothing in it.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

from baldwinlab.core.file_writing import write_atomically
from baldwinlab.core.files import PAPER_FILE, read_bytes, require_inside_study
from baldwinlab.core.names import suggest
from baldwinlab.papers.checks import check_paper
from baldwinlab.papers.loading import PaperError
from baldwinlab.papers.paper import CARD_FILE, PRESET_KINDS, Paper, open_paper

__all__ = [
    "COPY_FOLDER",
    "DEFAULT_PAPER",
    "Paper",
    "PaperError",
    "built_in",
    "load",
    "load_stored_paper",
    "save_copy",
]

DEFAULT_PAPER = "le-2019"
# Folder of a study with a copy of its custom paper.
COPY_FOLDER = "paper"


@cache
def built_in() -> dict[str, Paper]:
    """Return the papers of baldwinlab by name, the default first."""
    folders = [path.parent for path in Path(__file__).parent.glob("*/paper.toml")]
    papers = sorted((open_paper(folder) for folder in folders), key=_sort_key)
    return {paper.name: paper for paper in papers}


def _sort_key(paper: Paper) -> tuple[bool, str]:
    """Return a key that is smallest for the default paper. False is less than True."""
    return paper.name != DEFAULT_PAPER, paper.name


def load(paper: str | Path = DEFAULT_PAPER) -> Paper:
    """Return the paper with a name, or the paper in a folder.

    Raises PaperError if there is no such paper, or if the folder is not a valid paper.
    """
    if str(paper) in built_in():
        return built_in()[str(paper)]
    folder = Path(paper)
    if not folder.is_dir():
        suggestion = suggest(str(paper), built_in())
        raise PaperError(
            f"there is no paper {str(paper)!r}{suggestion}, and any folder with a paper.toml"
        )
    custom = check_paper(open_paper(folder))
    if custom.name in built_in():
        raise PaperError(
            f"{folder / 'paper.toml'}: name {custom.name!r} is that of a paper of baldwinlab; "
            "choose another"
        )
    return custom


def save_copy(paper: Paper, directory: Path) -> None:
    """Copy a custom paper into the folder of its study, and remove an earlier copy.

    Raises OSError.
    """
    if built_in().get(paper.name) == paper:
        return
    patterns = (
        "*.toml",
        "README.md",
        CARD_FILE,
        *(f"{kind}/*.toml" for kind in PRESET_KINDS),
    )
    files = {
        path.relative_to(paper.folder): read_bytes(path, PAPER_FILE)
        for pattern in patterns
        for path in paper.folder.glob(pattern)
    }
    copy_folder = directory / COPY_FOLDER
    require_inside_study(copy_folder / "paper.toml")
    for path in copy_folder.rglob("*.toml"):
        path.unlink()
    for name, content in files.items():
        write_atomically(copy_folder / name, content)


def load_stored_paper(directory: Path, name: str) -> Paper:
    """Return the paper of a study by `name`, or the default paper if the study has none.

    Raises PaperError if the paper is neither in the study nor in baldwinlab.
    """
    copy_folder = directory / COPY_FOLDER
    if (copy_folder / "paper.toml").exists():
        return open_paper(copy_folder)
    paper_name = name or DEFAULT_PAPER
    if paper_name not in built_in():
        raise PaperError(
            f"{directory} is a study of the paper {name!r}, but {copy_folder} contains no copy of "
            "this paper"
        )
    return built_in()[paper_name]
