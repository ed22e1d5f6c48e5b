"""What is done, wherever it is done: a task knows what there is to do, and an executor knows where."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from pathlib import Path
from typing import Any, NamedTuple, Protocol

from baldwinlab.core.errors import BaldwinLabError
from baldwinlab.experiment import BaseExperiment
from baldwinlab.models.miniworld.backends.choice import Backend
from baldwinlab.studies.store import StudyStore


class Task(Protocol):
    """Work on a study that one worker does: plain data, because it may be pickled and done elsewhere."""

    @property
    def experiments(self) -> Sequence[BaseExperiment]:
        """All that it lives: their parts must be where it is done."""

    @property
    def agent_steps(self) -> int:
        """How much it lives."""

    def run(
        self, seed: int, directory: Path, backend: Backend, lived: Callable[[int], None]
    ) -> Any:
        """Do it, on the study of that seed in `directory`; what it returns is handed to whoever asked for it.

        `lived` is called with the agent-steps of every generation that has lived; what it raises ends the task.
        """


Done = Callable[[Any, Any], None]
"""Called with a task that has ended, and what it returned."""

Work = Callable[[StudyStore, Sequence[Task], int, Backend, Done], Generator[int, None, None]]
"""An executor's way: see `Executor.do`."""


def ignore_result(task: Task, found: Any) -> None:
    """For tasks that store all they have to say."""


class Executor(NamedTuple):
    """A place to do tasks."""

    name: str
    workers: int  # tasks at a time
    work: Work

    def run(
        self,
        study: StudyStore,
        tasks: Sequence[Task],
        workers: int,
        backend: Backend,
        done: Done = ignore_result,
    ) -> Generator[int, None, None]:
        """Do tasks of a study, so many at a time, on a backend, and call `done`, here, with each that ends and what it returns.

        Yields the agent-steps done as it hears of them, in all as many as the tasks have. When a task or `done` raises, or the
        caller stops asking (ctrl-C), the other tasks end at their next generation, what they had in flight is dropped, and the
        error is raised; it is an ExecutorError when it is the place that failed.
        """
        return self.work(study, tasks, workers, backend, done)


class ExecutorError(BaldwinLabError):
    """A place where tasks cannot be done any longer."""


class StoppedError(Exception):
    """Raised in a worker to end it between two generations."""
