"""Assay of canalization: fitness of agents, of their single mutants, and in a new world.

Each agent of the first, the middle and the last generation is replaced several times by a copy with
one mutation. A mutant has the initial position and the random numbers of the agent, so a difference
between the two lifetimes is an effect of the mutation. The agents are also simulated in a new
world: the world of a generation after the last generation, with the same settings.

The ideas are from C. H. Waddington, Canalization of development and the inheritance of acquired
characters, Nature 150 (1942), and G. P. Wagner, G. Booth and H. Bagheri-Chaichian, A population
genetic theory of canalization, Evolution 51 (1997).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np

from baldwinlab.evolution import GenerationKey, Genome
from baldwinlab.evolution.breeding import make_single_mutants
from baldwinlab.evolution.neat.operators import genome_part
from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.studies.assays import (
    LIFE_KINDS,
    OFF,
    ON,
    SIMULATION_OBSTACLES,
    Arrays,
    Assay,
    AssayPlan,
    Conditions,
    Energy,
    Sample,
    declare_fitness,
    first_middle_last,
)

# Minimum number of mutants per generation, unless `MAX_MUTANTS_OF_AGENT` limits the number.
MIN_MUTANTS: Final = 200
MAX_MUTANTS_OF_AGENT: Final = 10
# Labels of the stored world, and of the new world, which has other random numbers.
WORLDS: Final = ("stored", "new")


def plan_assay(study: Conditions, condition: str) -> AssayPlan:
    experiment = study.experiments[condition]
    generations = first_middle_last(experiment.evolution.generations)
    n_mutants = count_mutants(experiment)
    coordinates = {
        "generation": np.array(generations, np.int32),
        "life": [LIFE_KINDS[OFF], LIFE_KINDS[ON]],
        "world": list(WORLDS),
        "mutant": np.arange(n_mutants, dtype=np.int32),
    }
    n_life_kinds = 2 if experiment.learns else 1
    return AssayPlan(coordinates, len(generations) * n_life_kinds * (len(WORLDS) + n_mutants))


def count_mutants(experiment: BaseExperiment) -> int:
    """Return the number of mutants of each agent."""
    return min(math.ceil(MIN_MUTANTS / experiment.population.size), MAX_MUTANTS_OF_AGENT)


def measure(sample: Sample) -> Arrays:
    """Measure `energy` and `mutant_energy`.

    `energy` has the dimensions [run, generation, life, world, agent], and `mutant_energy` [run,
    generation, life, mutant, agent]. The energy with learning on is NaN if agents do not learn.
    """
    experiment = sample.experiment
    generations = first_middle_last(experiment.evolution.generations)
    n_mutants = count_mutants(experiment)
    n_agents = experiment.population.size
    n_life_kinds = len((OFF, ON))
    shape = (len(generations), n_life_kinds, len(sample.runs), n_agents)
    energy = np.full((len(WORLDS), *shape), np.nan)
    mutant_energy = np.full((n_mutants, *shape), np.nan)
    for index, generation in enumerate(generations):
        genomes = sample.genomes(generation)
        current = experiment.at(generation)
        settings = [current.without_learning(), current] if current.learns else [current]
        # The run has no generation with this number, so the second world is new.
        for world, number in enumerate((generation, experiment.evolution.generations)):
            energy[world, index] = _simulate(sample, settings, number, genomes)
        life_of_study = ON if current.learns else OFF
        sample.require_stored_energy(
            generation, energy[WORLDS.index("stored"), index, life_of_study]
        )
        for mutant in range(n_mutants):
            mutants = _mutate(sample, generation, mutant, genomes)
            is_mutated = (mutants != genomes).any(axis=(-2, -1))
            fitness = _simulate(sample, settings, generation, mutants)
            mutant_energy[mutant, index] = np.where(is_mutated, fitness, np.nan)
    # [world or mutant, generation, life, run, agent]: the first and the run dimension are swapped.
    order = (3, 1, 2, 0, 4)
    return {"energy": energy.transpose(order), "mutant_energy": mutant_energy.transpose(order)}


def _mutate(sample: Sample, generation: int, mutant: int, genomes: Genome) -> Genome:
    """Return a single mutant of each agent [run, agent, module, weight]."""
    experiment = sample.experiment
    # Each mutant has keys of unused generations, because the run has used the other keys.
    offset = experiment.evolution.generations * (1 + mutant)
    mutants = [
        make_single_mutants(
            experiment.at(generation), GenerationKey(sample.seed, run, offset + generation), genome
        )
        for run, genome in zip(sample.runs, genomes, strict=True)
    ]
    return np.stack(mutants)


def _simulate(
    sample: Sample, settings: Sequence[Experiment], world: int, genomes: Genome
) -> Energy:
    """Return the energy [life, run, agent] in the world of a generation. See `measure`."""
    fitness = [sample.simulate(experiment, world, genomes).energy for experiment in settings]
    if len(fitness) == 1:
        fitness.append(np.full_like(fitness[0], np.nan))
    return np.stack(fitness)


def find_genome_obstacle(experiment: BaseExperiment) -> str:
    """Refuse genomes that encode graphs, as NEAT does."""
    if not genome_part(experiment).has_graph_genomes:
        return ""
    return (
        f"mutates one gene, and a mutation of the graph genomes of {experiment.name} can change "
        "several"
    )


ASSAY: Final = Assay(
    name="canalization",
    question="How robust is fitness to single mutations and to a new world?",
    variables={
        "energy": declare_fitness(
            ("generation", "life", "world", "agent"),
            "fitness of the agent in this kind of lifetime and in this world",
        ),
        "mutant_energy": declare_fitness(
            ("generation", "life", "mutant", "agent"),
            "fitness of a single mutant of the agent in the stored world; NaN without a mutation",
        ),
    },
    plan=plan_assay,
    measure=measure,
    obstacles=(*SIMULATION_OBSTACLES, find_genome_obstacle),
)
