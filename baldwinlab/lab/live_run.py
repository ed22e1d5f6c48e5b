"""Some runs of one experiment that live while somebody watches, side by side on a thread, so all are as far as each other."""

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
from baldwinlab.lab.limits import memory_of, steps_at_once
from baldwinlab.models.miniworld.backends import cpu
from baldwinlab.models.miniworld.backends.choice import CPU
from baldwinlab.simulation.compilation import compile_experiments
from baldwinlab.simulation.simulate import History, simulate_histories
from baldwinlab.studies.executors.tasks import StoppedError
from baldwinlab.studies.records import StudyError

SLOWEST: Final = 60.0  # seconds a generation


class InPieces(cpu.Batch):
    """A batch whose lives are lived some steps at a time, to the same bits; before each piece, `look` is called."""

    def __init__(
        self, look: Callable[[], None], experiment: Experiment, seed: int, runs: Sequence[int]
    ) -> None:
        super().__init__(experiment, seed, runs)
        self._look, self._steps = look, steps_at_once(experiment, len(runs))

    def simulate(self, first_step: int, last_step: int) -> None:
        for first in range(first_step, last_step, self._steps):
            self._look()
            super().simulate(first, min(first + self._steps, last_step))


class LiveRun:
    """Some runs of one experiment, which live on a thread of their own from the moment this is made."""

    def __init__(self, experiment: Experiment, seed: int, runs: int, seconds: float = 0.0) -> None:
        """A generation takes at least so many `seconds`, so that eyes can follow; 0 for as fast as it goes."""
        self.id = uuid4().hex[:8]
        self.experiment, self.seed, self.runs, self.seconds = experiment, seed, runs, seconds
        self.memory = memory_of(experiment, runs)  # bytes that it comes to hold
        self.message = ""
        self.kept = ""  # the study that it was kept as last
        self.watchers = 0
        self.farewell = threading.Timer(0, lambda: None)  # frees the run when nobody has come back
        self._histories: Sequence[History] = ()
        self._ready, self._end = False, ""
        self._stopping = False
        self._going, self._stirred = (
            threading.Event(),
            threading.Event(),
        )  # the latter when a wait may be over
        self._going.set()
        self._woke = time.monotonic()  # when the generation that lives now began
        self._thread = threading.Thread(target=self._live, name=f"live {self.id}", daemon=True)
        self._thread.start()

    @property
    def state(self) -> str:
        """One of preparing, running, paused, done, stopped, failed; `message` says more of the last."""
        going = "running" if self._ready else "preparing"
        return self._end or (going if self._going.is_set() else "paused")

    @property
    def ended(self) -> bool:
        return bool(self._end)

    @property
    def lived(self) -> int:
        """Generations that have lived in every run."""
        return self._histories[-1].lived if self._histories else 0

    def pause(self) -> None:
        """Takes effect in the middle of a life; not after `stop`."""
        if not self._stopping:
            self._going.clear()

    def resume(self) -> None:
        self._going.set()

    def stop(self) -> None:
        """As `pause`, for good; all generations that have lived can still be seen and kept."""
        self._stopping = True
        self._going.set()
        self._stirred.set()

    def wait(self) -> None:
        """Until it has ended."""
        self._thread.join()

    def obey(self, order: Any) -> None:
        """Do what a page asks: {"do": "pause"}, "resume" or "stop", or {"do": "pace", "seconds": 0.1}. Raises ValueError."""
        wish = order.get("do") if isinstance(order, dict) else None
        if wish == "pace":
            self.seconds = seconds_in(order)
            self._stirred.set()
        elif wish in ("pause", "resume", "stop"):
            getattr(self, wish)()
        else:
            raise ValueError(f"a live run is told to pause, resume, stop or pace, not {wish!r}")

    def measures(self, first: int, last: int) -> dict[str, dict[str, list[Any]]]:
        """Best and mean fitness and the share that ate, in generations from `first` up to, and without, `last`.

        Of each its mean over the runs and, where there are several, the lower and upper edge of the 95 % interval of that mean,
        and `each`: of every generation, the number of each run.
        """
        from baldwinlab.analysis.statistics.fitness import (  # here, because it takes a while to load
            MEASURES,
            interval_of_mean,
        )

        lived = {"energy": [history.energy[first:last] for history in self._histories]}
        if isinstance(self.experiment, Experiment):
            lived["food_eaten"] = [
                history.recorded_values("food_eaten")[first:last] for history in self._histories
            ]
        some = xr.Dataset(
            {
                name: (("run", "generation", "agent"), np.stack(values))
                for name, values in lived.items()
            }
        )
        parts = ("mean", "low", "high", "each") if self.runs > 1 else ("mean",)
        found = {}
        for name, measure in MEASURES.items():
            values = measure(some)
            band = (*interval_of_mean(values), values.transpose("generation", "run"))
            found[name] = {
                part: numbers.values.tolist() for part, numbers in zip(parts, band, strict=False)
            }
        return found

    def energy(self, run: int, generation: int) -> xr.DataArray:
        """Fitness (generation, agent) of all generations so far. Raises ValueError as `history` does."""
        return xr.DataArray(self.history(run, generation).energy, dims=("generation", "agent"))

    def history(self, run: int, generation: int) -> History:
        """One of the runs, as far as it has come. Raises ValueError where there is none, and where `generation` has not lived."""
        if not 0 <= run < self.runs:
            raise ValueError(f"run = {run} must be at least 0 and less than {self.runs}")
        if not 0 <= generation < self.lived:
            raise ValueError(
                f"generation {generation} of the live run {self.id} has not lived: {self.lived} have"
            )
        return self._histories[run]

    def records(self) -> list[xr.Dataset]:
        """Each run as a study stores it. Raises StudyError while it lives, and where no generation has lived."""
        if self._end not in ("done", "stopped"):
            raise StudyError(
                f"the live run {self.id} is {self.state}; only one that is done or stopped can be kept"
            )
        if not self.lived:
            raise StudyError(
                f"no generation of the live run {self.id} has lived, so there is nothing to keep"
            )
        return [history.record() for history in self._histories]

    def _live(self) -> None:
        try:
            compile_experiments([self.experiment])
            self._ready = True
            in_pieces = CPU._replace(batch=partial(InPieces, self._look))
            simulate_histories(self.experiment, self.seed, range(self.runs), in_pieces, self._lived)
            self._end = "done"
        except StoppedError:
            self._end = "stopped"
        except Exception as error:  # whatever it is, those who watch must hear of it
            self.message = f"the live run failed: {error or type(error).__name__}"
            self._end = "failed"

    def _lived(self, histories: Sequence[History]) -> None:
        self._histories = histories
        if self.lived == self.experiment.evolution.generations:
            return
        while not self._stopping and (early := self._woke + self.seconds - time.monotonic()) > 0:
            self._stirred.wait(early)
            self._stirred.clear()
        self._look()
        self._woke = time.monotonic()

    def _look(self) -> None:
        """Wait for as long as it is paused. Raises StoppedError where it is to stop."""
        self._going.wait()
        if self._stopping:
            raise StoppedError


def seconds_in(order: dict[str, Any]) -> float:
    """The seconds a generation that a page asks for. Raises ValueError."""
    seconds = order.get("seconds", 0)
    if (
        isinstance(seconds, bool)
        or not isinstance(seconds, int | float)
        or not 0 <= seconds <= SLOWEST
    ):
        raise ValueError(f"seconds = {seconds!r} must be a number from 0 to {SLOWEST:g}")
    return float(seconds)
