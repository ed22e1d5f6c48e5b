"""What a study is, for those who find it."""

from __future__ import annotations

from typing import Annotated

from cyclopts import Parameter

from baldwinlab.api.export.ro_crate import write_crate
from baldwinlab.cli.options import Directory, Force, Parts, load_parts
from baldwinlab.core import console
from baldwinlab.studies.store import StudyStore


def crate(
    directory: Directory,
    /,
    *,
    author: Annotated[
        list[str] | None,
        Parameter(negative="", help="a name, which the address of an ORCID may follow; repeatable"),
    ] = None,
    license: Annotated[
        str, Parameter(help="how it may be used: an address, or a name of SPDX such as CC-BY-4.0")
    ] = "",
    part: Parts = None,
    force: Force = False,
) -> None:
    """Write an RO-Crate's metadata into a study's directory: who made it, what it holds, how it came about, by which versions."""
    load_parts(part)
    console.info(
        f"RO-Crate: {write_crate(StudyStore(directory), author or (), license, force=force)}"
    )
