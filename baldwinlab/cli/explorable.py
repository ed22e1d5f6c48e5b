"""The command `explorable`: write the essay about the Baldwin effect as one file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from baldwinlab.cli.options import FLAG, OVERWRITE_FORCE
from baldwinlab.core import console
from baldwinlab.core.file_writing import write_atomically
from baldwinlab.core.output_paths import EXPORT_MARK, require_writable


def explorable(
    *,
    out: Annotated[Path, Parameter(help="HTML file to write.")],
    force: Annotated[bool, FLAG, Parameter(help=OVERWRITE_FORCE)] = False,
) -> None:
    """Write an essay on the Baldwin effect whose pictures simulate in the browser.

    The file needs no server and no network.

    For example:

        baldwinlab explorable --out baldwin.html
    """
    # Imported late: loading the engine takes a while.
    from baldwinlab.lab.explorable.page import render_explorable

    require_writable("--out", out, EXPORT_MARK.encode(), force=force)
    page = render_explorable()
    write_atomically(out, page)
    console.info(f"{out}: {len(page):,} bytes")
