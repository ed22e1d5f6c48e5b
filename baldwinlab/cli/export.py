"""The command `export`: a study for third-party tools, or a page that simulates."""

from __future__ import annotations

from collections.abc import Mapping
from inspect import Parameter as SignatureParameter
from inspect import signature
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal, get_origin

from cyclopts import Parameter

from baldwinlab.api.export.formats import (
    ExportFormat,
    list_suffixes,
    list_without_output,
    refuse_option,
    require_options,
    select_format,
    study_formats,
    write_export,
)
from baldwinlab.cli.export_pages import PAGE_FORMATS
from baldwinlab.cli.options import (
    Parts,
    load_parts,
)
from baldwinlab.core import console
from baldwinlab.core.errors import RefusedError
from baldwinlab.core.files import parse_location
from baldwinlab.studies.store import StudyStore

FORMATS: Final[Mapping[str, ExportFormat]] = {
    **study_formats(),
    **{format.name: format for format in PAGE_FORMATS},
}


def _list_option_types() -> dict[str, Any]:
    """Return the type and the help of the options of all formats, by name."""
    helps: dict[str, dict[str, list[str]]] = {}
    types: dict[str, Any] = {}
    for format in FORMATS.values():
        for option in format.options:
            types[option.name] = _make_optional(option.type)
            # Formats with the same text share it.
            helps.setdefault(option.name, {}).setdefault(option.help, []).append(format.name)
    for name, formats_of_help in helps.items():
        text = " ".join(f"{', '.join(users)}: {help}" for help, users in formats_of_help.items())
        types[name] = Annotated[types[name], Parameter(help=text)]
    return types


def _make_optional(kind: Any) -> Any:
    """Return the type of an option that can be omitted. An annotated type is one already."""
    return kind if get_origin(kind) is Annotated else kind | None


if TYPE_CHECKING:
    FormatName = str
else:
    FormatName = Literal[*FORMATS]

_CONTENTS = " ".join(f"{format.name}: {format.content}." for format in FORMATS.values())
_SUFFIXES = ", ".join(list_suffixes(FORMATS))
_WITHOUT_SOURCE = " and ".join(format.name for format in PAGE_FORMATS if not format.source)
_WITHOUT_OUTPUT = " and ".join(list_without_output(FORMATS))


def export(
    source: Annotated[
        str,
        Parameter(
            help="Directory of a study; for a page also a preset, such as evo+self-taught/B, or an "
            f"experiment file (.toml). No default; {_WITHOUT_SOURCE} have none."
        ),
    ] = "",
    /,
    *,
    format: Annotated[
        FormatName | None,
        Parameter(help=f"{_CONTENTS} Default: by the ending of --out."),
    ] = None,
    out: Annotated[
        Path | None,
        Parameter(help=f"File to write: {_SUFFIXES}. No default; {_WITHOUT_OUTPUT} need none."),
    ] = None,
    part: Parts = None,
    force: Annotated[
        bool,
        Parameter(
            help="Overwrite a file that this command did not write (never a Zarr store); for zarr, "
            "also run if less memory is free than the estimate."
        ),
    ] = False,
    **options: Any,
) -> None:
    """Write a study for third-party tools, or a page that simulates in the browser of its reader.

    A page is one HTML file that needs no server. Its results are bit-identical to those in Python.
    A lesson is a folder of pages: lessons, worksheets, answers, and two pages that simulate.

    For example:

        baldwinlab export results/evo-A --out evo.csv
        baldwinlab export results/evo-A --format phylogeny --out parents.csv
        baldwinlab export results/evo-A --run 0 --out ancestry.trees
        baldwinlab export results/evo-A --run 0 --generation 99 --agent 3 --out network.onnx
        baldwinlab export evo+self-taught/B --out lab.html
        baldwinlab export --format explorable --out baldwin.html
        baldwinlab export --format lesson
    """
    selected = select_format(FORMATS, format, out)
    _require_source(source, selected)
    if part and not selected.uses_parts:
        users = [other.name for other in FORMATS.values() if other.uses_parts]
        refuse_option("--part", users, selected)
    given = {name: value for name, value in options.items() if value is not None}
    require_options(FORMATS, selected, out, given)
    load_parts(part)
    location = StudyStore(parse_location(source)) if selected.source == "study" else source
    console.info(write_export(FORMATS, selected, location, out, given, force=force))


def _require_source(source: str, format: ExportFormat) -> None:
    """Raise RefusedError if a study or preset is missing, or has no effect."""
    if source and not format.source:
        raise RefusedError(
            f"{source} does not apply to --format {format.name}: its experiments are fixed"
        )
    if format.source and not source:
        raise RefusedError(
            f"SOURCE is missing: --format {format.name} needs the directory of a study"
        )


def _add_options() -> None:
    """Replace `**options` in the signature of the command by the options of all formats."""
    types = _list_option_types()
    own_signature = signature(export)
    parameters = [
        parameter
        for parameter in own_signature.parameters.values()
        if parameter.kind is not SignatureParameter.VAR_KEYWORD
    ]
    parameters += [
        SignatureParameter(name, SignatureParameter.KEYWORD_ONLY, default=None) for name in types
    ]
    export.__annotations__ |= types
    export.__dict__["__signature__"] = own_signature.replace(parameters=parameters)


_add_options()
