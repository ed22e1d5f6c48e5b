"""Fork assay: evolve learners and their no-learning control further, with learning on and off.

The four branches of a start generation, two histories and two regimes, have the same random
numbers. A difference between histories shows what evolution with learning has changed in the
genomes. A difference between regimes shows what learning does now: it guides selection, or hides
genetic differences.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import product
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from baldwinlab.core.assay_variables import HISTORIES, MODE, REGIMES
from baldwinlab.evolution import GenerationKey, Genome, make_founders
from baldwinlab.experiment import BaseExperiment
from baldwinlab.experiment.controls import find_control
from baldwinlab.experiment.toml import to_toml
from baldwinlab.simulation.branch import evolve_genomes
from baldwinlab.studies.assays.sample import Conditions, Sample, first_middle_last

# Default length of a branch, in generations.
BRANCH_GENERATIONS: Final = 20


@dataclass(frozen=True)
class Fork:
    """The assay with one kind of start.

    Attributes
    ----------
    start : str
        POPULATION for the stored genomes, MODE for copies of the most frequent genotype.
    generations : int
        Number of generations from the start to the end of a branch.
    """

    start: str
    generations: int = BRANCH_GENERATIONS

    def coordinates(self, study: Conditions, condition: str) -> Mapping[str, Any]:
        """Return the start generations, the histories and the regimes."""
        starts = first_middle_last(study.experiments[condition].evolution.generations)
        return {
            "generation": np.array(starts, np.int32),
            "history": list(HISTORIES),
            "regime": list(REGIMES),
        }

    def count_lives(self, study: Conditions, condition: str) -> int:
        """Return the number of simulated generations per run."""
        starts = first_middle_last(study.experiments[condition].evolution.generations)
        branch_lives = self.generations + 1
        # With learning on, the newborns at the end are simulated again without learning.
        lives_of_history = len(REGIMES) * branch_lives + 1
        return len(starts) * len(HISTORIES) * lives_of_history

    def measure(self, sample: Sample) -> Mapping[str, npt.NDArray[Any]]:
        """Measure `innate_fitness` and `fitness` [run, generation, history, regime, agent]."""
        starts = first_middle_last(sample.experiment.evolution.generations)
        n_agents = sample.experiment.population.size
        shape = (len(sample.runs), len(starts), len(HISTORIES), len(REGIMES), n_agents)
        innate_fitness = np.empty(shape)
        fitness = np.empty(shape)
        # The settings of the learner are the regime "on", and those of its control are "off".
        # The order of the conditions is that of `HISTORIES` and of `REGIMES`.
        conditions = list(enumerate(_list_conditions(sample)))
        all_runs = slice(None)
        for start_index, generation in enumerate(starts):
            for (history_index, source), (regime_index, target) in product(conditions, repeat=2):
                branch = (all_runs, start_index, history_index, regime_index)
                results = self._evolve(sample, source, target, generation)
                innate_fitness[branch], fitness[branch] = results
        return {"innate_fitness": innate_fitness, "fitness": fitness}

    def _evolve(
        self, sample: Sample, source: Sample, target: Sample, generation: int
    ) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
        """Return the innate fitness and the fitness at the end of a branch, each [run, agent].

        The genomes are those of `source`, and the settings those of `target`.
        """
        genomes = source.genomes(generation)
        if self.start == MODE:
            genomes = np.stack([copy_mode(population) for population in genomes])
        end = generation + self.generations
        branch = evolve_genomes(
            target.experiment,
            sample.seed,
            sample.runs,
            range(generation, end + 1),
            fit_genomes(genomes, target),
            after_generation=sample.report_generation,
        )
        if self.start != MODE and source is target:
            source.require_stored_energy(generation, branch.fitness[:, 0])
        fitness = branch.fitness[:, -1]
        if target is not sample:
            # The agents of the control do not learn, so their fitness is innate.
            return fitness, fitness
        _, control = _list_conditions(sample)
        newborns = fit_genomes(branch.genomes, control)
        return sample.simulate(control.experiment, end, newborns).energy, fitness


def _list_conditions(sample: Sample) -> tuple[Sample, Sample]:
    """Return the samples of the learner and of its control, in the order of `HISTORIES`."""
    if sample.control is None:
        raise ValueError(f"{sample.experiment.name} has no no-learning control")
    return sample, sample.control


def fit_genomes(genomes: Genome, sample: Sample) -> Genome:
    """Return genomes [run, agent, module, weight] in the layout of a condition.

    Modules and genes that the condition does not use are removed. Missing modules and genes are
    taken from the founders of the same run.
    """
    experiment = sample.experiment
    layout = (len(experiment.modules), experiment.genome_length)
    n_modules, n_genes = np.minimum(genomes.shape[2:], layout)
    shared = genomes[:, :, :n_modules, :n_genes]
    if (n_modules, n_genes) == layout:
        return np.ascontiguousarray(shared)
    keys = [GenerationKey(sample.seed, run, 0) for run in sample.runs]
    fitted = np.stack([make_founders(experiment, key) for key in keys])
    fitted[:, :, :n_modules, :n_genes] = shared
    return fitted


def copy_mode(population: Genome) -> Genome:
    """Return copies of the most frequent genotype of a population [agent, module, weight].

    Of several equally frequent genotypes, the function selects the genotype nearest to the mean of
    the population. If all genotypes differ, as real-valued genomes do, it is the most central one.
    """
    genes = np.nan_to_num(population.reshape(len(population), -1).astype(np.float64))
    _, first_carriers, counts = np.unique(genes, axis=0, return_index=True, return_counts=True)
    candidates = first_carriers[counts == counts.max()]
    squared_distances = ((genes[candidates] - genes.mean(axis=0)) ** 2).sum(axis=1)
    mode = population[candidates[np.argmin(squared_distances)]]
    return np.ascontiguousarray(np.broadcast_to(mode, population.shape))


def find_obstacles(
    name: str, condition: str, experiments: Mapping[str, BaseExperiment]
) -> Iterator[str]:
    """Yield a sentence for each reason why a fork is not applicable to a condition."""
    experiment = experiments[condition]
    if not experiment.learns:
        yield f"the assay {name} needs a condition that learns"
    elif experiment.evolution.inheritance == "none":
        yield f"the assay {name} measures effects of evolution, which needs inherited genomes"
    elif not find_control(condition, experiments):
        yield (
            f"the assay {name} needs a no-learning control: a condition of the same study that "
            "differs only in that its agents do not learn"
        )


def describe_branches(
    experiments: Mapping[str, BaseExperiment], condition: str, generations: int
) -> dict[str, Any]:
    """Return the attributes of the dataset of a fork, in addition to those of every assay."""
    control = find_control(condition, experiments)
    return {
        "control": control,
        "control_experiment": to_toml(experiments[control]),
        "generations": generations,
    }
