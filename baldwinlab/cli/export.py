"""The command `export`: write a study for third-party tools, or a page that simulates."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any, Final, Literal, NamedTuple

from cyclopts import Parameter

from baldwinlab.cli.options import (
    DESCRIBED_DEFAULT,
    FLAG,
    Assignments,
    OptionalInteger,
    Parts,
    load_parts,
)
from baldwinlab.core import console
from baldwinlab.core.errors import RefusedError
from baldwinlab.core.file_writing import write_atomically
from baldwinlab.core.files import parse_location
from baldwinlab.core.output_paths import EXPORT_MARK, is_study, require_writable
from baldwinlab.experiment import Experiment, assign
from baldwinlab.experiment.unused_settings import require_effect
from baldwinlab.papers.presets import LoadedExperiment, load_with_origin
from baldwinlab.studies.store import StudyStore

Moment = Literal["birth", "death"]
Format = Literal["csv", "parquet", "zarr", "phylogeny", "tskit", "onnx", "ro-crate", "page"]
FORMAT_OF_ENDING: Final[Mapping[str, Format]] = {
    ".csv": "csv",
    ".parquet": "parquet",
    ".zarr": "zarr",
    ".trees": "tskit",
    ".onnx": "onnx",
    ".html": "page",
}
ENDING_OF_FORMAT: Final[Mapping[Format, str]] = {
    format: ending for ending, format in FORMAT_OF_ENDING.items()
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
    "--out": ("csv", "parquet", "zarr", "phylogeny", "tskit", "onnx", "page"),
}


class ExportOptions(NamedTuple):
    """The options of an export. An option that the format does not use is None or empty."""

    source: str
    format: Format
    out: Path | None
    assignments: list[str]
    seed: int | None
    condition: str | None
    run: int | None
    generation: int | None
    agent: int | None
    moment: Moment
    authors: list[str]
    license: str
    force: bool

    @property
    def store(self) -> StudyStore:
        """Return the directory of the study."""
        return StudyStore(parse_location(self.source))


def export(
    source: Annotated[
        str,
        Parameter(
            help="Directory of a study; for a page also a preset, such as evo+self-taught/B, or an "
            "experiment file (.toml)."
        ),
    ],
    /,
    *,
    format: Annotated[
        Format | None,
        Parameter(
            help="csv, parquet or zarr: all results. phylogeny: the parents of every agent. "
            "tskit: the ancestry of every gene. onnx: the network of an agent. ro-crate: metadata "
            "of the study. page: a laboratory. Default: by the ending of --out."
        ),
    ] = None,
    out: Annotated[
        Path | None,
        Parameter(
            help="File to write: .csv, .parquet, .zarr, .trees, .onnx or .html. No default, except "
            "for ro-crate, which writes ro-crate-metadata.json into the study."
        ),
    ] = None,
    part: Parts = None,
    assignments: Assignments = None,
    seed: Annotated[
        OptionalInteger,
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
        OptionalInteger,
        Parameter(
            help="phylogeny, tskit, onnx: number of a run. Default: all runs; for tskit and onnx, "
            "the only run."
        ),
    ] = None,
    generation: Annotated[
        OptionalInteger,
        DESCRIBED_DEFAULT,
        Parameter(help="onnx: number of a generation, from 0. No default."),
    ] = None,
    agent: Annotated[
        OptionalInteger,
        DESCRIBED_DEFAULT,
        Parameter(help="onnx: number of an agent, from 0. No default."),
    ] = None,
    at: Annotated[
        Moment | None,
        DESCRIBED_DEFAULT,
        Parameter(help="onnx: weights at birth or at death. Default: birth."),
    ] = None,
    author: Annotated[
        list[str] | None,
        Parameter(
            negative="",
            help="ro-crate: name of an author, optionally followed by the address of an ORCID. "
            "Repeat the option for several authors.",
        ),
    ] = None,
    license: Annotated[
        str,
        DESCRIBED_DEFAULT,
        Parameter(help="ro-crate: license of the study, an address or an SPDX name: CC-BY-4.0."),
    ] = "",
    force: Annotated[
        bool,
        FLAG,
        Parameter(
            help="Overwrite a file that this command did not write (never a Zarr store); for zarr, "
            "also run if less memory is free than the estimate."
        ),
    ] = False,
) -> None:
    """Write a study for third-party tools, or a page that simulates in the browser of its reader.

    A table (csv, parquet) has one row per agent. A phylogeny is CSV in the ALife data standard. A
    page is one HTML file that needs no server. Its results are bit-identical to those in Python.

    For example:

        baldwinlab export results/evo-A --out evo.csv
        baldwinlab export results/evo-A --format phylogeny --out parents.csv
        baldwinlab export results/evo-A --run 0 --out ancestry.trees
        baldwinlab export results/evo-A --run 0 --generation 99 --agent 3 --out network.onnx
        baldwinlab export evo+self-taught/B --out lab.html
    """
    chosen_format = format or _find_format(out)
    _require_used(
        chosen_format,
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
        source,
        chosen_format,
        out,
        assignments or [],
        seed,
        condition,
        run,
        generation,
        agent,
        at or "birth",
        author or [],
        license,
        force,
    )
    if chosen_format == "page":
        # Check the output before the engine is loaded, which takes a while.
        _require_page_output(options)
    load_parts(part)
    WRITERS[chosen_format](options)


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


def _require_used(chosen_format: Format, values: Mapping[str, Any]) -> None:
    """Raise RefusedError for an option that the format does not use, and for a wrong --out."""
    for option, value in values.items():
        is_given = value is not None and value != ""
        formats = FORMATS_OF_OPTION[option]
        if is_given and chosen_format not in formats:
            raise RefusedError(
                f"{option} applies to --format {' or '.join(formats)}, not {chosen_format}"
            )
        if option == "--out" and not is_given and chosen_format in formats:
            raise RefusedError(
                f"--out is missing: --format {chosen_format} needs the name of a file"
            )
    out = values["--out"]
    ending = ENDING_OF_FORMAT.get(chosen_format)
    if ending and out.suffix != ending:
        raise RefusedError(f"--out {out} must end in {ending}, as --format {chosen_format} needs")


def _write_table(options: ExportOptions) -> None:
    """Write all results of a study as CSV, Parquet or Zarr."""
    # Imported late: loading it takes a while.
    from baldwinlab.api.study import Study

    out = options.out
    assert out is not None
    study = Study(options.store)
    write = {"zarr": study.to_zarr, "parquet": study.to_parquet, "csv": study.to_csv}
    write[options.format](out, force=options.force)
    runs = sum(len(study.runs(condition)) for condition in study.conditions)
    console.info(f"{out}: {runs:,} runs")


def _write_phylogeny(options: ExportOptions) -> None:
    from baldwinlab.api.export.files import write_phylogeny

    assert options.out is not None
    count = write_phylogeny(
        options.store, options.out, options.condition, options.run, force=options.force
    )
    console.info(f"{options.out}: {count:,} agents")


def _write_tree_sequence(options: ExportOptions) -> None:
    from baldwinlab.api.export.tree_sequence import write_tree_sequence

    assert options.out is not None
    trees, individuals = write_tree_sequence(
        options.store, options.out, options.condition, options.run, force=options.force
    )
    console.info(f"{options.out}: {trees:,} trees, {individuals:,} individuals")


def _write_onnx(options: ExportOptions) -> None:
    from baldwinlab.api.agents import select_condition
    from baldwinlab.api.export.onnx_network import AgentKey, write_onnx
    from baldwinlab.api.export.tree_sequence import choose_run

    if options.generation is None or options.agent is None:
        raise RefusedError("--format onnx needs --generation GENERATION and --agent AGENT")
    assert options.out is not None
    store = options.store
    condition = select_condition(store, options.condition)
    run = choose_run(store, condition, options.run)
    key = AgentKey(run, options.generation, options.agent)
    count = write_onnx(
        store, options.out, condition, key, moment=options.moment, force=options.force
    )
    console.info(f"{options.out}: {count:,} weights at {options.moment}")


def _write_crate(options: ExportOptions) -> None:
    from baldwinlab.api.export.ro_crate import write_crate

    path = write_crate(options.store, options.authors, options.license, force=options.force)
    console.info(f"RO-Crate: {path}")


def _require_page_output(options: ExportOptions) -> None:
    """Raise RefusedError if the page cannot be written."""
    assert options.out is not None
    require_writable("--out", options.out, EXPORT_MARK.encode(), force=options.force)


def _write_page(options: ExportOptions) -> None:
    # Imported late: loading the engine takes a while.
    from baldwinlab.engine.wasm import find_linker
    from baldwinlab.lab.export import render_live_page
    from baldwinlab.models.miniworld.backends.wasm_modules import is_module_available

    assert options.out is not None
    experiments, study_seed = _load_experiments(options.source, options.assignments)
    foragers = [experiment for experiment in experiments if isinstance(experiment, Experiment)]
    if not all(map(is_module_available, foragers)):
        find_linker()
        console.info("Compiling for browsers, which takes about a minute.")
    page = render_live_page(experiments, study_seed if options.seed is None else options.seed)
    write_atomically(options.out, page)
    names = ", ".join(experiment.name for experiment in experiments)
    console.info(f"{options.out}: {names}; {len(page):,} bytes")


def _load_experiments(source: str, assignments: list[str]) -> tuple[list[Experiment], int]:
    """Return the experiments and the seed of a study; or a single experiment and the seed 0."""
    if is_study(Path(source)):
        store = StudyStore(Path(source))
        seed = store.seed
        stored = [store.experiment(name) for name in store.experiments]
        loaded = [LoadedExperiment(experiment, experiment) for experiment in stored]
    else:
        seed = 0
        loaded = [load_with_origin(source)]
    experiments = [assign(experiment, assignments) for experiment, _ in loaded]
    require_effect(experiments, [origin for _, origin in loaded])
    return experiments, seed


WRITERS: Final[Mapping[Format, Callable[[ExportOptions], None]]] = {
    "csv": _write_table,
    "parquet": _write_table,
    "zarr": _write_table,
    "phylogeny": _write_phylogeny,
    "tskit": _write_tree_sequence,
    "onnx": _write_onnx,
    "ro-crate": _write_crate,
    "page": _write_page,
}
