"""One run: experiment and seed in, labelled arrays out."""

from __future__ import annotations

import platform
from collections.abc import Callable, Iterable, Sequence
from itertools import repeat
from typing import Any

import numba
import numpy as np
import numpy.typing as npt
import xarray as xr

from baldwinlab import variables
from baldwinlab.errors import ArgumentError
from baldwinlab.evolution import Genome, Moment, bequeath, draw_genome, fitness, next_genome
from baldwinlab.experiment import Experiment
from baldwinlab.experiment.idle import require_effect
from baldwinlab.experiment.toml import to_toml
from baldwinlab.models.miniworld.backend import CPU, Backend, choose
from baldwinlab.version import __version__

SEED_LIMIT = 2**31  # what a signed 32-bit attribute of a record can hold


def simulate(experiment: Experiment, *, seed: int = 0, run: int = 0, backend: str = "auto") -> xr.Dataset:
    """Evolve one population from its first generation to its last.

    `run` numbers the independent repetitions of a study; both it and `seed` are in [0, 2**31). `backend` is "auto", "cpu" or
    "cuda". Returns the variables of `baldwinlab.variables.RUN`, with the facts of the run in the attributes. Raises ValueError
    for a seed out of range, for a setting that would do nothing, and for a backend that cannot be used here.
    """
    require_effect([experiment])
    return simulate_block(experiment, seed, [run], choose(backend))[0]


def simulate_block(
    experiment: Experiment,
    seed: int,
    runs: Sequence[int],
    backend: Backend = CPU,
    after_generation: Callable[[Sequence[History]], None] = lambda histories: None,
) -> list[xr.Dataset]:
    """Several runs side by side, which is faster; each has the same bits as alone.

    `after_generation` is called, when a generation has lived, with each run as far as it is; what it raises ends the block.
    """
    check_seed(seed, *runs)
    block = backend.block(experiment, seed, runs)
    histories = [History(experiment, seed, run) for run in runs]
    for generation in range(experiment.evolution.generations):
        block.begin(generation, np.stack([history.genome for history in histories]))
        block.live(0, experiment.lifetime.steps)
        weights: Iterable[Genome | None] = block.weights() if _weights_count(experiment) else repeat(None, len(runs))
        for history, eaten, learned in zip(histories, block.eaten(), weights, strict=True):
            history.add(generation, eaten, learned)
        after_generation(histories)
    return [history.dataset() for history in histories]


def _weights_count(experiment: Experiment) -> bool:
    """Whether it matters what weights an agent dies with."""
    return experiment.learns and (experiment.evolution.lamarckian_share > 0 or experiment.learning.cost_per_change > 0)


def check_seed(seed: int, *runs: int) -> None:
    """Raises ArgumentError for a seed or a run that is not in [0, 2**31)."""
    for name, value in (("seed", seed), *(("run", run) for run in runs)):
        if not 0 <= value < SEED_LIMIT:
            raise ArgumentError(name, value, f"must be at least 0 and less than {SEED_LIMIT}")


class History:
    """What is kept of one run as its generations live and die, and the genomes of the generation that is next to live."""

    def __init__(self, experiment: Experiment, seed: int, run: int) -> None:
        self.experiment, self.seed, self.run = experiment, seed, run
        self.genome = draw_genome(experiment, Moment(seed, run, 0))
        self.lived = 0  # generations
        generations, agents = experiment.evolution.generations, experiment.population.size
        self._food = np.zeros((generations, agents), np.int32)
        self._energy = np.zeros((generations, agents))
        self._parents = np.full((generations, agents, 2), -1, np.int32)
        self._genomes = np.full((generations, *self.genome.shape), np.nan, np.float32)

    def add(self, generation: int, eaten: npt.NDArray[np.int32], learned: Genome | None) -> None:
        """Keep what a generation ate, `eaten` [agent, region], and breed the next.

        `learned` [agent, weight] is the action module at death, or None where it does not matter.
        """
        last = self.experiment.evolution.generations - 1
        if generation > 0 and (generation - 1) % self.experiment.record.genome_every:
            self._genomes[generation - 1] = np.nan  # it was kept for as long as it was the last
        self._genomes[generation] = self.genome
        self._food[generation] = eaten.sum(axis=1)
        self._energy[generation] = fitness(self.experiment, eaten, self.genome, learned)
        if generation < last:
            born = bequeath(self.experiment, self.genome, learned)
            moment = Moment(self.seed, self.run, generation + 1)
            self.genome, self._parents[generation + 1] = next_genome(self.experiment, moment, born, self._energy[generation])
        self.lived = generation + 1

    @property
    def food_eaten(self) -> npt.NDArray[np.int32]:
        """What each agent has eaten in life, [generation, agent], of the generations that have lived; what is there stays."""
        return self._food[: self.lived]

    @property
    def energy(self) -> npt.NDArray[np.float64]:
        """As `food_eaten`, the fitness."""
        return self._energy[: self.lived]

    def dataset(self) -> xr.Dataset:
        """The run, of as many generations as have lived: to the bit the run of an experiment with so many. At least one has.

        Its arrays are those of the history, so whoever keeps it while generations still live must copy it.
        """
        genomes = self._genomes[: self.lived]
        arrays = {
            "food_eaten": self.food_eaten,
            "energy": self.energy,
            "parents": self._parents[: self.lived],
            "genome": genomes,
        }
        experiment = self.experiment.replace(evolution={"generations": self.lived})
        found = variables.dataset(variables.RUN, arrays, facts(experiment, self.seed, self.run))
        generations, agents, _, weights = genomes.shape
        return found.assign_coords(
            generation=np.arange(generations, dtype=np.int32),
            agent=np.arange(agents, dtype=np.int32),
            parent=list(variables.PARENTS),
            module=list(self.experiment.modules),
            weight=np.arange(weights, dtype=np.int32),
        )


def facts(experiment: Experiment, seed: int, run: int) -> dict[str, Any]:
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
