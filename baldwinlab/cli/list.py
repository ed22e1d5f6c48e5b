"""The command `list`: list papers, presets or parts."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any, Final, Literal

from cyclopts import Parameter

from baldwinlab import papers
from baldwinlab.cli.options import Json, read_docstring
from baldwinlab.core import console
from baldwinlab.experiment import registry
from baldwinlab.papers import Paper, presets

MAX_LISTED_CONDITIONS: Final = 6
"""Maximum number of listed conditions per paper."""
PRESET_NAME_WIDTH: Final = 22
"""Width of the column with the names of presets, in characters."""
Entry = dict[str, Any]


def list_names(
    kind: Annotated[Literal["papers", "presets", "parts"], Parameter(help="Kind of names.")],
    /,
    *,
    json: Json = False,
) -> None:
    """List the papers, the presets or the built-in parts, each with one line that describes it.

    Papers are arguments of `reproduce`. Presets are arguments of `run` and `show`. Parts are values
    of settings, such as --set learning.rule=hebb.

    For example:

        baldwinlab list presets
    """
    if json:
        console.print_json(COLLECT_ENTRIES[kind]())
    else:
        PRINT_NAMES[kind]()


def _collect_papers() -> list[Entry]:
    return [
        {
            "name": paper.name,
            "title": paper.metadata.title,
            "description": paper.metadata.description,
            "source": paper.metadata.source,
            "text_source": paper.metadata.text_source,
            "link": paper.metadata.link,
            "year": paper.metadata.year,
            "conditions": list(paper.study_names()),
            "claims": len(paper.claims),
        }
        for paper in papers.built_in().values()
    ]


def _collect_presets() -> list[Entry]:
    return [
        {"paper": paper.name, "kind": kind, "name": name, "text": paper.describe(kind, name)}
        for paper in papers.built_in().values()
        for kind in presets.PRESET_KINDS
        for name in paper.names(kind)
    ]


def _collect_parts() -> list[Entry]:
    return [
        {"kind": kind, "name": name, "text": _read_summary(address)}
        for kind in registry.BUILT_IN
        for name, address in registry.package_parts(kind).items()
    ]


def _list_papers() -> None:
    built_in_papers = papers.built_in().values()
    name_width = max(len(paper.name) for paper in built_in_papers)
    for paper in built_in_papers:
        console.info(f"{paper.name:<{name_width}} {paper.metadata.source}")
        for line in _describe_paper(paper):
            console.info(f"{'':<{name_width}} {line}")
    console.info(
        "`baldwinlab reproduce PAPER` reproduces a paper; PAPER is a name from this list, or the "
        "folder of a custom paper"
    )


def _describe_paper(paper: Paper) -> list[str]:
    conditions = paper.study_names()
    counts = f"conditions: {len(conditions)}, claims: {len(paper.claims)}"
    if paper.metadata.text_source:
        counts = f"{counts} ({paper.metadata.text_source})"
    n_unlisted = len(conditions) - MAX_LISTED_CONDITIONS
    names = ", ".join(conditions[:MAX_LISTED_CONDITIONS])
    if n_unlisted > 0:
        names = f"{names} and {n_unlisted} more"
    return [
        paper.metadata.description,
        ", ".join(filter(None, [counts, paper.metadata.link])),
        f"{paper.metadata.year}, {names}",
        f"command: baldwinlab reproduce {paper.name}",
    ]


def _list_presets() -> None:
    for paper in papers.built_in().values():
        console.info(f"{paper.name}: {paper.metadata.title}")
        for kind in presets.PRESET_KINDS:
            names = paper.names(kind)
            if names:
                console.info(f"  {kind}")
            for name in names:
                console.info(f"    {name:<{PRESET_NAME_WIDTH}} {paper.describe(kind, name)}")
    console.info(
        "An experiment is CONDITION/MAP, such as evo+self-taught/B, or PAPER:CONDITION/MAP. "
        "The option --variant chooses a variant."
    )


def _list_parts() -> None:
    for kind in registry.BUILT_IN:
        built_in = registry.package_parts(kind)
        name_width = max(map(len, built_in))
        console.info(kind)
        for name, address in built_in.items():
            console.info(f"  {name:<{name_width}} {_read_summary(address)}")
    console.info(
        "`baldwinlab show EXPERIMENT` lists the settings that choose parts; --part FILE loads "
        "custom parts"
    )


def _read_summary(address: str) -> str:
    return read_docstring(address).partition("\n")[0]


COLLECT_ENTRIES: Final[dict[str, Callable[[], list[Entry]]]] = {
    "papers": _collect_papers,
    "presets": _collect_presets,
    "parts": _collect_parts,
}
PRINT_NAMES: Final[dict[str, Callable[[], None]]] = {
    "papers": _list_papers,
    "presets": _list_presets,
    "parts": _list_parts,
}
