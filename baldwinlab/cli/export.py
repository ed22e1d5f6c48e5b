"""The command `export`: a study for third-party tools, or a page that simulates."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Final, get_args

from cyclopts import Parameter

from baldwinlab.cli.export_formats import (
    WRITERS,
    ExportOptions,
    Format,
    Moment,
    require_page_output,
)
from baldwinlab.cli.options import (
    Assignments,
    Parts,
    load_parts,
)
from baldwinlab.core.errors import RefusedError

FORMAT_OF_ENDING: Final[Mapping[str, Format]] = {
    ".csv": "csv",
    ".parquet": "parquet",
    ".zarr": "zarr",
    ".trees": "tskit",
    ".onnx": "onnx",
    ".html": "page",
}
ENDING_OF_FORMAT: Final[Mapping[Format, str]] = {
    **{format: ending for ending, format in FORMAT_OF_ENDING.items()},
    "explorable": ".html",
}
# The formats to which an option applies. Other options apply to all formats.
FORMATS_OF_OPTION: Final[Mapping[str, tuple[Format, ...]]] = {
    "--part": ("page", "phylogeny", "tskit", "onnx", "ro-crate"),
    "--set": ("page",),
    "--seed": ("page",),
    "--condition": ("phylogeny", "tskit", "onnx"),
    "--run": ("phylogeny", "tskit", "onnx"),
    "--generation": ("onnx",),
    "--agent": ("onnx",),
    "--at": ("onnx",),
    "--author": ("ro-crate",),
    "--license": ("ro-crate",),
    "--out": tuple(format for format in get_args(Format) if format != "ro-crate"),
}
# The formats whose experiments are fixed.
FORMATS_WITHOUT_SOURCE: Final[tuple[Format, ...]] = ("explorable", "lesson")
# The formats that have a default output.
FORMATS_WITH_DEFAULT_OUTPUT: Final[tuple[Format, ...]] = ("ro-crate", "lesson")


def export(
    source: Annotated[
        str,
        Parameter(
            help="Directory of a study; for a page also a preset, such as evo+self-taught/B, or an "
            "experiment file (.toml). No default; explorable and lesson have none."
        ),
    ] = "",
    /,
    *,
    format: Annotated[
        Format | None,
        Parameter(
            help="csv, parquet or zarr: all results. phylogeny: the parents of every agent. "
            "tskit: the ancestry of every gene. onnx: the network of an agent. ro-crate: metadata "
            "of the study. page: a laboratory. explorable: an essay on the Baldwin effect. "
            "lesson: the teaching pack. Default: by the ending of --out."
        ),
    ] = None,
    out: Annotated[
        Path | None,
        Parameter(
            help="File to write: .csv, .parquet, .zarr, .trees, .onnx or .html; for lesson, a "
            "folder, by default lessons. No default for other formats, except for ro-crate, which "
            "writes ro-crate-metadata.json into the study."
        ),
    ] = None,
    part: Parts = None,
    assignments: Assignments = None,
    seed: Annotated[
        int | None,
        Parameter(help="page: first seed. Default: the seed of the study, or 0."),
    ] = None,
    condition: Annotated[
        str | None,
        Parameter(
            help="phylogeny, tskit, onnx: a condition. Default: all conditions; for tskit and "
            "onnx, the only condition."
        ),
    ] = None,
    run: Annotated[
        int | None,
        Parameter(
            help="phylogeny, tskit, onnx: number of a run. Default: all runs; for tskit and onnx, "
            "the only run."
        ),
    ] = None,
    generation: Annotated[
        int | None,
        Parameter(help="onnx: number of a generation, from 0. No default."),
    ] = None,
    agent: Annotated[
        int | None,
        Parameter(help="onnx: number of an agent, from 0. No default."),
    ] = None,
    at: Annotated[
        Moment | None,
        Parameter(help="onnx: weights at birth or at death. Default: birth."),
    ] = None,
    author: Annotated[
        list[str] | None,
        Parameter(
            help="ro-crate: name of an author, optionally followed by the address of an ORCID. "
            "Repeat the option for several authors.",
        ),
    ] = None,
    license: Annotated[
        str,
        Parameter(help="ro-crate: license of the study, an address or an SPDX name: CC-BY-4.0."),
    ] = "",
    force: Annotated[
        bool,
        Parameter(
            help="Overwrite a file that this command did not write (never a Zarr store); for zarr, "
            "also run if less memory is free than the estimate."
        ),
    ] = False,
) -> None:
    """Write a study for third-party tools, or a page that simulates in the browser of its reader.

    A table (csv, parquet) has one row per agent. A phylogeny is CSV in the ALife data standard. A
    page is one HTML file that needs no server. Its results are bit-identical to those in Python.
    The explorable is such a file, too: an essay whose pictures simulate. A lesson is a folder of
    pages: lessons, worksheets, answers, and two pages that simulate.

    For example:

        baldwinlab export results/evo-A --out evo.csv
        baldwinlab export results/evo-A --format phylogeny --out parents.csv
        baldwinlab export results/evo-A --run 0 --out ancestry.trees
        baldwinlab export results/evo-A --run 0 --generation 99 --agent 3 --out network.onnx
        baldwinlab export evo+self-taught/B --out lab.html
        baldwinlab export --format explorable --out baldwin.html
        baldwinlab export --format lesson
    """
    export_format = format or _find_format(out)
    _require_source(source, export_format)
    _require_applicable(
        export_format,
        {
            "--part": part,
            "--set": assignments,
            "--seed": seed,
            "--condition": condition,
            "--run": run,
            "--generation": generation,
            "--agent": agent,
            "--at": at,
            "--author": author,
            "--license": license,
            "--out": out,
        },
    )
    options = ExportOptions(
        source=source,
        format=export_format,
        out=out,
        assignments=assignments or [],
        seed=seed,
        condition=condition,
        run=run,
        generation=generation,
        agent=agent,
        moment=at or "birth",
        authors=author or [],
        license=license,
        force=force,
    )
    if export_format in ("page", "explorable"):
        # Check the output before the engine is loaded, which takes a while.
        require_page_output(options)
    load_parts(part)
    WRITERS[export_format](options)


def _find_format(out: Path | None) -> Format:
    """Return the format of a file ending. Raise RefusedError for a missing or other ending."""
    if out is None:
        raise RefusedError(
            "--out is missing: give a file that ends in .csv, .parquet, .zarr, .trees, .onnx or "
            ".html; only --format ro-crate needs no file"
        )
    if out.suffix not in FORMAT_OF_ENDING:
        raise RefusedError(
            f"--out {out} must end in .html for a page, .trees for a tree sequence, .onnx for a "
            "network, or in .zarr, .parquet or .csv for the results of a study; or give --format"
        )
    return FORMAT_OF_ENDING[out.suffix]


def _require_source(source: str, export_format: Format) -> None:
    """Raise RefusedError if a study or preset is missing, or has no effect."""
    is_fixed = export_format in FORMATS_WITHOUT_SOURCE
    if is_fixed and source:
        raise RefusedError(
            f"{source} does not apply to --format {export_format}: its experiments are fixed"
        )
    if not is_fixed and not source:
        raise RefusedError(
            f"SOURCE is missing: --format {export_format} needs the directory of a study"
        )


def _require_applicable(export_format: Format, values: Mapping[str, Any]) -> None:
    """Raise RefusedError for an option that the format does not use, and for a wrong --out.

    `values` are the values of the options, by option.
    """
    for option, value in values.items():
        is_given = value is not None and value != ""
        formats = FORMATS_OF_OPTION[option]
        if is_given and export_format not in formats:
            raise RefusedError(
                f"{option} applies to --format {' or '.join(formats)}, not {export_format}"
            )
    out = values["--out"]
    if out is None and export_format not in FORMATS_WITH_DEFAULT_OUTPUT:
        raise RefusedError(f"--out is missing: --format {export_format} needs the name of a file")

    ending = ENDING_OF_FORMAT.get(export_format)
    if ending and out.suffix != ending:
        raise RefusedError(f"--out {out} must end in {ending}, as --format {export_format} needs")
