"""The history of one run: recorded variables, saved genomes, and the current generation."""

from __future__ import annotations

import platform
from typing import Any

import numba
import numpy as np
import numpy.typing as npt
import xarray as xr

from baldwinlab._version import __version__
from baldwinlab.core import variables
from baldwinlab.evolution import (
    GenerationKey,
    Genome,
    apply_inheritance,
    draw_genomes,
    fitness,
    make_generation,
    remap_parents,
)
from baldwinlab.experiment import BaseExperiment
from baldwinlab.experiment.toml import to_toml
from baldwinlab.parts.model_part import LifeResults


class History:
    """The recorded variables of one run, and the genomes of its next generation.

    Attributes
    ----------
    genome : Genome
        Genomes of the next generation, [agent, module, weight].
    n_generations : int
        Number of simulated generations.
    """

    def __init__(self, experiment: BaseExperiment, seed: int, run: int) -> None:
        self.experiment = experiment
        self.seed = seed
        self.run = run
        self.genome = draw_genomes(experiment, GenerationKey(seed, run, 0))
        self.n_generations = 0
        generations = experiment.evolution.generations
        agents = experiment.population.size
        self._energy = np.zeros((generations, agents))
        self._records: dict[str, npt.NDArray[Any]] = {}
        self._parents = np.full((generations, agents, 2), -1, np.int32)
        self._saved_genomes: dict[int, Genome] = {}

    def add(self, generation: int, results: LifeResults, index: int) -> None:
        """Record a generation and make the next one.

        Parameters
        ----------
        generation : int
            Number of the generation.
        results : LifeResults
            Results of the batch.
        index : int
            Index of this run in the batch.
        """
        last = self.experiment.evolution.generations - 1
        if generation > 0 and (generation - 1) % self.experiment.record.genome_every:
            # The genomes of the last generation are always saved; this is no longer the last one.
            del self._saved_genomes[generation - 1]
        self._saved_genomes[generation] = self.genome
        for name, values in results.records.items():
            recorded = self._records.setdefault(
                name, np.zeros((last + 1, values.shape[1]), values.dtype)
            )
            recorded[generation] = values[index]
        self._energy[generation] = fitness(
            self.experiment, results.energy[index], results.cost[index]
        )
        if generation < last:
            final = results.final_population
            learned = None if results.learned is None else results.learned[index]
            genome = self.genome if final is None else final.genome[index]
            inherited = apply_inheritance(self.experiment, genome, learned)
            key = GenerationKey(self.seed, self.run, generation + 1)
            self.genome, self._parents[generation + 1] = make_generation(
                self.experiment, key, inherited, self._energy[generation]
            )
            if final is not None:
                remap_parents(final.origin[index], self._parents[generation + 1])
        self.n_generations = generation + 1

    def recorded_values(self, name: str) -> npt.NDArray[Any]:
        """Return a recorded variable, [generation, agent], of the simulated generations."""
        return self._records[name][: self.n_generations]

    def saved_genomes_until(self, generation: int) -> tuple[int, Genome]:
        """Return the last generation up to `generation` with saved genomes, and its genomes."""
        # Copy the dictionary at once: another thread may add a generation.
        saved = self._saved_genomes.copy()
        last = max(number for number in saved if number <= generation)
        return last, saved[last]

    @property
    def energy(self) -> npt.NDArray[np.float64]:
        """Fitness, [generation, agent], of the simulated generations."""
        return self._energy[: self.n_generations]

    @property
    def parents(self) -> npt.NDArray[np.int32]:
        """Parents, [generation, agent, parent], of the simulated generations."""
        return self._parents[: self.n_generations]

    def dataset(self) -> xr.Dataset:
        """Return the simulated generations as a dataset; at least one generation is required.

        The dataset is bit-identical to the run of an experiment with this number of generations. It
        shares its arrays with the history: copy it if the simulation continues.
        """
        return variables.from_storage(self.record())

    def record(self) -> xr.Dataset:
        """Return the run in its storage form: the variables of `core.variables.of_record`."""
        genomes = np.stack(list(self._saved_genomes.values()))
        arrays = {name: self.recorded_values(name) for name in self._records}
        arrays |= {"energy": self.energy, "parents": self.parents}
        experiment = self.experiment.replace(evolution={"generations": self.n_generations})
        declared = variables.of_record(experiment)
        attributes = provenance(experiment, self.seed, self.run)
        dataset = variables.dataset(declared, arrays, attributes)
        _, agents, _, weights = genomes.shape
        labelled = dataset.assign_coords(
            generation=np.arange(self.n_generations, dtype=np.int32),
            agent=np.arange(agents, dtype=np.int32),
            parent=list(variables.PARENTS),
            module=list(self.experiment.modules),
            weight=np.arange(weights, dtype=np.int32),
            kept_generation=np.array(list(self._saved_genomes), np.int32),
        )
        return labelled.assign(variables.dataset(declared, {"kept_genome": genomes}, {}).data_vars)


def provenance(experiment: BaseExperiment, seed: int, run: int) -> dict[str, Any]:
    """Return the attributes that are required to reproduce a result."""
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
