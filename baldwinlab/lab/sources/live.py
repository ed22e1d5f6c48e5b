"""The live runs of a server, and the requests that start, list, stop, remove and save a live run.

`live_run.py` simulates a live run. `server/responses.py` sends the progress to the pages.
"""

from __future__ import annotations

import re
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

from baldwinlab.core.names import find_name_fault
from baldwinlab.experiment import Experiment, validate
from baldwinlab.experiment.measures import SPECIES_CURVES, list_species_curves
from baldwinlab.experiment.outcome import describe_experiment_measures
from baldwinlab.lab import Lab, MissingError, Query, read_body_number, release_memory
from baldwinlab.lab.sources.freezer import require_usable_founders
from baldwinlab.lab.sources.limits import check_size, estimate_memory
from baldwinlab.lab.sources.live_run import LiveRun, read_seconds
from baldwinlab.lab.sources.model_displays import describe_species, read_alleles
from baldwinlab.papers import presets
from baldwinlab.simulation.simulate import check_seed
from baldwinlab.studies.creation import create_study
from baldwinlab.studies.records import StudyError

# Number of running or paused live runs.
MAX_ACTIVE_RUNS: Final = 4
# Number of live runs, including ended ones.
MAX_STORED_RUNS: Final = 20
# Memory of all live runs, including ended ones.
MAX_TOTAL_BYTES: Final = 1_000_000_000
MAX_NAME_LENGTH: Final = 100
# For example "evo/long+drift". The list of studies skips folders that are called `runs`.
STUDY_NAME_PATTERN: Final = re.compile(
    r"(?!(.*/)?runs(/|$))[A-Za-z0-9][A-Za-z0-9+_-]*(/[A-Za-z0-9][A-Za-z0-9+_-]*)*"
)


class Live:
    """The live runs of one server.

    A live run continues when no page watches it. An ended live run stays in memory until a page
    removes it, or until a new live run needs space.
    """

    def __init__(self) -> None:
        self._runs: dict[str, LiveRun] = {}
        self._lock = threading.Lock()

    def start(
        self,
        experiment: Experiment,
        seed: int,
        n_runs: int,
        seconds_per_generation: float = 0.0,
    ) -> LiveRun:
        """Start a live run with the parameters of `LiveRun`. Raise ValueError at a limit."""
        check_seed(seed)
        check_size(experiment, n_runs)
        with self._lock:
            n_active = sum(not run.has_ended for run in self._runs.values())
            if n_active >= MAX_ACTIVE_RUNS:
                raise ValueError(
                    f"{MAX_ACTIVE_RUNS} live runs are active, and no more are allowed; stop one of"
                    " them first"
                )
            self._make_room(estimate_memory(experiment, n_runs))
            run = LiveRun(experiment, seed, n_runs, seconds_per_generation)
            self._runs[run.id] = run
        return run

    def _make_room(self, required_bytes: int) -> None:
        """Remove ended live runs that no page watches, until a new live run has enough memory.

        Saved live runs are removed first, and then the oldest live runs. Raise ValueError if the
        new live run still exceeds a limit.
        """
        used_bytes = sum(run.memory_bytes for run in self._runs.values())
        excess_bytes = used_bytes + required_bytes - MAX_TOTAL_BYTES
        excess_runs = len(self._runs) + 1 - MAX_STORED_RUNS
        removable = [run for run in self._runs.values() if run.has_ended and not run.n_watchers]
        runs_to_remove = []
        # False is less than True, so saved live runs come first. The stable sort keeps the order of
        # starts, which is the order of the dictionary.
        for run in sorted(removable, key=lambda run: not run.saved_as):
            if excess_bytes > 0 or excess_runs > 0:
                runs_to_remove.append(run)
                excess_bytes -= run.memory_bytes
                excess_runs -= 1
        if excess_bytes > 0:
            raise ValueError(
                f"live runs may use {MAX_TOTAL_BYTES:,} bytes of memory in total, and this run"
                f" would exceed the limit by {excess_bytes:,} bytes; remove a run from the list of"
                " live runs"
            )
        if excess_runs > 0:
            raise ValueError(
                f"the lab stores at most {MAX_STORED_RUNS} live runs, and pages show all of them;"
                " remove a run from the list of live runs"
            )
        for run in runs_to_remove:
            del self._runs[run.id]

    def list_runs(self) -> list[LiveRun]:
        """Return all live runs, in the order of their start."""
        with self._lock:
            return list(self._runs.values())

    def find_run(self, id: str) -> LiveRun:
        """Return a live run. Raise MissingError if it does not exist."""
        run = self._runs.get(id)
        if run is None:
            raise MissingError(
                f"there is no live run {id!r}: it was removed, or the lab was started again since"
            )
        return run

    @contextmanager
    def watch(self, id: str) -> Iterator[LiveRun]:
        """Count one more watching page while the context is open. Raise as `find_run`."""
        with self._lock:
            run = self.find_run(id)
            run.n_watchers += 1
        try:
            yield run
        finally:
            with self._lock:
                run.n_watchers -= 1

    def save(self, id: str, root: Path, name: str) -> None:
        """Save an ended live run as a study called `name` in `root`.

        The study equals one of `baldwinlab run` with the finished number of generations.
        """
        run = self.find_run(id)
        records = run.make_records()
        experiment = run.experiment.replace(evolution={"generations": run.generations_done})
        with self._lock:
            directory = choose_study_directory(root, name)
            study = create_study(directory, [experiment], run.seed, factors=presets.factors())
        for run_number, record in enumerate(records):
            study.write(experiment.name, run_number, record)
        run.saved_as = name

    def close(self) -> None:
        """Stop all live runs."""
        for run in self.list_runs():
            run.stop()

    def remove(self, id: str) -> None:
        """Stop and remove a live run. Raise MissingError if it does not exist."""
        with self._lock:
            run = self.find_run(id)
            del self._runs[id]
        run.stop()
        run.wait()
        # The memory can be released only after the last reference is deleted.
        del run
        release_memory()


