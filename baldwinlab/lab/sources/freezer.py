"""The freezer: genome files in the served folder, with the agents of any lifetime of the lab.

The files have the format of `baldwinlab freeze`. The page names a file by its path in the folder.
The agents of two files can compete in one population.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator, Mapping
from contextlib import suppress
from functools import cache
from pathlib import Path
from threading import Lock
from typing import Any, Final

import numpy as np

from baldwinlab.api.freezer import choose_experiment, encode_agents, read_genome_file
from baldwinlab.core.errors import RefusedError
from baldwinlab.core.file_writing import write_atomically
from baldwinlab.core.files import (
    FREEZE_MARK,
    STUDY_FILE_NAME,
    enclosing_study,
    has_mark,
    is_study,
    read_change_time,
    walk_folders,
)
from baldwinlab.core.names import find_name_fault
from baldwinlab.evolution import require_founders
from baldwinlab.evolution.genome_file import describe_layout
from baldwinlab.experiment import BaseExperiment
from baldwinlab.experiment.outcome import name_experiment_outcome
from baldwinlab.lab import Lab, MissingError, Query, read_body_number
from baldwinlab.lab.sources.life_query import find_life_of_any_model, require_agent
from baldwinlab.lab.sources.limits import MAX_GENERATION_WORK
from baldwinlab.lab.sources.studies import require_inside
from baldwinlab.papers import presets
from baldwinlab.studies.records import StudyError

FOLDER: Final = "freezer"
SUFFIX: Final = ".nc"
NAME_PATTERN: Final = re.compile(r"[A-Za-z0-9][A-Za-z0-9+_-]{0,99}")
MAX_FILE_BYTES: Final = 50_000_000
MAX_LISTED_FILES: Final = 200
FOUNDERS_FIELD: Final = "evolution.founders"
# The number of lives of a competition. `baldwinlab.api.compete` simulates each life twice.
MAX_LIVES: Final = 200
SIMULATIONS_PER_LIFE: Final = 2
# Held during a competition, because a server simulates one competition at a time.
_running = Lock()


def save_agents(lab: Lab, body: Mapping[str, Any]) -> dict[str, Any]:
    """Write the genomes at birth to a genome file, and return the description of the file.

    `body` has `life` (the parameters of the lifetime, see `find_life`), the `name` of the file, and
    `agent` (the index of a single agent, or None for all agents).
    """
    path = _choose_path(lab.root, str(body.get("name", "")))
    query = body.get("life")
    if not isinstance(query, dict):
        raise ValueError("life must be an object with the parameters of a lifetime")
    life = find_life_of_any_model(lab, {key: str(value) for key, value in query.items()})
    agent = None
    if body.get("agent") is not None:
        agent = read_body_number(body, "agent", 0)
        require_agent(life.experiment, agent)
    genomes = life.load_start_data().genomes
    # The genomes of a file are [run, agent, module, weight], here of a single run.
    content = encode_agents(
        genomes[None] if agent is None else genomes[None, agent : agent + 1],
        life.experiment,
        condition=life.experiment.name,
        seed=life.key.seed,
        generation=life.key.generation,
        runs=[life.key.run],
        agent=agent,
    )
    if len(content) > MAX_FILE_BYTES:
        raise StudyError(
            f"the file would have {len(content):,} bytes, and the lab writes at most"
            f" {MAX_FILE_BYTES:,}; use `baldwinlab freeze`"
        )
    try:
        write_atomically(path, content)
    except OSError as error:
        raise StudyError(f"{path} cannot be written: {error.strerror or error}") from None
    return describe_file(lab, path)


def _choose_path(root: Path, name: str) -> Path:
    if not NAME_PATTERN.fullmatch(name):
        raise StudyError(
            f"{name!r} is not a valid name: use at most 100 letters, digits, + - and _, and begin"
            " with a letter or a digit"
        )
    if fault := find_name_fault(name):
        raise StudyError(f"{name!r} is not a valid name: {fault}; choose another name")
    path = root / FOLDER / f"{name}{SUFFIX}"
    require_inside(root, path)
    if is_study(root) or enclosing_study(path):
        raise StudyError(
            f"{root} is a study; open the lab with a folder that contains it, to store agents"
        )
    if path.exists():
        raise StudyError(f"{FOLDER}/{path.name} exists already; choose another name")
    return path


def list_files(lab: Lab, query: Query) -> dict[str, Any]:
    """Return {"files": [DESCRIPTION, ...]} of the served folder, the newest file first."""
    paths = sorted(_find_files(lab.root), key=read_change_time, reverse=True)
    return {"files": [describe_file(lab, path) for path in paths[:MAX_LISTED_FILES]]}


def _find_files(root: Path) -> Iterator[Path]:
    """Yield the genome files of `baldwinlab freeze` outside studies. Links are not followed."""
    for folder, subfolders, names in walk_folders(root):
        if STUDY_FILE_NAME in names:
            subfolders.clear()
            continue
        for path in map(folder.joinpath, names):
            if path.suffix != SUFFIX or path.is_symlink():
                continue
            # Another program can remove the file, and a file of another user can be unreadable. A
            # device or a pipe is a ValueError.
            with suppress(OSError, ValueError):
                if path.stat().st_size <= MAX_FILE_BYTES and has_mark(path, FREEZE_MARK.encode()):
                    yield path


def describe_file(lab: Lab, path: Path) -> dict[str, Any]:
    """Return `name` and the entries of `_describe_content` of a genome file."""
    name = path.relative_to(lab.root).as_posix()
    key = ("genome file", path, read_change_time(path))
    return {"name": name, **json.loads(lab.cache.get(key, lambda: _describe_content(path)))}


def _describe_content(path: Path) -> bytes:
    """Return the origin and the size of a genome file as JSON, or {"problem": MESSAGE}."""
    try:
        stored = read_genome_file(path)
        experiment = choose_experiment(stored, path, None)
    except (RefusedError, TypeError) as error:
        return json.dumps({"problem": str(error)}).encode()
    n_runs, n_agents = stored.genome.shape[:2]
    origin = stored.origin
    description = {
        "problem": None,
        # The path to write in an experiment.
        "path": _shorten_path(path),
        "condition": str(origin["condition"]),
        "generation": int(origin["generation"]),
        "runs": np.atleast_1d(origin["runs"]).tolist(),
        "agent": int(origin["agent"]) if "agent" in origin else None,
        "n_agents": n_runs * n_agents,
        "conditions": list(_list_conditions(json.dumps(describe_layout(experiment)))),
    }
    return json.dumps(description).encode()


def _shorten_path(path: Path) -> str:
    """Return a path relative to the working directory, or the absolute path if it is outside."""
    working_directory = Path.cwd()
    if path.is_relative_to(working_directory):
        return path.relative_to(working_directory).as_posix()
    return str(path)


@cache
def _list_conditions(layout: str) -> tuple[str, ...]:
    """Return the presets with genomes of a layout: the result of `describe_layout` as JSON."""
    return tuple(name for name in presets.factors() if _describe_preset(name) == layout)


@cache
def _describe_preset(name: str) -> str:
    return json.dumps(describe_layout(presets.load(name)))


def find_file(lab: Lab, name: str) -> Path:
    """Return the path of a genome file in the served folder."""
    path = lab.root / name
    require_inside(lab.root, path)
    if path.suffix != SUFFIX or not path.is_file():
        raise MissingError(f"there is no genome file {name!r} in {lab.root}")
    return path


def require_usable_founders(lab: Lab, experiment: BaseExperiment, n_runs: int) -> None:
    """Raise ValueError if the founders of a live run are outside the folder or do not fit."""
    for index, founders in enumerate(experiment.evolution.founders):
        if not Path(founders.path).resolve().is_relative_to(lab.root):
            raise ValueError(
                f"{FOUNDERS_FIELD}.{index}: {founders.path} is outside {lab.root}, the folder of"
                " this lab"
            )
    try:
        require_founders(experiment, n_runs)
    except ValueError as error:
        raise ValueError(f"{FOUNDERS_FIELD}: {error}") from None


def start_competition(lab: Lab, body: Mapping[str, Any]) -> dict[str, Any]:
    """Return the result of `compete`. Raise ValueError while another competition is running."""
    if not _running.acquire(blocking=False):
        raise ValueError("another competition is running; wait until it has ended")
    try:
        return compete(lab, body)
    finally:
        _running.release()


def compete(lab: Lab, body: Mapping[str, Any]) -> dict[str, Any]:
    """Return the mean outcomes of the agents of two files, and the difference between the means.

    `body` has the files `a` and `b`. It may have a `condition` (the preset of the simulation, by
    default the experiment of `a`), a number of `lives`, and a `seed`. The result has the outcomes
    in `energy` [a, b], and the 95 % interval in `low` and `high`, which are None for one life.
    """
    # This import of SciPy's statistics takes time.
    from baldwinlab.api.compete import compete as simulate_competition

    path_a, path_b = (find_file(lab, str(body.get(name, ""))) for name in ("a", "b"))
    condition = str(body.get("condition", "")) or None
    lives = read_body_number(body, "lives", 20)
    seed = read_body_number(body, "seed", 0)
    # Without this check, `simulate_competition` would also read an experiment file of this name.
    if condition is not None and condition not in presets.factors():
        raise ValueError(f"condition = {condition!r} must be a preset")
    if not 1 <= lives <= MAX_LIVES:
        raise ValueError(f"lives = {lives} must be at least 1 and at most {MAX_LIVES}")
    experiment = choose_experiment(read_genome_file(path_a), path_a, condition)
    work = SIMULATIONS_PER_LIFE * lives * experiment.agent_steps * experiment.weight_count
    if work > MAX_GENERATION_WORK:
        raise ValueError(f"lives = {lives} is too large for these agents; use `bl.compete`")
    result = simulate_competition(path_a, path_b, experiment=condition, lives=lives, seed=seed)
    has_interval = math.isfinite(result.low)
    return {
        "outcome": name_experiment_outcome(experiment),
        "energy": [result.energy_a, result.energy_b],
        "difference": result.difference,
        "low": result.low if has_interval else None,
        "high": result.high if has_interval else None,
        "lives": lives,
        "condition": experiment.name,
    }
