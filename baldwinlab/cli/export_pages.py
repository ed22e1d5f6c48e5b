"""The formats of the command `export` whose files simulate: they need the lab."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Final

from baldwinlab.api.export.formats import ExportFormat, Option
from baldwinlab.cli.options import Assignments
from baldwinlab.core import console
from baldwinlab.core.errors import RefusedError
from baldwinlab.core.file_writing import write_atomically
from baldwinlab.core.output_paths import EXPORT_MARK, is_study, require_writable
from baldwinlab.experiment import Experiment, assign
from baldwinlab.experiment.unused_settings import require_effect
from baldwinlab.papers.presets import LoadedExperiment, load_with_origin
from baldwinlab.studies.store import StudyStore

DEFAULT_LESSON_FOLDER: Final = Path("lessons")


def write_page(
    source: str,
    path: Path,
    *,
    set: Sequence[str] = (),
    seed: int | None = None,
    force: bool = False,
) -> str:
    """Write a laboratory as one HTML file."""
    # Check the output before the engine is loaded, which takes a while.
    require_writable("--out", path, EXPORT_MARK.encode(), force=force)
    from baldwinlab.engine.wasm import find_linker
    from baldwinlab.lab.pages.export import render_live_page, require_browser_support
    from baldwinlab.models.miniworld.backends.wasm_modules import is_module_available

    experiments, study_seed = _load_experiments(source, set)
    if not all(map(is_module_available, require_browser_support(experiments))):
        find_linker()
        console.info("Compiling for browsers, which takes about a minute.")
    page = render_live_page(experiments, study_seed if seed is None else seed)
    write_atomically(path, page)
    names = ", ".join(experiment.name for experiment in experiments)
    return f"{path}: {names}; {len(page):,} bytes"


def write_explorable(source: str, path: Path, *, force: bool = False) -> str:
    """Write the essay on the Baldwin effect whose pictures simulate."""
    # Check the output before the engine is loaded, which takes a while.
    require_writable("--out", path, EXPORT_MARK.encode(), force=force)
    from baldwinlab.lab.pages.explorable import render_explorable

    page = render_explorable()
    write_atomically(path, page)
    return f"{path}: {len(page):,} bytes"


def write_lessons(source: str, path: Path | None, *, force: bool = False) -> str:
    """Write the folder of the teaching pack."""
    folder = path or DEFAULT_LESSON_FOLDER
    _require_lesson_folder(folder, force=force)
    # Imported late: loading the engine takes a while.
    from baldwinlab.lab.pages.lesson_pack import STUDENTS_FOLDER, render_lesson_pack

    pages = render_lesson_pack()
    for page, content in pages.items():
        (folder / page).parent.mkdir(parents=True, exist_ok=True)
        write_atomically(folder / page, content)
    return (
        f"{folder}: {len(pages)} pages. Open {folder / 'index.html'}\n"
        f"Students need only the folder {folder / STUDENTS_FOLDER}"
    )


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


def _load_experiments(source: str, assignments: Sequence[str]) -> tuple[list[Experiment], int]:
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


PAGE_FORMATS: Final = (
    ExportFormat(
        name="page",
        content="a web page in which the experiments run",
        write=write_page,
        suffix=".html",
        options=(
            Option(
                "set",
                Assignments,
                "change one or more settings, for example learning.rate=0.05 population.size=30. "
                "`baldwinlab show EXPERIMENT` lists all settings.",
            ),
            Option("seed", int, "first seed. Default: the seed of the study, or 0."),
        ),
        source="experiment",
        uses_parts=True,
    ),
    ExportFormat(
        name="explorable",
        content="an essay on the Baldwin effect whose pictures simulate",
        write=write_explorable,
        suffix=".html",
        source="",
    ),
    ExportFormat(
        name="lesson",
        content="the teaching pack, a folder, by default lessons",
        write=write_lessons,
        source="",
        output="optional",
    ),
)
