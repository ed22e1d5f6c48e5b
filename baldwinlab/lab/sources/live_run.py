"""A live run: several runs of one experiment, simulated on a thread while pages watch.

All runs advance together, generation by generation. A run that the part `evolution.stop` has ended
has fewer generations than the other runs. `live.py` starts, lists and saves live runs.
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
from baldwinlab.simulation.records import make_record
from baldwinlab.simulation.simulate import simulate_histories
from baldwinlab.studies.executors import StoppedError
from baldwinlab.studies.records import StudyError

# The longest duration that a page can request for a generation.
MAX_SECONDS_PER_GENERATION: Final = 60.0
# Number of characters of the id of a live run.
ID_LENGTH: Final = 8


class Interruption:
    """Mixin of a batch that calls `check` every few steps. The results stay bit-identical."""

    def __init__(
        self,
        check: Callable[[], None],
        experiment: Experiment,
        seed: int,
        runs: Sequence[int],
        *sizes: Sequence[int],
    ) -> None:
        """Make the batch. `sizes` has the number of agents of each species, or is empty."""
        # `super()` is the batch: the second base class of the two classes below.
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
    """Several runs of one experiment. Creating the object starts the runs, on a new thread.

    - `seconds_per_generation`: the minimum duration of a generation. 0 simulates as fast as
      possible.
    - `memory_bytes`: an upper estimate of the memory of all runs after their last generation.
    - `message`: the error if the live run failed, else "".
    - `saved_as`: the name of the study to which the live run was last saved, else "".
    - `n_watchers`: the number of pages that watch the live run.
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
        # [generation][run], only with species: their genomes cannot be computed from the fitness.
        self._genomes: list[list[Genome]] = []
        self._is_compiled = False
        self._end_state = ""
        self._is_stopping = False
        # Set unless the live run is paused.
        self._running = threading.Event()
        self._running.set()
        # Set by a new pace and by `stop`, to end the wait between two generations early.
        self._wake_up = threading.Event()
        self._generation_start = time.monotonic()
        self._thread = threading.Thread(target=self._simulate, name=f"live {self.id}", daemon=True)
        self._thread.start()

    @property
    def state(self) -> str:
        """Return "preparing", "running", "paused", "done", "stopped" or "failed"."""
        if self._end_state:
            return self._end_state
        if not self._running.is_set():
            return "paused"
        return "running" if self._is_compiled else "preparing"

    @property
    def has_ended(self) -> bool:
        """Return whether the live run is done, stopped or failed."""
        return bool(self._end_state)

    @property
    def generations_done(self) -> int:
        """Return the number of finished generations of the longest run."""
        # Other runs can be shorter, because a stop part has ended them.
        return max((history.n_generations for history in self._histories), default=0)

    def pause(self) -> None:
        """Pause all runs within a few steps, not only at the end of a lifetime."""
        # After `stop`, a wait would never end.
        if not self._is_stopping:
            self._running.clear()

    def resume(self) -> None:
        """Continue the paused runs."""
        self._running.set()

    def stop(self) -> None:
        """Stop all runs. Pages can still show and save the finished generations."""
        self._is_stopping = True
        # The thread can wait for the end of a pause, or for the start of the next generation.
        self._running.set()
        self._wake_up.set()

    def wait(self) -> None:
        """Wait until all runs have ended."""
        self._thread.join()

    def handle_command(self, command: Any) -> None:
        """Execute a command of a page. Raise ValueError for an unknown command.

        A command is {"command": "pause"}, {"command": "resume"}, {"command": "stop"} or
        {"command": "pace", "seconds": 0.1}. The seconds are the new `seconds_per_generation`.
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

        Returns an entry for each of the measures `best`, `mean` and `share` (the fraction of agents
        that eat), and for each curve of each species, such as `mean:predators`. An entry contains
        `mean`, the mean over runs [generation]. With several runs, it also contains `low` and
        `high`, the 95 % interval of the mean [generation], and `runs`, the values of all runs
        [generation, run]. A run that ended early repeats the values of its last generation.
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
        """Return recorded variables of all runs, each [run, generation, agent]."""
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
        """Return the entry that `compute_measures` returns for one measure [run, generation]."""
        # This import takes time.
        from baldwinlab.analysis.statistics.intervals import interval_of_mean

        mean, low, high = interval_of_mean(values)
        curves = {"mean": mean}
        if self.n_runs > 1:
            # A single run has no interval.
            curves |= {"low": low, "high": high, "runs": values.transpose("generation", "run")}
        return {curve: _to_list(array) for curve, array in curves.items()}

    def read_fitness(self, run: int, generation: int) -> xr.DataArray:
        """Return the fitness of a run [generation, agent]. See `find_history` for the error."""
        fitness = self.find_history(run, generation).energy
        return xr.DataArray(fitness, dims=("generation", "agent"))

    def read_genomes(self, run: int, generation: int) -> Genome:
        """Return the genomes [agent, module, weight] of a generation of a run with species."""
        self.find_history(run, generation)
        return self._genomes[generation][run]

    def find_history(self, run: int, generation: int) -> History:
        """Return the history of one run. Raise ValueError if it has not finished `generation`."""
        if not 0 <= run < self.n_runs:
            raise ValueError(f"run = {run} must be at least 0 and less than {self.n_runs}")
        # `_histories` is empty until the first generation is finished.
        n_done = self._histories[run].n_generations if self._histories else 0
        if not 0 <= generation < n_done:
            raise ValueError(
                f"generation {generation} of the live run {self.id} is not finished:"
                f" {n_done} generations are"
            )
        return self._histories[run]

    def make_records(self) -> list[xr.Dataset]:
        """Return the records of all runs for a study. Raise StudyError unless all have ended."""
        if self._end_state not in ("done", "stopped"):
            raise StudyError(
                f"the live run {self.id} is {self.state}; only a run that is done or stopped can"
                " be saved"
            )
        if not self.generations_done:
            raise StudyError(f"the live run {self.id} has no finished generation to save")
        return [make_record(history) for history in self._histories]

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
            # An error on this thread reaches no caller, so the pages show the message.
            self.message = f"the live run failed: {error or type(error).__name__}"
            self._end_state = "failed"

    def _finish_generation(self, histories: Sequence[History]) -> None:
        """Store the histories of all runs, and wait until the next generation may start."""
        if self.experiment.population.species:
            self._genomes.append([history.last_genome for history in histories])
        self._histories = histories
        if self.generations_done == self.experiment.evolution.generations:
            return
        while not self._is_stopping:
            # A command can change the pace, so each pass of the loop computes the end again.
            generation_end = self._generation_start + self.seconds_per_generation
            seconds_left = generation_end - time.monotonic()
            if seconds_left <= 0:
                break
            self._wake_up.wait(seconds_left)
            self._wake_up.clear()
        self._check_commands()
        self._generation_start = time.monotonic()

    def _check_commands(self) -> None:
        """Wait while the runs are paused. Raise StoppedError if a page has stopped them."""
        self._running.wait()
        if self._is_stopping:
            raise StoppedError


def _take_until_last(values: npt.NDArray[Any], generations: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Return rows of `values` [generation, agent]. The last row replaces the rows after it."""
    return np.asarray(values[np.minimum(generations, len(values) - 1)])


def _to_list(array: xr.DataArray) -> list[Any]:
    """Return a nested list for JSON. None replaces NaN, the fitness of a species without agents."""
    values = array.values.astype(object)
    values[~np.isfinite(array.values)] = None
    nested_list: list[Any] = values.tolist()
    return nested_list


def read_seconds(command: dict[str, Any]) -> float:
    """Return the seconds per generation of a request. Raise ValueError for an invalid number."""
    seconds = command.get("seconds", 0)
    # Python counts True and False as integers.
    is_number = isinstance(seconds, int | float) and not isinstance(seconds, bool)
    if not is_number or not 0 <= seconds <= MAX_SECONDS_PER_GENERATION:
        raise ValueError(
            f"seconds = {seconds!r} must be a number from 0 to {MAX_SECONDS_PER_GENERATION:g}"
        )
    return float(seconds)
