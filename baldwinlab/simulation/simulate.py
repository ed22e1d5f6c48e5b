"""One run: experiment and seed in, labelled arrays out."""

from __future__ import annotations

import platform
from collections.abc import Callable, Sequence
from typing import Any

import numba
import numpy as np
import numpy.typing as npt
import xarray as xr

from baldwinlab._version import __version__
from baldwinlab.core import variables
from baldwinlab.core.errors import ArgumentError
from baldwinlab.core.resources import require
from baldwinlab.evolution import (
    GenerationKey,
    Genome,
    draw_genomes,
    fitness,
    inherit_genomes,
    make_generation,
    remap_parents,
)
from baldwinlab.experiment import BaseExperiment
from baldwinlab.experiment.toml import to_toml
from baldwinlab.experiment.unused_settings import require_effect
from baldwinlab.models import make_simulator
from baldwinlab.models.miniworld.backends.choice import CPU, Backend, choose
from baldwinlab.parts.model_part import LifeResults
from baldwinlab.simulation.memory import estimate_simulation

SEED_LIMIT = 2**31  # what a signed 32-bit attribute of a record can hold


def simulate(
    experiment: BaseExperiment,
    *,
    seed: int = 0,
    run: int = 0,
    backend: str = "auto",
    force: bool = False,
) -> xr.Dataset:
    """Simulate one run: a population from its first generation to its last.

    Parameters
    ----------
    experiment
        The settings.
    seed
        Seed of all random numbers, 0 to 2**31 - 1.
    run
        Number of the run, 0 to 2**31 - 1. Runs of the same seed are independent.
    backend
        "cpu", "cuda", or "auto" for the fastest that is available. All give the same bits.
    force
        Run even if less memory is free than the estimate.

    Returns
    -------
    xarray.Dataset
        The variables of `baldwinlab.core.variables.RUN`, with the dimensions `generation` and
        `agent`. The attributes name the experiment, the seed and the versions.

    Raises
    ------
    ArgumentError
        The seed or the number of the run is out of range.
    ExperimentError
        A setting has no effect.
    RefusedError
        The backend cannot be used on this machine, or too little memory is free.
    """
    require_effect([experiment])
    require(experiment.name, estimate_simulation(experiment), force=force)
    return simulate_batch(experiment, seed, [run], choose(backend))[0]


def simulate_batch(
    experiment: BaseExperiment,
    seed: int,
    runs: Sequence[int],
    backend: Backend = CPU,
    after_generation: Callable[[Sequence[History]], None] = lambda histories: None,
) -> list[xr.Dataset]:
    """Several runs side by side, which is faster; each has the same bits as alone. Arguments are those of `simulate_histories`."""
    return [
        history.dataset()
        for history in simulate_histories(experiment, seed, runs, backend, after_generation)
    ]


def simulate_histories(
    experiment: BaseExperiment,
    seed: int,
    runs: Sequence[int],
    backend: Backend = CPU,
    after_generation: Callable[[Sequence[History]], None] = lambda histories: None,
) -> list[History]:
    """Several runs side by side, each as its history, which holds no more genomes than the experiment keeps.

    `after_generation` is called, when a generation has lived, with each run as far as it is; what it raises ends the batch.
    """
    check_seed(seed, *runs)
    lives = make_simulator(experiment, seed, runs, backend)
    histories = [History(experiment, seed, run) for run in runs]
    for generation in range(experiment.evolution.generations):
        lived = lives.simulate(generation, np.stack([history.genome for history in histories]))
        for number, history in enumerate(histories):
            history.add(generation, lived, number)
        after_generation(histories)
    return histories


def check_seed(seed: int, *runs: int) -> None:
    """Raises ArgumentError for a seed or a run that is not in [0, 2**31)."""
    for name, value in (("seed", seed), *(("run", run) for run in runs)):
        if not 0 <= value < SEED_LIMIT:
            raise ArgumentError(name, value, f"must be at least 0 and less than {SEED_LIMIT}")


