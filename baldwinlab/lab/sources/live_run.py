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
import numpy.typing as npt

from baldwinlab.core.deferred import xr
from baldwinlab.evolution import Genome
from baldwinlab.experiment import Experiment
from baldwinlab.experiment.measures import list_species_curves
from baldwinlab.lab.sources.limits import count_uninterrupted_steps, estimate_memory
from baldwinlab.models.miniworld.backends.choice import CPU
from baldwinlab.models.miniworld.backends.cpu import CpuBatch
from baldwinlab.models.miniworld.backends.species import SpeciesBatch
from baldwinlab.simulation.compilation import compile_experiments
from baldwinlab.simulation.history import History
from baldwinlab.simulation.simulate import simulate_histories
from baldwinlab.studies.executors import StoppedError
from baldwinlab.studies.records import StudyError

MAX_SECONDS_PER_GENERATION: Final = 60.0
# Characters of the id of a live run.
ID_LENGTH: Final = 8


class Interruption:
    """Calls `check` every few steps of a batch. The results are bit-identical."""

    def __init__(
        self,
        check: Callable[[], None],
        experiment: Experiment,
        seed: int,
        runs: Sequence[int],
        *sizes: Sequence[int],
    ) -> None:
        """The arguments after `check` are those of the batch."""
        super().__init__(experiment, seed, runs, *sizes)  # type: ignore[call-arg]
        self._check = check
        self._max_uninterrupted_steps = count_uninterrupted_steps(experiment, n_runs=len(runs))

    def simulate(self, first_step: int, last_step: int) -> None:
        """Simulate the steps from `first_step` up to, but not including, `last_step`."""
        for step in range(first_step, last_step, self._max_uninterrupted_steps):
            self._check()
            last = min(step + self._max_uninterrupted_steps, last_step)
            super().simulate(step, last)  # type: ignore[misc]


class InterruptibleBatch(Interruption, CpuBatch):
    """A batch of one species that calls `check` every few steps."""


class InterruptibleSpeciesBatch(Interruption, SpeciesBatch):
    """A batch of several species that calls `check` every few steps."""


