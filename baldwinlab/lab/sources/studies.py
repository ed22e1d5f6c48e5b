"""The studies in the folder of a lab: access, and summaries of their conditions, runs and parts.

Paths outside the folder are rejected. If the parts of a study are not loaded, the lab shows the
results of the study, but it cannot simulate the lifetimes.
"""

from __future__ import annotations

import shlex
from collections.abc import Iterable, Iterator
from hashlib import sha256
from pathlib import Path
from typing import Any, Final

from baldwinlab import papers
from baldwinlab.core.errors import BaldwinLabError, PartError
from baldwinlab.core.files import (
    PART_FILE,
    STUDY_FILE_NAME,
    quote_path,
    read_bytes,
    read_change_time,
    walk_folders,
)
from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.experiment.registry import EXECUTION_HINT
from baldwinlab.lab import Lab, MissingError, Query, read_number, read_text
from baldwinlab.lab.sources.model_displays import read_alleles, read_views
from baldwinlab.studies.records import StudyError
from baldwinlab.studies.store import StudyStore
from baldwinlab.studies.study_file import PartRecord, stored_source
from baldwinlab.studies.sweeps import design as sweeps

NANOSECONDS_PER_SECOND: Final = 1e9
# One study per folder, with the identity of the `study.toml` that it was read from.
_cache: Final = dict[Path, tuple[tuple[int, ...], StudyStore]]()


def list_study_names(root: Path) -> Iterator[str]:
    """Yield the path of each study in a folder, relative to the folder. "." is the folder itself.

    A link to a study is listed. Links to other folders are not followed.
    """
    for folder, subfolders, files in walk_folders(root):
        if STUDY_FILE_NAME in files:
            yield folder.relative_to(root).as_posix()
        for path in map(folder.joinpath, subfolders):
            if path.is_symlink() and (path / STUDY_FILE_NAME).is_file():
                yield path.relative_to(root).as_posix()
        subfolders[:] = [name for name in subfolders if name != "runs"]


def find_study(lab: Lab, name: str) -> StudyStore:
    """Return the study of this name. Raise MissingError if it does not exist."""
    path = lab.root / name / "study.toml"
    try:
        status = path.stat()
    except (OSError, ValueError):
        # `stat` raises ValueError for a name that no file can have.
        raise MissingError(f"there is no study {name!r} in {lab.root}") from None
    for read_path in (path.parent, path, path.parent / "runs"):
        require_inside(lab.root, read_path)
    directory = path.parent.resolve()
    identity = (status.st_ino, status.st_size, status.st_mtime_ns)
    # For a study of thousands of conditions, or for hundreds of studies, the cache saves seconds.
    if directory not in _cache or _cache[directory][0] != identity:
        _cache[directory] = identity, _open_study(lab.root, directory)
    return _cache[directory][1]


def _open_study(root: Path, directory: Path) -> StudyStore:
    study = StudyStore(directory)
    for name in study.experiments:
        require_inside(root, directory / "runs" / name)
    return study


def read_versions(root: Path, paths: Iterable[Path]) -> tuple[tuple[Path, int], ...]:
    """Return each existing path with its modification time in ns, as a part of a cache key."""
    paths = tuple(paths)
    for path in paths:
        require_inside(root, path)
    times = [(path, read_change_time(path)) for path in paths]
    return tuple((path, time) for path, time in times if time >= 0)


def require_inside(root: Path, path: Path) -> None:
    """Raise StudyError if a path, after resolving links, is outside the served folder."""
    if not path.resolve().is_relative_to(root):
        raise StudyError(f"{path} is outside {root}, the folder of this lab")


def find_condition(study: StudyStore, name: str) -> Experiment:
    """Return a condition of a study. Raise MissingError if it does not exist."""
    try:
        return study.experiment(name)
    except StudyError as error:
        raise MissingError(str(error)) from None


def find_requested_condition(lab: Lab, query: Query) -> tuple[StudyStore, Experiment]:
    """Return the study and the condition that a query names."""
    study = find_study(lab, read_text(query, "study"))
    return study, find_condition(study, read_text(query, "condition"))


def find_run(lab: Lab, query: Query) -> tuple[StudyStore, Experiment, int]:
    """Return the study, the condition and the index of the stored run that a query names."""
    study, condition = find_requested_condition(lab, query)
    run = read_number(query, "run")
    require_run(lab, study, condition.name, run)
    return study, condition, run


def require_run(lab: Lab, study: StudyStore, name: str, run: int) -> None:
    """Raise MissingError if a run is not stored."""
    runs = study.runs(name)
    if run not in runs:
        stored_runs = "no run is stored yet"
        if runs:
            stored_runs = f"{len(runs)} runs are stored, from {runs[0]} to {runs[-1]}"
        raise MissingError(f"{study.location} has no run {run} of {name}; {stored_runs}")
    require_inside(lab.root, study.path(name, run))


# The placeholder in a command for a file that the study does not contain.
UNKNOWN_FILE: Final = "FILE"


def list_studies(lab: Lab, query: Query) -> dict[str, Any]:
    """Return the summaries of all studies."""
    return {"studies": [summarize(lab, name) for name in list_study_names(lab.root)]}