def choose_study_directory(root: Path, name: str) -> Path:
    """Return the directory of a new study in `root`. Raise StudyError for an unusable name."""
    if len(name) > MAX_NAME_LENGTH or not STUDY_NAME_PATTERN.fullmatch(name):
        raise StudyError(
            f"{name!r} is not a valid name of a study: use letters, digits, + - _ and / between"
            f" folders, at most {MAX_NAME_LENGTH} characters, and no folder called runs"
        )
    if fault := find_name_fault(name):
        raise StudyError(f"{name!r} is not a valid name of a study: {fault}; choose another name")
    directory = root / name
    if not directory.resolve().is_relative_to(root.resolve()):
        raise StudyError(f"{name} leads out of {root}; choose another name")
    if directory.exists():
        raise StudyError(f"{name} exists already in {root}; choose another name")
    return directory


def summarize_run(run: LiveRun) -> dict[str, Any]:
    """Return the settings and the state of a live run, which the page shows."""
    return {
        "id": run.id,
        "experiment": run.experiment.to_dict(),
        "alleles": list(read_alleles(run.experiment)),
        **describe_species(run.experiment),
        "species_curves": {
            curve: SPECIES_CURVES[curve] for curve in list_species_curves(run.experiment)
        },
        "measures": describe_experiment_measures(run.experiment),
        "seed": run.seed,
        "runs": run.n_runs,
        "seconds": run.seconds_per_generation,
        "generations_done": run.generations_done,
        "state": run.state,
        "saved_as": run.saved_as,
        "bytes": run.memory_bytes,
    }


def start_run(lab: Lab, body: dict[str, Any]) -> dict[str, str]:
    """Start a live run. The response is {"id": "1f0c9d2a"}."""
    n_runs = read_body_number(body, "runs", 1)
    seed = read_body_number(body, "seed", 0)
    experiment = validate(body.get("experiment", {}))
    require_usable_founders(lab, experiment, n_runs)
    return {"id": lab.live.start(experiment, seed, n_runs, read_seconds(body)).id}


def describe_runs(lab: Lab, query: Query) -> dict[str, Any]:
    """Return the summaries of all live runs, and the limits of their number and memory."""
    limits = {"runs": MAX_STORED_RUNS, "active": MAX_ACTIVE_RUNS, "bytes": MAX_TOTAL_BYTES}
    return {"runs": [summarize_run(run) for run in lab.live.list_runs()], "limits": limits}


def stop_run(lab: Lab, query: Query) -> dict[str, Any]:
    """Stop a live run."""
    lab.live.find_run(query["id"]).stop()
    return {}


def remove_run(lab: Lab, query: Query) -> dict[str, Any]:
    """Stop and remove a live run."""
    lab.live.remove(query["id"])
    return {}


def save_run(lab: Lab, body: dict[str, Any]) -> dict[str, str]:
    """Save a live run as a study. The response is {"study": NAME}."""
    name = str(body.get("name", ""))
    lab.live.save(body["id"], lab.root, name)
    return {"study": name}
