"""The options of the command `export`, and a function for each format that writes it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Final, Literal, NamedTuple

from baldwinlab.core import console
from baldwinlab.core.errors import RefusedError
from baldwinlab.core.file_writing import write_atomically
from baldwinlab.core.files import parse_location, shorten_path
from baldwinlab.core.output_paths import EXPORT_MARK, is_study, require_writable
from baldwinlab.experiment import Experiment, assign
from baldwinlab.experiment.unused_settings import require_effect
from baldwinlab.papers.presets import LoadedExperiment, load_with_origin
from baldwinlab.studies.store import StudyStore

Moment = Literal["birth", "death"]
Format = Literal[
    "csv",
    "parquet",
    "zarr",
    "phylogeny",
    "tskit",
    "onnx",
    "ro-crate",
    "page",
    "explorable",
    "lesson",
]


DEFAULT_LESSON_FOLDER: Final = Path("lessons")


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


def _write_table(options: ExportOptions) -> None:
    """Write all results of a study as CSV, Parquet or Zarr."""
    # Imported late: loading it takes a while.
    from baldwinlab.api.study import Study

    out = options.out
    assert out is not None
    study = Study(options.store)
    write = {"zarr": study.to_zarr, "parquet": study.to_parquet, "csv": study.to_csv}
    write[options.format](out, force=options.force)
    n_runs = sum(len(study.runs(condition)) for condition in study.conditions)
    console.info(f"{out}: {n_runs:,} runs")


def _write_phylogeny(options: ExportOptions) -> None:
    from baldwinlab.api.export.files import write_phylogeny

    assert options.out is not None
    n_agents = write_phylogeny(
        options.store, options.out, options.condition, options.run, force=options.force
    )
    console.info(f"{options.out}: {n_agents:,} agents")


def _write_tree_sequence(options: ExportOptions) -> None:
    from baldwinlab.api.export.tree_sequence import write_tree_sequence

    assert options.out is not None
    n_trees, n_individuals = write_tree_sequence(
        options.store, options.out, options.condition, options.run, force=options.force
    )
    console.info(f"{options.out}: {n_trees:,} trees, {n_individuals:,} individuals")


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
    n_weights = write_onnx(
        store, options.out, condition, key, moment=options.moment, force=options.force
    )
    console.info(f"{options.out}: {n_weights:,} weights at {options.moment}")


def _write_crate(options: ExportOptions) -> None:
    from baldwinlab.api.export.ro_crate import write_crate

    path = write_crate(options.store, options.authors, options.license, force=options.force)
    console.info(f"RO-Crate: {shorten_path(path)}")


def require_page_output(options: ExportOptions) -> None:
    """Raise RefusedError if the page cannot be written."""
    assert options.out is not None
    require_writable("--out", options.out, EXPORT_MARK.encode(), force=options.force)


def _write_page(options: ExportOptions) -> None:
    # Imported late: loading the engine takes a while.
    from baldwinlab.engine.wasm import find_linker
    from baldwinlab.lab.pages.export import render_live_page, require_browser_support
    from baldwinlab.models.miniworld.backends.wasm_modules import is_module_available

    assert options.out is not None
    experiments, study_seed = _load_experiments(options.source, options.assignments)
    if not all(map(is_module_available, require_browser_support(experiments))):
        find_linker()
        console.info("Compiling for browsers, which takes about a minute.")
    seed = study_seed if options.seed is None else options.seed
    page = render_live_page(experiments, seed)
    write_atomically(options.out, page)
    names = ", ".join(experiment.name for experiment in experiments)
    console.info(f"{options.out}: {names}; {len(page):,} bytes")


def _write_explorable(options: ExportOptions) -> None:
    """Write the essay on the Baldwin effect whose pictures simulate."""
    # Imported late: loading the engine takes a while.
    from baldwinlab.lab.pages.explorable.page import render_explorable

    assert options.out is not None
    page = render_explorable()
    write_atomically(options.out, page)
    console.info(f"{options.out}: {len(page):,} bytes")


def _write_lessons(options: ExportOptions) -> None:
    """Write the folder of the teaching pack."""
    folder = options.out or DEFAULT_LESSON_FOLDER
    _require_lesson_folder(folder, force=options.force)
    # Imported late: loading the engine takes a while.
    from baldwinlab.lab.pages.lesson_pack import STUDENTS_FOLDER, render_lesson_pack

    pages = render_lesson_pack()
    for path, content in pages.items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        write_atomically(folder / path, content)
    console.info(f"{folder}: {len(pages)} pages. Open {folder / 'index.html'}")
    console.info(f"Students need only the folder {folder / STUDENTS_FOLDER}")


def _require_lesson_folder(folder: Path, *, force: bool) -> None:
    """Raise RefusedError for a file, a study, and a folder with files of another program."""
    if folder.is_file() or is_study(folder):
        kind = "file" if folder.is_file() else "study"
        raise RefusedError(f"--out {folder} is a {kind}. Give the path of another folder.")
    if not folder.parent.is_dir():
        raise RefusedError(
            f"--out {folder}: the folder {folder.parent} does not exist. Create it or choose "
            "another path."
        )
    first_page = folder / "index.html"
    if not folder.exists():
        return
    if any(folder.iterdir()) and not first_page.exists() and not force:
        raise RefusedError(
            f"--out {folder} contains files that this command did not write. Choose another path "
            "or add --force."
        )
    require_writable("--out", first_page, EXPORT_MARK.encode(), force=force)


def _load_experiments(source: str, assignments: list[str]) -> tuple[list[Experiment], int]:
    """Return the experiments and the seed of a study; or a single experiment and the seed 0."""
    if is_study(Path(source)):
        store = StudyStore(Path(source))
        seed = store.seed
        stored = [store.experiment(name) for name in store.experiments]
        loaded = [LoadedExperiment(experiment, origin=experiment) for experiment in stored]
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
    "explorable": _write_explorable,
    "lesson": _write_lessons,
}