class History:
    """What is kept of one run as its generations live and die, and the genomes of the generation that is next to live."""

    def __init__(self, experiment: BaseExperiment, seed: int, run: int) -> None:
        self.experiment, self.seed, self.run = experiment, seed, run
        self.genome = draw_genomes(experiment, GenerationKey(seed, run, 0))
        self.lived = 0  # generations
        generations, agents = experiment.evolution.generations, experiment.population.size
        self._energy = np.zeros((generations, agents))
        self._records: dict[str, npt.NDArray[Any]] = {}
        self._parents = np.full((generations, agents, 2), -1, np.int32)
        self._kept: dict[int, Genome] = {}  # by generation

    def add(self, generation: int, lives: LifeResults, number: int) -> None:
        """Keep what became of a generation of this run, the one of that number among the `lives`, and breed the next."""
        last = self.experiment.evolution.generations - 1
        if generation > 0 and (generation - 1) % self.experiment.record.genome_every:
            del self._kept[generation - 1]  # it was kept for as long as it was the last
        self._kept[generation] = self.genome
        for name, values in lives.records.items():
            kept = self._records.setdefault(
                name, np.zeros((last + 1, values.shape[1]), values.dtype)
            )
            kept[generation] = values[number]
        self._energy[generation] = fitness(
            self.experiment, lives.energy[number], lives.cost[number]
        )
        if generation < last:
            learned = None if lives.learned is None else lives.learned[number]
            living = (
                None if lives.final_population is None else lives.final_population.genome[number]
            )
            born = inherit_genomes(
                self.experiment, self.genome if living is None else living, learned
            )
            key = GenerationKey(self.seed, self.run, generation + 1)
            self.genome, self._parents[generation + 1] = make_generation(
                self.experiment, key, born, self._energy[generation]
            )
            if lives.final_population is not None:
                remap_parents(lives.final_population.origin[number], self._parents[generation + 1])
        self.lived = generation + 1

    def recorded_values(self, name: str) -> npt.NDArray[Any]:
        """What is recorded of each agent, [generation, agent], of the generations that have lived; what is there stays."""
        return self._records[name][: self.lived]

    def saved_genomes_until(self, generation: int) -> tuple[int, Genome]:
        """The last generation up to this one, which has lived, whose genomes are kept; and these, [agent, module, weight]."""
        kept = self._kept.copy()  # in one go, as generations may live meanwhile
        last = max(each for each in kept if each <= generation)
        return last, kept[last]

    @property
    def energy(self) -> npt.NDArray[np.float64]:
        """The fitness, [generation, agent], of the generations that have lived; what is there stays."""
        return self._energy[: self.lived]

    @property
    def parents(self) -> npt.NDArray[np.int32]:
        """As recorded, [generation, agent, parent], of the generations that have lived; what is there stays."""
        return self._parents[: self.lived]

    def dataset(self) -> xr.Dataset:
        """The run, of as many generations as have lived: to the bit the run of an experiment with so many. At least one has.

        Its arrays are those of the history, so whoever keeps it while generations still live must copy it.
        """
        return variables.from_storage(self.record())

    def record(self) -> xr.Dataset:
        """As `dataset`, in the form in which it is stored: the variables of `baldwinlab.core.variables.of_record`."""
        genomes = np.stack(list(self._kept.values()))
        arrays = {
            **{name: self.recorded_values(name) for name in self._records},
            "energy": self.energy,
        }
        arrays["parents"] = self.parents
        experiment = self.experiment.replace(evolution={"generations": self.lived})
        declared = variables.of_record(experiment)
        found = variables.dataset(declared, arrays, provenance(experiment, self.seed, self.run))
        _, agents, _, weights = genomes.shape
        labelled = found.assign_coords(
            generation=np.arange(self.lived, dtype=np.int32),
            agent=np.arange(agents, dtype=np.int32),
            parent=list(variables.PARENTS),
            module=list(self.experiment.modules),
            weight=np.arange(weights, dtype=np.int32),
            kept_generation=np.array(list(self._kept), np.int32),
        )
        return labelled.assign(variables.dataset(declared, {"kept_genome": genomes}, {}).data_vars)


def provenance(experiment: BaseExperiment, seed: int, run: int) -> dict[str, Any]:
    """What a result must carry to be made again."""
    return {
        "experiment": to_toml(experiment),
        "condition": experiment.name,
        "seed": seed,
        "run": run,
        "weight_order": variables.WEIGHT_ORDER,
        "baldwinlab": __version__,
        "python": platform.python_version(),
        "numpy": np.__version__,
        "numba": numba.__version__,
        "platform": platform.platform(),
    }
