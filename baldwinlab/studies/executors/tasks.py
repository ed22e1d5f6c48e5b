"""What every executor does, wherever it does it."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from pathlib import Path
from typing import NamedTuple

from baldwinlab.errors import BaldwinLabError
from baldwinlab.experiment import Experiment
from baldwinlab.models.miniworld.backend import Backend
from baldwinlab.runs.simulate import live_batch
from baldwinlab.studies.records import write_record
from baldwinlab.studies.store import Study


class Task(NamedTuple):
    """Runs of one condition that one worker does."""

    experiment: Experiment
    runs: tuple[int, ...]

    @property
    def agent_steps(self) -> int:
        return len(self.runs) * agent_steps_of_run(self.experiment)


class Executor(NamedTuple):
    """A place to do tasks.

    `do` does tasks of a study, so many at a time, on a backend, and stores each run as it ends. It yields the agent-steps done
    as it hears of them, in all as many as the tasks have. When a task raises, or the caller stops asking (ctrl-C), the other
    tasks end at their next generation, what they had in flight is dropped, and the error is raised; it is an ExecutorError
    when it is the place that failed.
    """

    name: str
    workers: int  # tasks at a time
    do: Callable[[Study, Sequence[Task], int, Backend], Generator[int, None, None]]


class ExecutorError(BaldwinLabError):
    """A place where tasks cannot be done any longer."""


class StoppedError(Exception):
    """Raised in a worker to end it between two generations."""


def agent_steps_of_run(experiment: Experiment) -> int:
    return experiment.evolution.generations * experiment.steps * experiment.population.size


def do(task: Task, seed: int, directory: Path, backend: Backend, lived: Callable[[int], None]) -> None:
    """Do a task in batches of as many worlds as suit the backend; store the runs of a batch when it ends.

    `lived` is called with the agent-steps of every generation that has lived; what it raises ends the task.
    """
    for first in range(0, len(task.runs), backend.worlds):
        _do_batch(Task(task.experiment, task.runs[first : first + backend.worlds]), seed, directory, backend, lived)


def _do_batch(batch: Task, seed: int, directory: Path, backend: Backend, lived: Callable[[int], None]) -> None:
    share = batch.agent_steps // batch.experiment.evolution.generations
    for history in live_batch(batch.experiment, seed, batch.runs, backend, lambda histories: lived(share)):
        write_record(directory, batch.experiment.name, history.run, history.record())
