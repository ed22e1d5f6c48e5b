"""The command `article`: write an article about the stored results of the atlas."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from baldwinlab.api.atlas import open_atlas, write_article
from baldwinlab.core import console


def article(
    subject: Annotated[Literal["atlas"], Parameter(help="Results to describe.")],
    /,
    *,
    folder: Annotated[Path, Parameter(help="Folder of the atlas.")] = Path("results/atlas"),
    out: Annotated[Path, Parameter(help="File to write, .md or .pdf.")] = Path("article.md"),
) -> None:
    """Write an article about the atlas: methods, results, limits and references.

    Each number is computed from stored results. Equal results give a file with equal bytes.

    For example:

        baldwinlab article atlas --out article.pdf
    """
    del subject
    console.info(f"{write_article(open_atlas(folder), out)}")
