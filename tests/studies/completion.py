"""Simulate missing runs and assays without messages, stop and continue them, and read files."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, closing, contextmanager
from itertools import islice
from pathlib import Path
from typing import Any

from baldwinlab.experiment import BaseExperiment
from baldwinlab.models.miniworld.backends.choice import CPU
from baldwinlab.simulation.history import Histories
from baldwinlab.simulation.records import make_record
from baldwinlab.simulation.simulate import continue_histories, simulate_histories
from baldwinlab.studies.assays.results import find_missing_assays
from baldwinlab.studies.assays.run import run_assays
from baldwinlab.studies.checkpoints import Interval
from baldwinlab.studies.executors import THREADS
from baldwinlab.studies.run import find_missing_runs, plan_tasks, run_study
from baldwinlab.studies.store import StudyStore
from tests.small_studies import ignore_message, ignore_progress


def complete_runs(
    study: StudyStore, runs: int, workers: int = 1, log: Callable[[str], None] = ignore_message
) -> None:
    missing = find_missing_runs(study, runs, log)
    run_study(study, missing, workers, ignore_progress, ignore_message)


def complete_assays(
    study: StudyStore, names: Sequence[str], workers: int = 1, **options: Any
) -> None:
    missing = find_missing_assays(study, names)
    run_assays(study, missing, workers, ignore_progress, ignore_message, **options)


def count_progress(
    step_counts: list[int],
) -> Callable[[str, int], AbstractContextManager[Callable[[int], None]]]:
    """Return a progress that appends -(all steps), then the steps of each advance, to the list."""

    @contextmanager
    def append_steps(description: str, total: int) -> Iterator[Callable[[int], None]]:
        step_counts.append(-total)
        yield step_counts.append

    return append_steps


def stop_after_generations(study: StudyStore, runs: int, count: int) -> None:
    """Simulate `count` generations of the missing runs, each with a checkpoint. Then stop."""
    missing = find_missing_runs(study, runs, ignore_message)
    tasks = plan_tasks(study, missing, 1, CPU.worlds, Interval(generations=1))
    with closing(THREADS.run(study, tasks, 1, CPU)) as amounts:
        for _ in islice(amounts, count):
            pass


def require_continuable(
    experiment: BaseExperiment, stored: int, seed: int = 3, runs: Sequence[int] = (0, 1)
) -> None:
    """Require that runs continue from `stored` generations with the bits of complete runs."""
    shorter = experiment.replace(evolution={"generations": stored})
    records = {
        history.run: make_record(history)
        for history in simulate_histories(shorter, seed, runs)
        if not history.is_stopped
    }
    assert records
    restored = Histories(experiment, seed, [*records], [*records.values()])
    continue_histories(restored)
    complete = simulate_histories(experiment, seed, [*records])
    for history, expected in zip(restored.histories, complete, strict=True):
        assert make_record(history).identical(make_record(expected))


def fail_without_space(handle: int) -> None:
    """Replace `os.fsync` on a full disk."""
    raise OSError(28, "No space left on device")


def read_files(folder: Path) -> dict[str, bytes]:
    """Return the contents of all files below a folder."""
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file()
    }
