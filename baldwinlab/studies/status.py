"""Status of a study (runs, speed, time left, processes and failures), provenance and verdicts.

The verdicts on the claims of a paper are stored with a digest of the evaluated runs.
"""

from __future__ import annotations

import hashlib
import json
import platform
from collections.abc import Container, Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.io import netcdf_file

from baldwinlab._version import __version__
from baldwinlab.core.file_writing import write_atomically
from baldwinlab.core.files import (
    RESULTS_FILE,
    find_paths,
    is_local,
    open_file,
    parse_json,
    quote_path,
    read_text,
)
from baldwinlab.core.netcdf import CHECKSUM_BYTES, stored_checksum
from baldwinlab.core.numbers import SEED_LIMIT, format_count
from baldwinlab.core.variables import GENERATION_COUNT, STOP_ATTRIBUTE
from baldwinlab.experiment import BaseExperiment
from baldwinlab.studies.open import describe_sample
from baldwinlab.studies.progress import ProcessProgress, compute_rate, read_progress
from baldwinlab.studies.record_files import (
    RecordFile,
    assign_runs,
    condition_folder,
    list_record_files,
    list_stored_runs,
)
from baldwinlab.studies.records import StudyError, read_lengths
from baldwinlab.studies.store import INTERRUPTED, StudyStore

CLAIMS_FILE: Final = "claims.json"


class StudyStatus(NamedTuple):
    """Status of a study."""

    done: Mapping[str, int]  # Number of complete runs by name of condition.
    missing: Mapping[str, int]  # Number of missing or incomplete runs by name of condition.
    running: tuple[ProcessProgress, ...]  # The processes that run the study now.
    # Agent-steps per second of the running processes, or of the last session; 0 if unknown.
    steps_per_second: float
    # Estimated time of the missing runs in seconds, None if the speed is unknown.
    seconds_left: float | None
    failures: tuple[str, ...]  # Damaged files, killed processes and the error of the last session.
    last_session: Mapping[str, Any]  # The last session, empty if none has ended.

    @property
    def workers(self) -> int:
        """Number of tasks that are executed in parallel now."""
        return sum(progress.workers for progress in self.running)

    def to_dict(self) -> dict[str, Any]:
        """Return the status as plain data."""
        return {
            "done": sum(self.done.values()),
            "missing": sum(self.missing.values()),
            "conditions": {
                name: {"done": done, "missing": self.missing[name]}
                for name, done in self.done.items()
            },
            "is_running": bool(self.running),
            "workers": self.workers,
            "processes": [progress._asdict() for progress in self.running],
            "agent_steps_per_second": self.steps_per_second,
            "seconds_left": self.seconds_left,
            "failures": list(self.failures),
            "last_session": dict(self.last_session),
        }


def read_status(study: StudyStore) -> StudyStatus:
    """Return the status of a study, while it runs or later.

    Checksums are not verified, so the function is fast. Raises `StudyError` if a file in the folder
    of a condition ends in .nc but does not have the name of a record.
    """
    sessions = list(study.sessions())
    last_session = sessions[-1] if sessions else {}
    processes = [progress for _, progress in read_progress(study.directory)]
    running = tuple(progress for progress in processes if progress.is_running)
    failures = [
        f"process {progress.pid} on {progress.host} was killed"
        for progress in processes
        if not progress.is_running
    ]
    error = last_session.get("error")
    if error == INTERRUPTED:
        failures.append(
            f"the last session was interrupted; `baldwinlab run {quote_path(study.directory)}` "
            "resumes it"
        )
    elif error:
        failures.append(f"the last session ended with an error: {error}")
    n_runs = _count_runs_of_condition(study, processes, last_session)
    done = {}
    for condition in study.experiments:
        counts = count_stored_runs(study.directory, study.experiments[condition], study.seed)
        done[condition] = counts.complete
        failures += counts.faults
    missing = {condition: max(0, n_runs - count) for condition, count in done.items()}
    speed = sum(progress.steps_per_second for progress in running)
    if not running and last_session:
        speed = compute_rate(last_session["agent_steps"], last_session["seconds"])
    steps_left = _count_steps_left(study, missing, running)
    seconds_left = steps_left / speed if speed else None
    if not steps_left:
        seconds_left = 0.0
    return StudyStatus(done, missing, running, speed, seconds_left, tuple(failures), last_session)


