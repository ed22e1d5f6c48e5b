"""History of one run: recorded variables, saved genomes, and the genomes of the next generation."""

from __future__ import annotations

import platform
from typing import Any, Final, NamedTuple

import numba
import numpy as np
import numpy.typing as npt
import xarray as xr

from baldwinlab._version import __version__
from baldwinlab.core import variables
from baldwinlab.core.errors import RefusedError
from baldwinlab.evolution import (
    GenerationKey,
    Genome,
    apply_inheritance,
    fitness,
    make_founders,
    make_generation,
    remap_parents,
)
from baldwinlab.experiment import BaseExperiment
from baldwinlab.experiment.toml import to_toml
from baldwinlab.parts.model_part import LifeResults

# Variables of a record that are not those of the model.
STRUCTURE: Final = frozenset({"energy", "parents", "kept_genome"})


class BranchStart(NamedTuple):
    """First simulated generation of a history, and its genomes, [agent, module, weight]."""

    generation: int
    genome: Genome


class History:
    """The recorded variables of one run, and the genomes of its next generation.

    Attributes
    ----------
    genome : Genome
        Genomes of the next generation, [agent, module, weight].
    n_generations : int
        Number of simulated generations.
    """

    def __init__(
        self,
        experiment: BaseExperiment,
        seed: int,
        run: int,
        record: xr.Dataset | None = None,
        start: BranchStart | None = None,
    ) -> None:
        """Begin with the founders, the last generation of a stored `record`, or with `start`."""
        self.experiment = experiment
        self.seed = seed
        self.run = run
        self.n_generations = 0
        generations = experiment.evolution.generations
        agents = experiment.population.size
        self._energy = np.zeros((generations, agents))
        self._records: dict[str, npt.NDArray[Any]] = {}
        self._parents = np.full((generations, agents, 2), -1, np.int32)
        self._saved_genomes: dict[int, Genome] = {}
        # Energy of the last generation of the record, which is simulated again.
        self._expected_energy: npt.NDArray[np.float64] | None = None
        if record is not None:
            self._restore(record)
        elif start is not None:
            self.n_generations, self.genome = start
        else:
            self.genome = make_founders(experiment, GenerationKey(seed, run, 0))

    def _restore(self, record: xr.Dataset) -> None:
        """Copy all generations of a record but the last, which is simulated again.

        The last generation is simulated again because a record holds no learned weights, and no
        agents that were born during a lifetime. The next generation can depend on them.
        """
        last = record.sizes["generation"] - 1
        declared = variables.record_variables(self.experiment)
        for name in declared.keys() - STRUCTURE:
            self._allocate(name, record[name].values)[:last] = record[name].values[:last]
        self._energy[:last] = record["energy"].values[:last]
        self._parents[: last + 1] = record["parents"].values
        genomes = record["kept_genome"].values.astype(np.float32)
        saved = dict(zip(record["kept_generation"].values.tolist(), genomes, strict=True))
        self.genome = saved.pop(last)
        self._saved_genomes = saved
        self._expected_energy = record["energy"].values[last]
        self.n_generations = last

    def _allocate(self, name: str, values: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """Return the array of a recorded variable, whose `values` are [..., agent]."""
        shape = (self.experiment.evolution.generations, values.shape[1])
        return self._records.setdefault(name, np.zeros(shape, values.dtype))

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
        current = self.experiment.at(generation)
        if generation > 0 and (generation - 1) % self.experiment.record.genome_every:
            # Its genomes were saved only because it was the last simulated generation.
            self._saved_genomes.pop(generation - 1, None)
        self._saved_genomes[generation] = self.genome
        for name, values in results.records.items():
            self._allocate(name, values)[generation] = values[index]
        self._energy[generation] = fitness(current, results.energy[index], results.cost[index])
        self._require_expected_energy(generation)
        if generation < last:
            final = results.final_population
            learned = None if results.learned is None else results.learned[index]
            genome = self.genome if final is None else final.genome[index]
            inherited = apply_inheritance(current, genome, learned)
            key = GenerationKey(self.seed, self.run, generation + 1)
            self.genome, self._parents[generation + 1] = make_generation(
                self.experiment, key, inherited, self._energy[generation]
            )
            if final is not None:
                remap_parents(final.origin[index], self._parents[generation + 1])
        self.n_generations = generation + 1

    def _require_expected_energy(self, generation: int) -> None:
        """Raise RefusedError if the last generation of the record gives another energy now."""
        expected = self._expected_energy
        self._expected_energy = None
        if expected is not None and not np.array_equal(expected, self._energy[generation]):
            raise RefusedError(
                f"run {self.run} of {self.experiment.name} cannot be continued: generation "
                f"{generation} gives other results than those that are stored. Use the version of "
                "baldwinlab and of the parts that made the study"
            )

    def recorded_values(self, name: str) -> npt.NDArray[Any]:
        """Return a recorded variable, [generation, agent], of the simulated generations."""
        return self._records[name][: self.n_generations]

    def saved_genomes_until(self, generation: int) -> tuple[int, Genome]:
        """Return number and genomes of the last saved generation, at most `generation`."""
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
        return variables.as_run(self.record())

    def record(self) -> xr.Dataset:
        """Return the run in its storage form: the variables of `core.variables.of_record`."""
        genomes = np.stack(list(self._saved_genomes.values()))
        arrays = {name: self.recorded_values(name) for name in self._records}
        arrays |= {"energy": self.energy, "parents": self.parents}
        experiment = self.experiment.replace(evolution={"generations": self.n_generations})
        declared = variables.record_variables(experiment)
        attributes = provenance_attributes(experiment, self.seed, self.run)
        dataset = variables.make_dataset(declared, arrays, attributes)
        _, agents, _, weights = genomes.shape
        labelled = dataset.assign_coords(
            generation=np.arange(self.n_generations, dtype=np.int32),
            agent=np.arange(agents, dtype=np.int32),
            parent=list(variables.PARENT_NAMES),
            module=list(self.experiment.modules),
            weight=np.arange(weights, dtype=np.int32),
            kept_generation=np.array(list(self._saved_genomes), np.int32),
        )
        return labelled.assign(
            variables.make_dataset(declared, {"kept_genome": genomes}, {}).data_vars
        )


def provenance_attributes(experiment: BaseExperiment, seed: int, run: int) -> dict[str, Any]:
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