class LiveRun:
    """Several runs of one experiment. They start on their own thread when the object is created.

    - `seconds_per_generation`: the minimum duration of a generation. 0 simulates as fast as
      possible.
    - `memory_bytes`: the memory that the run uses when it ends.
    - `message`: the error if the run failed.
    - `saved_as`: the study that the run was last saved as.
    - `n_watchers`: the number of pages that watch the run.
    """

    def __init__(
        self,
        experiment: Experiment,
        seed: int,
        n_runs: int,
        seconds_per_generation: float = 0.0,
    ) -> None:
        self.id = uuid4().hex[:ID_LENGTH]
        self.experiment = experiment
        self.seed = seed
        self.n_runs = n_runs
        self.seconds_per_generation = seconds_per_generation
        self.memory_bytes = estimate_memory(experiment, n_runs)
        self.message = ""
        self.saved_as = ""
        self.n_watchers = 0
        self._histories: Sequence[History] = ()
        # [generation][run], only with species, because their genomes cannot be computed again.
        self._genomes: list[list[Genome]] = []
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
    def has_ended(self) -> bool:
        """Return whether the run is done, stopped or failed."""
        return bool(self._end_state)

    @property
    def generations_done(self) -> int:
        """Return the number of generations that are finished in every run."""
        # A run that stopped has fewer generations than the others.
        return max((history.n_generations for history in self._histories), default=0)

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
            self.seconds_per_generation = read_seconds(command)
            self._wake_up.set()
        elif name in ("pause", "resume", "stop"):
            getattr(self, name)()
        else:
            raise ValueError(
                f"the command of a live run must be pause, resume, stop or pace, not {name!r}"
            )

    def compute_measures(self, first: int, stop: int) -> dict[str, dict[str, list[Any]]]:
        """Return fitness measures of the generations from `first` up to, but not including, `stop`.

        Returns for each measure (best, mean, share, and those of each species): `mean` over runs
        [generation]. With several runs also `low` and `high`, the 95 % interval of the mean
        [generation], and `runs`, the values of all runs [generation, run]. A run that stopped keeps
        the values of its last generation.
        """
        # This import takes time.
        from baldwinlab.analysis.statistics.fitness import MEASURES

        generations = np.arange(first, min(stop, self.generations_done))
        names = ["energy"]
        if isinstance(self.experiment, Experiment):
            names.append("food_eaten")
        dataset = self._read_variables(names, generations)
        measures = {name: compute(dataset) for name, compute in MEASURES.items()}
        measures |= self._measure_species(generations)
        return {name: self._summarize_runs(values) for name, values in measures.items()}

    def _measure_species(self, generations: npt.NDArray[np.int64]) -> dict[str, xr.DataArray]:
        """Return the measures of each species [run, generation], such as `mean:predators`."""
        # This import takes time.
        from baldwinlab.analysis.statistics.fitness import compute_species_curves

        curves = list_species_curves(self.experiment)
        if not curves:
            return {}
        names = ["energy", "species"]
        if "survivors" in curves:
            names.append("alive")
        data = self._read_variables(names, generations)
        species_names = [species.name for species in self.experiment.population.species]
        return {
            f"{curve}:{name}": values
            for curve, by_species in compute_species_curves(data, species_names, curves).items()
            for name, values in by_species.items()
        }

    def _read_variables(
        self, names: Sequence[str], generations: npt.NDArray[np.int64]
    ) -> xr.Dataset:
        """Return recorded variables of all runs, [run, generation, agent]."""
        values_by_name = {
            name: [
                _take_until_last(
                    history.energy if name == "energy" else history.recorded_values(name),
                    generations,
                )
                for history in self._histories
            ]
            for name in names
        }
        dimensions = ("run", "generation", "agent")
        return xr.Dataset(
            {name: (dimensions, np.stack(values)) for name, values in values_by_name.items()}
        )

    def _summarize_runs(self, values: xr.DataArray) -> dict[str, list[Any]]:
        """Return the mean of a measure [run, generation] over runs, and its interval."""
        # This import takes time.
        from baldwinlab.analysis.statistics.intervals import interval_of_mean

        mean, low, high = interval_of_mean(values)
        curves = {"mean": mean}
        if self.n_runs > 1:
            # A single run has no interval.
            curves |= {"low": low, "high": high, "runs": values.transpose("generation", "run")}
        return {curve: _to_list(array) for curve, array in curves.items()}

    def read_fitness(self, run: int, generation: int) -> xr.DataArray:
        """Return the fitness of all finished generations of a run [generation, agent]."""
        fitness = self.find_history(run, generation).energy
        return xr.DataArray(fitness, dims=("generation", "agent"))

    def read_genomes(self, run: int, generation: int) -> Genome:
        """Return the genomes [agent, module, weight] of a generation of a run with species."""
        self.find_history(run, generation)
        return self._genomes[generation][run]

    def find_history(self, run: int, generation: int) -> History:
        """Return the history of one run."""
        if not 0 <= run < self.n_runs:
            raise ValueError(f"run = {run} must be at least 0 and less than {self.n_runs}")
        # No history exists before the first generation is finished.
        n_done = self._histories[run].n_generations if self._histories else 0
        if not 0 <= generation < n_done:
            raise ValueError(
                f"generation {generation} of the live run {self.id} is not finished:"
                f" {n_done} generations are"
            )
        return self._histories[run]

    def make_records(self) -> list[xr.Dataset]:
        """Return the records of all runs, as a study stores them."""
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
            backend = CPU._replace(
                batch=partial(InterruptibleBatch, self._check_commands),
                species_batch=partial(InterruptibleSpeciesBatch, self._check_commands),
            )
            simulate_histories(
                self.experiment,
                self.seed,
                range(self.n_runs),
                backend,
                after_generation=self._finish_generation,
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
        if self.experiment.population.species:
            self._genomes.append([history.last_genome for history in histories])
        self._histories = histories
        if self.generations_done == self.experiment.evolution.generations:
            return
        while not self._is_stopping:
            # A command can change the pace, so the end is computed after each wake-up.
            generation_end = self._generation_start + self.seconds_per_generation
            seconds_left = generation_end - time.monotonic()
            if seconds_left <= 0:
                break
            self._wake_up.wait(seconds_left)
            self._wake_up.clear()
        self._check_commands()
        self._generation_start = time.monotonic()

    def _check_commands(self) -> None:
        """Wait while the run is paused. Raise StoppedError if it was stopped."""
        self._running.wait()
        if self._is_stopping:
            raise StoppedError


def _take_until_last(values: npt.NDArray[Any], generations: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Return the values of generations; those of the last one if a run stopped before."""
    return np.asarray(values[np.minimum(generations, len(values) - 1)])


def _to_list(array: xr.DataArray) -> list[Any]:
    """Return the values as a list, with None for the fitness of a species without agents."""
    values = array.values.astype(object)
    values[~np.isfinite(array.values)] = None
    nested_list: list[Any] = values.tolist()
    return nested_list


def read_seconds(command: dict[str, Any]) -> float:
    """Return the seconds per generation of a request. Raise ValueError for an invalid number."""
    seconds = command.get("seconds", 0)
    is_number = isinstance(seconds, int | float) and not isinstance(seconds, bool)
    if not is_number or not 0 <= seconds <= MAX_SECONDS_PER_GENERATION:
        raise ValueError(
            f"seconds = {seconds!r} must be a number from 0 to {MAX_SECONDS_PER_GENERATION:g}"
        )
    return float(seconds)