def summarize(lab: Lab, name: str) -> dict[str, Any]:
    """Return the conditions and runs of a study. `problem` is a message if it cannot be read.

    `missing` is a message with a remedy if lifetimes of the study cannot be simulated, else "".
    """
    # JSON has no form for a name that is not UTF-8.
    printable_name = name.encode(errors="backslashreplace").decode()
    try:
        if printable_name != name:
            raise StudyError(f"the name {printable_name} is not UTF-8; rename the folder")
        return _summarize_readable(lab, find_study(lab, name), name)
    # An unreadable study must not hide other studies, so the list has an entry for any error.
    except Exception as error:
        problem = str(error)
        if not isinstance(error, BaldwinLabError):
            problem = f"{name} cannot be read: {problem or type(error).__name__}"
        return {
            "id": printable_name,
            "seed": None,
            "modified": 0,
            "conditions": [],
            "problem": problem,
        }


def _summarize_readable(lab: Lab, study: StudyStore, name: str) -> dict[str, Any]:
    main_condition, question = _read_paper(study)
    titles = sweeps.name_points(study)
    missing = describe_missing_parts(lab, study)
    conditions = [
        _summarize_condition(study, experiment, has_parts=not missing)
        | {"title": titles[experiment.name], "shown": experiment.name == main_condition}
        for experiment in study.experiments.values()
    ]
    return {
        "id": name,
        # The argument of commands in the working directory of the server.
        "argument": quote_path(study.directory),
        "seed": study.seed,
        "paper": study.paper,
        "question": question,
        # In seconds. The page first opens the study with the newest run.
        "modified": _find_last_change(study),
        "conditions": conditions,
        "report": (study.directory / "report.html").is_file(),
        "problem": None,
        "missing": missing,
    }


def _find_last_change(study: StudyStore) -> float:
    """Return when the newest run of a study was stored, in seconds; 0 without a run."""
    paths = (file.path for name in study.experiments for file in study.files(name))
    return max(map(read_change_time, paths), default=0) / NANOSECONDS_PER_SECOND


def _summarize_condition(
    study: StudyStore, experiment: BaseExperiment, has_parts: bool
) -> dict[str, Any]:
    views = read_views(experiment)
    return {
        "name": experiment.name,
        **study.factors[experiment.name]._asdict(),
        "runs": study.runs(experiment.name),
        "generations": experiment.evolution.generations,
        "learns": has_parts and experiment.learns,
        # The number of agents in one world.
        "agents": experiment.agents_per_world
        if isinstance(experiment, Experiment)
        else experiment.population.size,
        # None for a model without a world.
        "steps": experiment.lifetime.steps if isinstance(experiment, Experiment) else None,
        "alleles": list(read_alleles(experiment)),
        "views": [
            {"name": name, "has_agent_choice": view.has_agent_choice}
            for name, view in views.items()
        ],
    }


def _read_paper(study: StudyStore) -> tuple[str, str]:
    """Return the condition that the page opens first, and the question above its world.

    They are the paper's main condition and question. Without a paper, the condition is that of the
    default paper, and the question "".
    """
    try:
        paper = papers.load_stored_paper(study.directory, study.paper)
        question = paper.card.question if study.paper and paper.card else ""
        return paper.metadata.emergence, question
    except papers.PaperError:
        return "", ""


def describe_missing_parts(lab: Lab, study: StudyStore) -> str:
    """Return a message with a remedy if lifetimes of a study cannot be simulated, else ""."""
    try:
        study.require_parts()
    except BaldwinLabError as error:
        missing = [part for part in study.parts if not _is_loaded(part)]
        return _format_remedy(lab, study, missing) if missing else str(error)
    return ""


def _format_remedy(lab: Lab, study: StudyStore, missing: list[PartRecord]) -> str:
    # A file can define several parts, and the study has a copy of the file for each part. The
    # dictionary keeps one copy per content.
    files = {part.sha256: _find_source(lab, study, part) for part in missing}
    options = [word for file in files.values() for word in ("--part", file)]
    names = " and ".join(f"the {part.kind} {part.name}" for part in missing)
    verb = "is" if len(missing) == 1 else "are"
    hint = f" ({UNKNOWN_FILE} is the file with {names})" if UNKNOWN_FILE in options else ""
    return (
        f"{names[0].upper()}{names[1:]} of this study {verb} not loaded. To watch its lifetimes,"
        f" close the lab and start it with this command{hint}, {EXECUTION_HINT}:"
        f" {shlex.join([*lab.command, *options])}"
    )


def _is_loaded(part: PartRecord) -> bool:
    """Return whether a part with the same source as the part of a study is loaded."""
    # Imported late, because a study without custom parts does not need this slow import.
    from baldwinlab.parts.loading import source_of

    try:
        return source_of(part.kind, part.name).sha256 == part.sha256
    except PartError:
        return False


def _find_source(lab: Lab, study: StudyStore, part: PartRecord) -> str:
    """Return the path of the copy of a part's file in a study, or FILE without such a copy."""
    path = stored_source(study.directory, part.kind, part.name)
    try:
        require_inside(lab.root, path)
        is_copy = sha256(read_bytes(path, PART_FILE)).hexdigest() == part.sha256
    except (BaldwinLabError, OSError, ValueError):
        is_copy = False
    return str(path) if is_copy else UNKNOWN_FILE
