"""Fork assay: evolve learners and their no-learning control further, with learning on and off.

The branches start from the last generation, from the genomes of the learner or of its control (the
history), and evolve with learning on or off (the regime). The four branches of a run have the same
random numbers. A difference between histories shows that earlier learning has changed the evolution
of the genomes. A difference between regimes is a present effect of learning: learning guides
selection, or hides genetic differences.

If the study has no control, the assay simulates it from the founders of each run.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from typing import Final

import numpy as np

from baldwinlab.evolution import Genome, make_founders, make_run_keys
from baldwinlab.experiment import BaseExperiment
from baldwinlab.experiment.conditions import find_control
from baldwinlab.simulation.records import make_record
from baldwinlab.simulation.simulate import Branch, evolve_genomes, simulate_histories
from baldwinlab.studies.assays import (
    SIMULATION_OBSTACLES,
    Arrays,
    Assay,
    AssayPlan,
    Conditions,
    Sample,
    declare_fitness,
)

# Default length of a branch, in generations.
BRANCH_GENERATIONS: Final = 20
# Histories and regimes of the branches.
HISTORIES: Final = ("learner", "control")
REGIMES: Final = ("on", "off")
# Starts of the branches: the stored genomes, or copies of the most frequent genotype.
POPULATION: Final = "population"
MODE: Final = "mode"
# Name of the assay by the start of its branches.
FORKS: Final[Mapping[str, str]] = {POPULATION: "fork", MODE: "fork-mode"}
QUESTIONS: Final = {
    POPULATION: (
        "Did evolution with learning lead to better genomes, and does learning guide or hide now?"
    ),
    MODE: "The same question, for copies of the most frequent genotype.",
}


@dataclass(frozen=True)
class Fork:
    """Branches with one kind of start."""

    start: str
    # Number of generations from the start to the end of a branch.
    generations: int = BRANCH_GENERATIONS

    def plan(self, study: Conditions, condition: str) -> AssayPlan:
        """Return the plan: the start generation, the histories and the regimes."""
        n_generations = study.experiments[condition].evolution.generations
        coordinates = {
            "generation": np.array([n_generations - 1], np.int32),
            "history": list(HISTORIES),
            "regime": list(REGIMES),
        }
        has_control = bool(find_control(condition, study.experiments))
        lives_of_control = 0 if has_control else n_generations
        branch_lives = self.generations + 1
        # With learning on, the newborns at the end are simulated again without learning.
        lives_of_history = len(REGIMES) * branch_lives + 1
        return AssayPlan(coordinates, lives_of_control + len(HISTORIES) * lives_of_history)

    def measure(self, sample: Sample) -> Arrays:
        """Measure `innate_fitness` and `fitness` [run, generation, history, regime, agent]."""
        start = sample.experiment.evolution.generations - 1
        control = sample.control or simulate_control(sample)
        n_agents = sample.experiment.population.size
        shape = (len(sample.runs), 1, len(HISTORIES), len(REGIMES), n_agents)
        innate_fitness = np.empty(shape)
        fitness = np.empty(shape)
        # With the settings of the learner the regime is "on", with those of the control "off". The
        # order of `conditions` is therefore the order of `HISTORIES` and of `REGIMES`.
        conditions = list(enumerate((sample, control)))
        for (history_index, source), (regime_index, target) in product(conditions, repeat=2):
            branch = self._evolve(source, target, start)
            fitness_at_end = branch.fitness[:, -1]  # [run, agent].
            innate_fitness_at_end = fitness_at_end
            # The agents of the control do not learn, so their fitness is innate.
            if target is sample:
                end = start + self.generations
                newborns = fit_genomes(branch.genomes, control)
                innate_fitness_at_end = sample.simulate(control.experiment, end, newborns).energy
            innate_fitness[:, 0, history_index, regime_index] = innate_fitness_at_end
            fitness[:, 0, history_index, regime_index] = fitness_at_end
        return {"innate_fitness": innate_fitness, "fitness": fitness}

    def _evolve(self, source: Sample, target: Sample, start: int) -> Branch:
        """Evolve the genomes of `source` with the settings of `target`."""
        genomes = source.genomes(start)
        if self.start == MODE:
            genomes = np.stack([copy_mode(population) for population in genomes])
        branch = evolve_genomes(
            target.experiment,
            target.seed,
            target.runs,
            range(start, start + self.generations + 1),
            fit_genomes(genomes, target),
            after_generation=target.report_generation,
        )
        if self.start != MODE and source is target:
            source.require_stored_energy(start, branch.fitness[:, 0])
        return branch


def simulate_control(sample: Sample) -> Sample:
    """Return the same runs of the no-learning control, simulated from their founders."""
    control = sample.experiment.without_learning()
    histories = simulate_histories(
        control,
        sample.seed,
        sample.runs,
        after_generation=lambda _: sample.report_generation(),
    )
    records = [make_record(history) for history in histories]
    return replace(sample, experiment=control, records=records)


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
    fitted = make_founders(experiment, make_run_keys(sample.seed, sample.runs, 0))
    fitted[:, :, :n_modules, :n_genes] = shared
    return fitted


def copy_mode(population: Genome) -> Genome:
    """Return copies of the most frequent genotype of a population [agent, module, weight].

    Of several equally frequent genotypes, the function selects the genotype nearest to the mean of
    the population. Usually all real-valued genomes differ. Then this is the most central genotype.
    """
    genes = np.nan_to_num(population.reshape(len(population), -1).astype(np.float64))
    _, first_carriers, counts = np.unique(genes, axis=0, return_index=True, return_counts=True)
    candidates = first_carriers[counts == counts.max()]
    squared_distances = ((genes[candidates] - genes.mean(axis=0)) ** 2).sum(axis=1)
    mode = population[candidates[np.argmin(squared_distances)]]
    return np.ascontiguousarray(np.broadcast_to(mode, population.shape))


def find_evolution_obstacle(experiment: BaseExperiment) -> str:
    """Refuse conditions without learning or without inherited genomes."""
    if not experiment.learns:
        return "needs a condition that learns"
    if experiment.evolution.inheritance == "none":
        return "measures effects of evolution, which needs inherited genomes"
    return ""


def declare_fork(start: str, generations: int = BRANCH_GENERATIONS) -> Assay:
    """Return the assay with one kind of start, and with branches of a number of generations."""
    fork = Fork(start, generations)
    dims = ("generation", "history", "regime", "agent")
    return Assay(
        name=FORKS[start],
        question=QUESTIONS[start],
        variables={
            "innate_fitness": declare_fitness(
                dims, "fitness without learning at the end of the branch"
            ),
            "fitness": declare_fitness(dims, "fitness in the regime of the branch, at its end"),
        },
        plan=fork.plan,
        measure=fork.measure,
        obstacles=(*SIMULATION_OBSTACLES, find_evolution_obstacle),
        uses_control=True,
        with_branches=partial(declare_fork, start),
        attributes={"generations": generations},
        # The records of the learner, of the control and of a branch.
        n_records=3,
    )


FORK: Final = declare_fork(POPULATION)
FORK_MODE: Final = declare_fork(MODE)
