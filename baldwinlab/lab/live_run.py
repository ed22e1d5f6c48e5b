"""A live run: several runs of one experiment, simulated on a thread while pages watch.

All runs advance together, so they always have the same number of finished generations.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, Final
from uuid import uuid4

import numpy as np
import xarray as xr

from baldwinlab.experiment import Experiment
from baldwinlab.lab.limits import count_uninterrupted_steps, estimate_memory
from baldwinlab.models.miniworld.backends import cpu
from baldwinlab.models.miniworld.backends.choice import CPU
from baldwinlab.simulation.compilation import compile_experiments
from baldwinlab.simulation.history import History
from baldwinlab.simulation.simulate import simulate_histories
from baldwinlab.studies.executors.tasks import StoppedError
from baldwinlab.studies.records import StudyError

MAX_SECONDS_PER_GENERATION: Final = 60.0


class InterruptibleBatch(cpu.CpuBatch):
    """A batch that calls `check` every few steps. Its results are bit-identical to `CpuBatch`."""

    def __init__(
        self, check: Callable[[], None], experiment: Experiment, seed: int, runs: Sequence[int]
    ) -> None:
        super().__init__(experiment, seed, runs)
        self._check = check
        self._max_steps = count_uninterrupted_steps(experiment, len(runs))

    def simulate(self, first_step: int, last_step: int) -> None:
        """Simulate the steps from `first_step` up to, but not including, `last_step`."""
        for first in range(first_step, last_step, self._max_steps):
            self._check()
            super().simulate(first, min(first + self._max_steps, last_step))


class LiveRun:
    """Several runs of one experiment. They start on their own thread when the object is created.

    Parameters
    ----------
    experiment
        The experiment.
    seed
        The seed of all runs.
    runs
        The number of runs.
    seconds
        The minimum duration of a generation. 0 simulates as fast as possible.

    Attributes
    ----------
    memory
        The bytes that the run uses when it ends.
    message
        The error if the run failed.
    saved_as
        The study that the run was last saved as.
    watchers
        The number of pages that watch the run.
    removal_timer
        Removes the run if no page watches it.

    """

    def __init__(self, experiment: Experiment, seed: int, runs: int, seconds: float = 0.0) -> None:
        self.id = uuid4().hex[:8]
        self.experiment = experiment
        self.seed = seed
        self.runs = runs
        self.seconds = seconds
        self.memory = estimate_memory(experiment, runs)
        self.message = ""
        self.saved_as = ""
        self.watchers = 0
        self.removal_timer = threading.Timer(0, lambda: None)
        self._histories: Sequence[History] = ()
        self._is_compiled = False
        self._end_state = ""
        self._is_stopping = False
        self._running = threading.Event()
        self._running.set()
        # Ends the wait between two generations.
        self._wake_up = threading.Event()
        self._generation_start = time.monotonic()
        self._thread = threading.Thread(target=self._simulate, name=f"live {self.id}", daemon=True)
        self._thread.start()

    @property
    def state(self) -> str:
        """Return preparing, running, paused, done, stopped or failed."""
        if self._end_state:
            return self._end_state
        if not self._running.is_set():
            return "paused"
        return "running" if self._is_compiled else "preparing"

    @property
    def ended(self) -> bool:
        """Return whether the run is done, stopped or failed."""
        return bool(self._end_state)

    @property
    def generations_done(self) -> int:
        """Return the number of generations that are finished in every run."""
        return self._histories[-1].n_generations if self._histories else 0

    def pause(self) -> None:
        """Pause the run within a lifetime. Has no effect after `stop`."""
        if not self._is_stopping:
            self._running.clear()

    def resume(self) -> None:
        """Continue a paused run."""
        self._running.set()

    def stop(self) -> None:
        """Stop the run. Its finished generations can still be shown and saved."""
        self._is_stopping = True
        self._running.set()
        self._wake_up.set()

    def wait(self) -> None:
        """Wait until the run has ended."""
        self._thread.join()

    def handle_command(self, command: Any) -> None:
        """Execute a command of a page.

        A command is {"command": "pause"}, {"command": "resume"}, {"command": "stop"} or
        {"command": "pace", "seconds": 0.1}. Raise ValueError for another command.
        """
        name = command.get("command") if isinstance(command, dict) else None
        if name == "pace":
            self.seconds = read_seconds(command)
            self._wake_up.set()
        elif name in ("pause", "resume", "stop"):
            getattr(self, name)()
        else:
            raise ValueError(
                f"the command of a live run must be pause, resume, stop or pace, not {name!r}"
            )

    def compute_measures(self, first: int, last: int) -> dict[str, dict[str, list[Any]]]:
        """Return fitness measures of the generations from `first` up to, but not including, `last`.

        Returns
        -------
        dict
            For each measure (best, mean, share): `mean` over runs [generation]. With several runs
            also `low` and `high`, the 95 % interval of the mean [generation], and `runs`, the
            values of all runs [generation, run].

        """
        # This import takes time.
        from baldwinlab.analysis.statistics.curve_intervals import interval_of_mean
        from baldwinlab.analysis.statistics.fitness import MEASURES

        variables = {"energy": [history.energy[first:last] for history in self._histories]}
        if isinstance(self.experiment, Experiment):
            variables["food_eaten"] = [
                history.recorded_values("food_eaten")[first:last] for history in self._histories
            ]
        dimensions = ("run", "generation", "agent")
        dataset = xr.Dataset(
            {name: (dimensions, np.stack(values)) for name, values in variables.items()}
        )
        # A single run has no interval, so `zip` below stops after the mean.
        keys = ("mean", "low", "high", "runs") if self.runs > 1 else ("mean",)
        bands = {}
        for name, measure in MEASURES.items():
            values = measure(dataset)
            band = (*interval_of_mean(values), values.transpose("generation", "run"))
            bands[name] = {
                key: array.values.tolist() for key, array in zip(keys, band, strict=False)
            }
        return bands

    def read_fitness(self, run: int, generation: int) -> xr.DataArray:
        """Return the fitness of all finished generations (generation, agent).

        Raise ValueError as `find_history`.
        """
        return xr.DataArray(self.find_history(run, generation).energy, dims=("generation", "agent"))

    def find_history(self, run: int, generation: int) -> History:
        """Return the history of one run.

        Raise ValueError if the run does not exist or the generation is not finished.
        """
        if not 0 <= run < self.runs:
            raise ValueError(f"run = {run} must be at least 0 and less than {self.runs}")
        if not 0 <= generation < self.generations_done:
            raise ValueError(
                f"generation {generation} of the live run {self.id} is not finished:"
                f" {self.generations_done} generations are"
            )
        return self._histories[run]

    def make_records(self) -> list[xr.Dataset]:
        """Return the records of all runs, as a study stores them.

        Raise StudyError if the run has not ended or has no finished generation.
        """
        if self._end_state not in ("done", "stopped"):
            raise StudyError(
                f"the live run {self.id} is {self.state}; only a run that is done or stopped can"
                " be saved"
            )
        if not self.generations_done:
            raise StudyError(f"the live run {self.id} has no finished generation to save")
        return [history.record() for history in self._histories]

    def _simulate(self) -> None:
        try:
            compile_experiments([self.experiment])
            self._is_compiled = True
            backend = CPU._replace(batch=partial(InterruptibleBatch, self._check_commands))
            simulate_histories(
                self.experiment, self.seed, range(self.runs), backend, self._finish_generation
            )
            self._end_state = "done"
        except StoppedError:
            self._end_state = "stopped"
        except Exception as error:
            # Watching pages must show any error.
            self.message = f"the live run failed: {error or type(error).__name__}"
            self._end_state = "failed"

    def _finish_generation(self, histories: Sequence[History]) -> None:
        """Store the histories, and wait until the next generation may start."""
        self._histories = histories
        if self.generations_done == self.experiment.evolution.generations:
            return
        while not self._is_stopping:
            remaining = self._generation_start + self.seconds - time.monotonic()
            if remaining <= 0:
                break
            self._wake_up.wait(remaining)
            self._wake_up.clear()
        self._check_commands()
        self._generation_start = time.monotonic()

    def _check_commands(self) -> None:
        """Wait while the run is paused. Raise StoppedError if it was stopped."""
        self._running.wait()
        if self._is_stopping:
            raise StoppedError


def read_seconds(command: dict[str, Any]) -> float:
    """Return the seconds per generation of a request. Raise ValueError for an invalid number."""
    seconds = command.get("seconds", 0)
    is_number = isinstance(seconds, int | float) and not isinstance(seconds, bool)
    if not is_number or not 0 <= seconds <= MAX_SECONDS_PER_GENERATION:
        raise ValueError(
            f"seconds = {seconds!r} must be a number from 0 to {MAX_SECONDS_PER_GENERATION:g}"
        )
    return float(seconds)
