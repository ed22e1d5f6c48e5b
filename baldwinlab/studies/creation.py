"""Creation of a study by one or several processes, and extension of a study by generations.

An extension writes each `experiment.toml` again. Stored generations do not change. If the process
is killed before all files are written, the same command writes the remaining files. If a command
raises an error before the first result is stored, the new study is removed.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final

from baldwinlab.core.errors import InterruptedStudyError
from baldwinlab.core.file_writing import remove_file, write_atomically, write_exclusively
from baldwinlab.core.files import (
    PARTIAL_SUFFIX,
    STUDY_FILE_NAME,
    enclosing_study,
    find_paths,
    is_local,
    is_study,
    list_names,
    make_absolute,
    require_inside_study,
)
from baldwinlab.core.names import find_case_collision, find_name_fault
from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.experiment.conditions import CONDITIONS, SWEEP, Factors, StudyKind
from baldwinlab.experiment.file import iterate_file_tables, require_files
from baldwinlab.experiment.toml import to_toml
from baldwinlab.studies.progress import FILE_PREFIX
from baldwinlab.studies.records import StudyError
from baldwinlab.studies.store import StudyStore, read_experiment
from baldwinlab.studies.study_file import (
    INPUT_FOLDER,
    PartRecord,
    StudyFile,
    add_checksum,
    collect_sources,
    format_study,
    name_copies,
    save_sources,
    write_copies,
)
from baldwinlab.studies.study_length import change_length

if TYPE_CHECKING:
    from baldwinlab.parts.loading import Source

# Suffixes of the files of a study. The name of a condition must not end in them.
RESERVED_SUFFIXES = (".nc", ".toml", ".damaged")
HASH_PATTERN = re.compile("[0-9a-f]{64}")
# Text for a setting that exists in only one of two compared experiments.
NOT_SET = "not set"
GENERATIONS_FIELD: Final = "evolution.generations"
# Folders of a study before the first result.
STUDY_FOLDERS: Final = ("runs", "parts", "inputs", "founders")

RESULT_SUFFIXES: Final = (".nc", ".checkpoint", ".jsonl")
"""Suffixes of files with results of a simulation."""


def create_study(
    directory: Path,
    experiments: Sequence[Experiment],
    seed: int,
    kind: StudyKind = CONDITIONS,
    *,
    factors: Mapping[str, Factors] = MappingProxyType({}),
    paper: str = "",
    changes: Sequence[str] = (),
    first_run: int = 0,
) -> StudyStore:
    """Create a study, or open the existing study if it has the same settings.

    - `factors`: factors by name of condition. Except in a sweep, the default of the factor
      `learner` is the name of the condition.
    - `paper`: name of the reproduced paper, "" for none.
    - `changes`: assignments that changed the model of the paper.
    """
    names = [experiment.name for experiment in experiments]
    if len(set(names)) < len(names):
        repeated = next(name for name in names if names.count(name) > 1)
        raise StudyError(
            f"two conditions have the same name, {repeated!r}: change name in one of them"
        )
    for name in names:
        if any(folder.casefold().endswith(RESERVED_SUFFIXES) for folder in name.split("/")):
            raise StudyError(
                f"no condition can be called {name!r}: a study has files with such endings"
            )
    _require_portable_names(names)
    if is_local(directory) and (outer_study := enclosing_study(directory)):
        raise StudyError(f"{directory} is inside the study {outer_study}. Choose another path.")
    is_new = False
    if not is_study(directory):
        sources = collect_sources(experiments)
        for experiment in experiments:
            require_files(experiment, where="")
        # The points of a sweep have no factors.
        names_with_factors = () if kind == SWEEP else names
        content = StudyFile(
            kind=kind,
            seed=seed,
            conditions=tuple(names),
            paper=paper,
            changes=tuple(changes),
            first_run=first_run,
            parts=tuple(
                PartRecord(kind=source.kind, name=source.name, sha256=source.sha256)
                for source in sources
            ),
            factors={name: _complete_factors(name, factors) for name in names_with_factors},
        )
        try:
            is_new = _write_study(directory, name_copies(experiments), sources, content)
        except OSError as error:
            raise StudyError(
                f"{error.filename or directory} cannot be written: {error.strerror or error}"
            ) from None
    study = StudyStore(directory)
    if not is_new:
        study.require_parts()
        _require_same(study, experiments, seed, kind, paper)
        if study.first_run != first_run:
            raise StudyError(
                f"{directory} holds another study: its first run is {study.first_run}, "
                f"not {first_run}; choose another --out"
            )
    return study


def _complete_factors(name: str, factors: Mapping[str, Factors]) -> Factors:
    """Return the stored factors of a condition, with its name as the default learner."""
    condition_factors = factors.get(name, Factors())
    return condition_factors._replace(learner=condition_factors.learner or name, world="")


def _require_portable_names(names: Sequence[str]) -> None:
    """Raise StudyError if conditions cannot be folders on macOS or Windows."""
    for name in names:
        if fault := find_name_fault(name):
            raise StudyError(
                f"no condition can be called {name!r}: {fault}; change its name, so that the study "
                "can be copied and read everywhere"
            )
    if pair := find_case_collision(names):
        raise StudyError(
            f"the conditions {pair[0]!r} and {pair[1]!r} differ only in capital letters, and are "
            "one folder on macOS and Windows: change name in one of them"
        )


def _write_study(
    directory: Path,
    experiments: Sequence[Experiment],
    sources: Sequence[Source],
    content: StudyFile,
) -> bool:
    """Write a new study. Return False if another process has written another one first."""
    require_available(directory)
    # Two processes may create different studies here at the same time. Both write the conditions in
    # alphabetical order, so the slower process finds a different file and raises an error.
    write_copies(directory, experiments)
    experiments_in_order = sorted(experiments, key=lambda experiment: experiment.name)
    for experiment in experiments_in_order:
        _write_experiment(directory, experiment)
    save_sources(directory, sources)
    try:
        write_exclusively(directory / STUDY_FILE_NAME, format_study(content).encode())
    except FileExistsError:
        return False
    return True


def _write_experiment(directory: Path, experiment: BaseExperiment) -> None:
    """Write a condition of a new study. Raises StudyError if the file has another experiment."""
    path = directory / "runs" / experiment.name / "experiment.toml"
    require_inside_study(path, directory)
    try:
        write_exclusively(path, add_checksum(to_toml(experiment)).encode())
    except FileExistsError:
        if _describe_identity(read_experiment(path)) != _describe_identity(experiment):
            raise StudyError(
                f"{directory} holds the beginning of another study; choose another --out"
            ) from None


def require_available(directory: Path) -> None:
    """Raise StudyError if a directory without a study holds files that belong to no study."""
    names = list_names(directory) if directory.exists() else {}
    is_available = all(_is_study_entry(directory / name) for name in names)
    if not is_available and not is_study(directory):
        raise StudyError(f"{directory} is not empty and holds no study; choose another --out")
    # Without study.toml, a write could follow a link out of the folder.
    for name in STUDY_FOLDERS:
        require_inside_study(directory / name / STUDY_FILE_NAME, directory)


def _is_study_entry(entry: Path) -> bool:
    """Return whether an entry can belong to an unfinished study, or to a study in a subfolder."""
    is_study_folder = entry.name in STUDY_FOLDERS
    is_partial_file = entry.name.endswith(PARTIAL_SUFFIX)
    is_other_study = (entry / "runs").is_dir()
    return is_study_folder or is_partial_file or is_other_study


def _require_same(
    study: StudyStore, experiments: Sequence[Experiment], seed: int, kind: StudyKind, paper: str
) -> None:
    n_points = len(study.experiments)
    if study.kind == kind == SWEEP and n_points != len(experiments):
        raise StudyError(
            f"{study.location} holds another sweep: of {n_points} points, not {len(experiments)}; "
            "choose another --out"
        )
    where = f"{study.location} holds another study"
    if study.seed != seed:
        raise StudyError(f"{where}: its seed is {study.seed}, not {seed}; choose another --out")
    if paper and study.paper not in (paper, ""):
        raise StudyError(
            f"{where}: it is of the paper {study.paper}, not {paper}; choose another --out"
        )
    names = [experiment.name for experiment in experiments]
    if list(study.experiments) != names:
        stored_names = _join_names(list(study.experiments))
        raise StudyError(
            f"{where}: its conditions are {stored_names}, not {_join_names(names)}; "
            "choose another --out"
        )
    for experiment in experiments:
        stored_fields = _describe_identity(study.experiments[experiment.name])
        # The first difference is sufficient for a message.
        for path, stored, given in _list_differences(stored_fields, _describe_identity(experiment)):
            if path.startswith("evolution.founders"):
                raise StudyError(
                    f"{study.location} holds a study with other founders; choose another --out"
                )
            difference = _describe_difference(f"{path} of {experiment.name}", stored, given)
            raise StudyError(f"{where}: {difference}; choose another --out")


def _describe_difference(name: str, stored: Any, given: Any) -> str:
    """Return a clause about two values of a setting. The hash of a data file is not shown."""
    if HASH_PATTERN.search(f"{stored} {given}"):
        return f"the data file of {name.replace('.sha256 of', ' of')} has other content"
    return f"{name} is {stored}, not {given}"


def _describe_identity(experiment: BaseExperiment) -> dict[str, Any]:
    """Return the settings of an experiment, with the content of a data file instead of its path."""
    tree = experiment.to_dict()
    for _, table in iterate_file_tables(tree):
        table["path"] = ""
    return tree


def _join_names(names: Sequence[str]) -> str:
    """Return the first names, separated by commas, and the number of the remaining names."""
    limit = 10
    more = f" and {len(names) - limit:,} more" if len(names) > limit else ""
    return ", ".join(names[:limit]) + more


def _list_differences(stored: Any, given: Any, path: str = "") -> Iterator[tuple[str, Any, Any]]:
    """Yield the path, the stored and the given value of each field that differs."""
    if isinstance(stored, dict) and isinstance(given, dict):
        for key in stored | given:
            key_path = f"{path}.{key}" if path else key
            stored_value = stored.get(key, NOT_SET)
            yield from _list_differences(stored_value, given.get(key, NOT_SET), key_path)
    elif stored != given:
        yield path, stored, given


def extend_study(study: StudyStore, generations: int) -> StudyStore:
    """Set the number of generations of all conditions of a study.

    `generations`: at least the present number of generations of each condition. For a smaller
    number, for a sweep or a multiverse, and while another process simulates the study, the function
    raises `StudyError` before it writes.
    """
    extended = extend_experiments(study, generations)
    if extended == study.experiments:
        return study
    with change_length(study):
        for name, experiment in extended.items():
            path = study.directory / "runs" / name / "experiment.toml"
            write_atomically(path, add_checksum(to_toml(experiment)).encode())
        if study.paper:
            _add_change(study, f"{GENERATIONS_FIELD}={generations}")
    return StudyStore(study.directory)


def extend_experiments(study: StudyStore, generations: int) -> dict[str, Experiment]:
    """Return the conditions of a study with more generations. Raise as `extend_study`."""
    if study.kind != CONDITIONS:
        raise StudyError(
            f"{study.location} is a {study.kind}, and only a study of conditions can be extended"
        )
    study.require_parts()
    for name, experiment in study.experiments.items():
        stored_generations = experiment.evolution.generations
        if generations < stored_generations:
            raise StudyError(
                f"generations = {generations} must be at least {stored_generations}, "
                f"the generations of {name} in {study.location}: "
                "an extension removes no generation"
            )
    return {
        name: experiment.replace(evolution={"generations": generations})
        for name, experiment in study.experiments.items()
    }


def _add_change(study: StudyStore, change: str) -> None:
    """Record that the study of a paper has another number of generations than the paper."""
    # The new change replaces the change of an earlier extension.
    other_changes = [text for text in study.changes if not text.startswith(f"{GENERATIONS_FIELD}=")]
    content = study.content.model_copy(update={"changes": (*other_changes, change)})
    write_atomically(study.directory / STUDY_FILE_NAME, format_study(content).encode())


@contextmanager
def remove_if_refused(directory: Path) -> Iterator[None]:
    """Remove a new study if the context raises an error before a result is stored.

    For example, a custom part is compiled after the study is created, and this can fail. A study
    that existed before, was interrupted, or is simulated by another process, is not changed.
    """
    directory = make_absolute(directory)
    if is_study(directory):
        yield
        return
    before = set(find_paths(directory, "**/*"))
    missing_folders = _list_missing_folders(directory)
    try:
        yield
    except InterruptedStudyError:
        raise
    except Exception:
        added = [path for path in find_paths(directory, "**/*") if path not in before]
        if not any(_is_result(path.relative_to(directory)) for path in added):
            _remove(directory, added, missing_folders)
        raise


def _list_missing_folders(directory: Path) -> list[Path]:
    """Return the folders that the study needs and that do not exist, the deepest first."""
    if not is_local(directory):
        return []
    return [folder for folder in (directory, *directory.parents) if not folder.exists()]


def _is_result(path: Path) -> bool:
    # The file of a process that simulates the study counts as a result.
    is_running = path.name.startswith(FILE_PREFIX)
    is_input = INPUT_FOLDER in path.parts
    return is_running or (path.suffix in RESULT_SUFFIXES and not is_input)


def _remove(directory: Path, added: list[Path], missing_folders: list[Path]) -> None:
    """Remove files, then the folders that are empty now, inner folders first."""
    folders = [path for path in added if path.is_dir()]
    for path in added:
        if path not in folders:
            remove_file(path, directory)
    for folder in (*sorted(folders, reverse=True), *missing_folders):
        # A folder is not empty if another process has written into it.
        with suppress(OSError):
            folder.rmdir()
