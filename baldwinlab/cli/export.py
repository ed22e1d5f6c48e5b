"""The command `export`: a study for third-party tools, or a page that simulates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from inspect import Parameter as SignatureParameter
from inspect import signature
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal, get_origin

from cyclopts import Parameter

from baldwinlab.api.export.formats import (
    ExportFormat,
    Option,
    list_suffixes,
    list_without_output,
    refuse_option,
    require_options,
    select_format,
    study_formats,
    write_export,
)
from baldwinlab.cli.options import Assignments, Parts, load_parts
from baldwinlab.core import console
from baldwinlab.core.errors import RefusedError
from baldwinlab.core.file_writing import hold_partial, write_atomically
from baldwinlab.core.files import (
    EXPORT_MARK,
    is_study,
    list_names,
    name_file_in_errors,
    parse_location,
    require_writable,
)
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
    # On a full disk, the first loop raises an error, and `folder` does not change.
    with name_file_in_errors(folder), hold_partial(folder, is_folder=True) as partial_folder:
        for page, content in pages.items():
            write_atomically(partial_folder / page, content)
        for page in pages:
            (folder / page).parent.mkdir(parents=True, exist_ok=True)
            (partial_folder / page).replace(folder / page)
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
    if list_names(folder) and not first_page.exists() and not force:
        raise RefusedError(
            f"--out {folder} contains files that this command did not write. Choose another path "
            "or add --force."
        )
    require_writable("--out", first_page, EXPORT_MARK.encode(), force=force)


def _load_experiments(source: str, assignments: Sequence[str]) -> tuple[list[Experiment], int]:
    """Return experiments and seed of a study, or one experiment and the seed 0 of other sources."""
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
            # An annotated type already allows None.
            is_optional = get_origin(option.type) is Annotated
            types[option.name] = option.type if is_optional else option.type | None
            # {option: {help text: [formats]}}. Formats with the same text appear in one sentence.
            helps.setdefault(option.name, {}).setdefault(option.help, []).append(format.name)
    for name, formats_of_help in helps.items():
        text = " ".join(f"{', '.join(users)}: {help}" for help, users in formats_of_help.items())
        types[name] = Annotated[types[name], Parameter(help=text)]
    return types


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
    """Raise RefusedError if the source is missing, or if the format uses no source."""
    if source and not format.source:
        raise RefusedError(
            f"{source} does not apply to --format {format.name}: its experiments are fixed"
        )
    if format.source and not source:
        raise RefusedError(
            f"SOURCE is missing: --format {format.name} needs the directory of a study"
        )


def _add_options() -> None:
    """Replace `**options` in the signature of the command by the options of all formats.

    Cyclopts reads the signature and the annotations.
    """
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
