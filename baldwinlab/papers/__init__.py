"""The papers: those that come with baldwinlab, each a folder here, and any folder of one's own.

A study that was made by a paper says so in `study.toml`. It keeps a user's paper in `DIR/paper`, so that its report can be made
again wherever it is; these are data, and nothing of them is ever executed.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

from baldwinlab.core.files import (
    PAPER_FILE,
    read_bytes,
    require_inside_study,
    write_atomically,
)
from baldwinlab.core.suggestions import suggest
from baldwinlab.papers.loading import PaperError
from baldwinlab.papers.paper import CARD, KINDS, Paper, check, open_paper

__all__ = ["DEFAULT", "KEPT", "Paper", "PaperError", "built_in", "keep", "load", "of_study"]

DEFAULT = "le-2019"
KEPT = "paper"  # the folder of a study that holds the user's paper that made it


@cache
def built_in() -> dict[str, Paper]:
    """The papers that come with baldwinlab by name, the default first."""
    found = [open_paper(path.parent) for path in Path(__file__).parent.glob("*/paper.toml")]
    return {
        paper.name: paper
        for paper in sorted(found, key=lambda paper: (paper.name != DEFAULT, paper.name))
    }


def load(paper: str | Path = DEFAULT) -> Paper:
    """A paper by its name, or by the path of its folder, which is checked.

    Raises PaperError where there is none, or where it is not what a paper should be.
    """
    if str(paper) in built_in():
        return built_in()[str(paper)]
    folder = Path(paper)
    if not folder.is_dir():
        known = suggest(str(paper), built_in())
        raise PaperError(
            f"there is no paper {str(paper)!r}{known}, and any folder with a paper.toml"
        )
    found = check(open_paper(folder))
    if found.name in built_in():
        raise PaperError(
            f"{folder / 'paper.toml'}: name {found.name!r} is that of a paper of baldwinlab; choose another"
        )
    return found


def keep(paper: Paper, directory: Path) -> None:
    """Copy a user's paper into the folder of its study, in place of what was kept of it before. Raises OSError."""
    if built_in().get(paper.name) == paper:
        return
    pages = (
        "*.toml",
        "README.md",
        CARD,
        *(f"{paper.preset_folder(kind).name}/*.toml" for kind in KINDS),
    )
    files = {
        path.relative_to(paper.folder): read_bytes(path, PAPER_FILE)
        for page in pages
        for path in paper.folder.glob(page)
    }
    kept = directory / KEPT
    require_inside_study(kept / "paper.toml")
    for path in kept.rglob("*.toml"):
        path.unlink()
    for name, content in files.items():
        write_atomically(kept / name, content)


def of_study(directory: Path, name: str) -> Paper:
    """Return the paper that made a study, by `name`, or the default where none did.

    Raises PaperError where the study's own is neither kept in it nor comes with baldwinlab.
    """
    kept = directory / KEPT
    if (kept / "paper.toml").exists():
        return open_paper(kept, is_stored=True)
    if (name or DEFAULT) not in built_in():
        raise PaperError(
            f"{directory} was made by the paper {name!r}, of which nothing is kept in {kept}"
        )
    return built_in()[name or DEFAULT]