def _count_runs_of_condition(
    study: StudyStore, processes: list[ProcessProgress], last_session: Mapping[str, Any]
) -> int:
    """Return the largest number of runs of a condition: requested by a session, or stored."""
    # These totals count the runs of all conditions together.
    totals = [progress.runs for progress in processes]
    totals.append(int(last_session.get("runs", 0)))
    last_runs = [
        max(list_stored_runs(condition_folder(study.directory, condition)), default=-1)
        for condition in study.experiments
    ]
    largest = max(last_runs) + 1 - study.first_run if max(last_runs) >= 0 else 0
    return max(largest, max(totals) // len(study.experiments))


def count_requested_runs(study: StudyStore) -> int:
    """Return the largest number of runs of a condition that is stored, or that a session had."""
    sessions = list(study.sessions())
    processes = [progress for _, progress in read_progress(study.directory)]
    return _count_runs_of_condition(study, processes, sessions[-1] if sessions else {})


def _count_steps_left(
    study: StudyStore, missing: Mapping[str, int], running: tuple[ProcessProgress, ...]
) -> int:
    """Return the agent-steps left of the running processes, or else those of the missing runs."""
    if running:
        return sum(progress.agent_steps - progress.agent_steps_done for progress in running)
    return sum(
        n_runs * study.experiments[name].evolution.generations * study.experiments[name].agent_steps
        for name, n_runs in missing.items()
        if n_runs
    )


class StoredRunCounts(NamedTuple):
    """Numbers of the stored runs of a condition."""

    complete: int
    incomplete: int  # Runs with fewer generations than the study, or in a file that is unreadable.
    faults: list[str]  # A sentence for each damaged file.


def count_stored_runs(
    directory: Path,
    experiment: BaseExperiment,
    seed: int,
    requested_runs: Container[int] = range(SEED_LIMIT),
) -> StoredRunCounts:
    """Count those of the requested runs of a condition that are stored.

    A run with fewer generations than `experiment` is incomplete. Checksums are not verified.
    """
    folder = condition_folder(directory, experiment.name)
    faults = [
        f"{path} was damaged; its runs are missing unless they were simulated again"
        for path in find_paths(folder, "*.damaged")
    ]
    n_runs = n_complete = 0
    for file, stored_runs in assign_runs(list_record_files(folder)):
        runs = [run for run in stored_runs if run in requested_runs]
        n_runs += len(runs)
        try:
            is_complete = _read_completeness(file, experiment, seed)
        # The reader raises any kind of error for invalid bytes.
        except Exception as error:
            faults.append(f"{file.path} cannot be read: {type(error).__name__}")
            continue
        n_complete += int(sum(is_complete[run - file.first] for run in runs))
    return StoredRunCounts(n_complete, n_runs - n_complete, faults)


def require_complete_runs(study: StudyStore) -> None:
    """Raise StudyError if a stored run is not complete."""
    if sentence := format_incomplete_sentence(study):
        raise StudyError(sentence)


def format_incomplete_sentence(study: StudyStore) -> str:
    """Return a sentence about the stored runs that are not complete, "" if all are complete."""
    counts = [
        count_stored_runs(study.directory, experiment, study.seed)
        for experiment in study.experiments.values()
    ]
    n_incomplete = sum(count.incomplete for count in counts)
    if not n_incomplete:
        return ""
    n_stored = n_incomplete + sum(count.complete for count in counts)
    return (
        f"{n_incomplete:,} of {format_count(n_stored, 'stored run')} have fewer generations than "
        f"{study.location}, or cannot be read. "
        f"`baldwinlab run {quote_path(study.directory)}` completes them."
    )


def _read_completeness(
    file: RecordFile, experiment: BaseExperiment, seed: int
) -> npt.NDArray[np.bool_]:
    """Return whether each run of a file is complete. Of a local file, only a part is read."""
    generations = experiment.evolution.generations
    is_complete: npt.NDArray[np.bool_]
    if not is_local(file.path):
        lengths = read_lengths(file, experiment, seed)
        is_complete = (lengths.n_generations == generations) | lengths.is_stopped
        return is_complete
    with netcdf_file(str(file.path), mmap=True) as content:
        if not file.is_batch:
            is_stopped = hasattr(content, STOP_ATTRIBUTE)
            n_generations = content.variables["energy"].shape[0]
            return np.array([n_generations == generations or is_stopped])
        counts: npt.NDArray[np.int32] = np.array(content.variables[GENERATION_COUNT].data)
        is_complete = counts == generations
        if STOP_ATTRIBUTE in content.variables:
            names = np.array(content.variables[STOP_ATTRIBUTE].data)
            is_complete |= (names.reshape(len(counts), -1) != b"").any(axis=1)
        return is_complete


def provenance(study: StudyStore, incomplete: str) -> dict[str, Any]:
    """Return the seed, changes, sample, versions and computing time of a study for the report.

    `incomplete`: the result of `format_incomplete_sentence`, which reads all files.
    """
    sessions = list(study.sessions())
    return {
        "seed": study.seed,
        "changed_model": study.changed_model,
        "sample": describe_sample(study),
        "incomplete": incomplete,
        "versions": {
            "baldwinlab": __version__,
            "Python": platform.python_version(),
            "NumPy": np.__version__,
            "Numba": version("numba"),
        },
        "platform": platform.platform(),
        "agent_steps": sum(session["agent_steps"] for session in sessions),
        "seconds": sum(session["seconds"] for session in sessions),
        "compile_seconds": sum(session["compile_seconds"] for session in sessions),
        "workers": sorted({session["workers"] for session in sessions}),
    }


def write_claims(study: StudyStore, claims: Sequence[Mapping[str, Any]]) -> None:
    """Write the claims with a checksum and a digest of the runs of the study. Raises OSError."""
    content = {"records": digest_records(study), "claims": list(claims)}
    content_with_checksum = {"checksum": _checksum(content), **content}
    text = json.dumps(content_with_checksum, indent=2, ensure_ascii=False, allow_nan=False)
    write_atomically(study.directory / CLAIMS_FILE, f"{text}\n".encode())


def read_claims(study: StudyStore) -> list[dict[str, Any]]:
    """Read the claims of a study, each with `id` and `verdict`; [] if no report exists yet."""
    path = study.directory / CLAIMS_FILE
    remedy = f"`baldwinlab report {quote_path(study.directory)}` makes it again"
    if not path.exists():
        return []
    try:
        content = parse_json(read_text(path, RESULTS_FILE))
    except (OSError, ValueError) as error:
        raise StudyError(f"{path} cannot be read: {error}; {remedy}") from None
    if not _verify_content(content):
        raise StudyError(f"{path} was not written by a report; {remedy}")
    if content["records"] != digest_records(study):
        raise StudyError(
            f"{path} was decided by other runs than those that are stored now; {remedy}"
        )
    claims: list[dict[str, Any]] = content["claims"]
    return claims


def digest_records(study: StudyStore) -> str:
    """Return a hash of the files of records: the condition, runs, size and checksum of each."""
    digest = hashlib.sha256(f"{study.seed}\n".encode())
    for condition in study.experiments:
        for file in study.files(condition):
            with open_file(file.path) as stream:
                checksum = stored_checksum(stream.read(CHECKSUM_BYTES))
            runs = f"{file.first}-{file.last}" if file.is_batch else str(file.first)
            size = file.path.stat().st_size
            digest.update(f"{condition} {runs} {size} {checksum}\n".encode())
    return digest.hexdigest()


def _verify_content(content: Any) -> bool:
    """Remove the checksum from `content`, and return whether form and checksum were valid."""
    if not isinstance(content, dict) or not isinstance(content.get("claims"), list):
        return False
    checksum = content.pop("checksum", None)
    return checksum == _checksum(content) and all(map(_is_claim, content["claims"]))


def _is_claim(claim: Any) -> bool:
    return isinstance(claim, dict) and all(
        isinstance(claim.get(name), str) for name in ("id", "verdict")
    )


def _checksum(content: Mapping[str, Any]) -> str:
    return hashlib.sha256(json.dumps(content).encode()).hexdigest()
