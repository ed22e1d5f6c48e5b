"""Assay of opponents: selected generations of a species meet generations of the other species.

The fitness of a species depends on the other species, which evolves too. Progress is visible only
against the same opponents, so all pairs of selected generations are simulated together.

References
----------
.. [1] D. Cliff and G. F. Miller, "Tracking the Red Queen: measurements of adaptive progress in
   co-evolutionary simulations", ECAL 1995: current individuals against ancestral opponents.
.. [2] D. Floreano and S. Nolfi, "God save the Red Queen! Competition in co-evolutionary robotics",
   Genetic Programming 1997: the tournament between all generations.
.. [3] S. Nolfi and D. Floreano, "Coevolving predator and prey robots: do arms races arise in
   artificial evolution?", Artificial Life 4 (1998).
"""

from __future__ import annotations

from itertools import product
from typing import Final

import numpy as np

from baldwinlab.experiment import BaseExperiment
from baldwinlab.experiment.species import ACROSS
from baldwinlab.studies.assays import (
    Arrays,
    Assay,
    AssayPlan,
    Conditions,
    Sample,
    declare_fitness,
    find_archive_obstacle,
    find_birth_obstacle,
    find_model_obstacle,
)

N_GENERATIONS: Final = 5
"""Maximum number of generations of each species that meet."""
N_WORLDS: Final = 3
"""Number of worlds in which two generations meet."""


def plan_assay(study: Conditions, condition: str) -> AssayPlan:
    experiment = study.experiments[condition]
    generations = np.array(assayed_generations(experiment), np.int32)
    coordinates = {
        "first_generation": generations,
        "second_generation": generations,
        "species": [species.name for species in experiment.population.species],
    }
    # The last generation is simulated once more, as in the study.
    return AssayPlan(coordinates, 1 + len(generations) ** 2 * N_WORLDS)


def measure(sample: Sample) -> Arrays:
    """Measure `energy` [run, first generation, second generation, species]."""
    generations = assayed_generations(sample.experiment)
    genomes = [sample.genomes(generation) for generation in generations]
    last_generation = generations[-1]
    sample.require_stored_energy(
        last_generation, sample.simulate_species(last_generation, genomes[-1])
    )
    # The first `size` agents of a genome array belong to the first species.
    size, _ = (species.size for species in sample.experiment.population.species)
    n_generations = len(generations)
    energy = np.empty((len(sample.runs), n_generations, n_generations, 2))
    for first, second in product(range(n_generations), repeat=2):
        meeting = np.concatenate([genomes[first][:, :size], genomes[second][:, size:]], axis=1)
        # No generation of the runs has used these worlds.
        first_world = sample.experiment.evolution.generations
        worlds = range(first_world, first_world + N_WORLDS)
        fitness = np.mean([sample.simulate_species(world, meeting) for world in worlds], axis=0)
        energy[:, first, second, 0] = fitness[:, :size].mean(axis=1)
        energy[:, first, second, 1] = fitness[:, size:].mean(axis=1)
    return {"energy": energy}


def assayed_generations(experiment: BaseExperiment) -> list[int]:
    """Return the first generation, the last, and some between them with stored genomes."""
    last_generation = experiment.evolution.generations - 1
    storage_interval = experiment.record.genome_every
    n_intervals = N_GENERATIONS - 1
    positions = [last_generation * index // n_intervals for index in range(n_intervals)]
    stored = {position - position % storage_interval for position in positions}
    return sorted({*stored, last_generation})


def find_opponent_obstacle(experiment: BaseExperiment) -> str:
    """Refuse conditions without two species that evolve separately."""
    is_separate = experiment.evolution.compete != ACROSS
    if len(experiment.population.species) == 2 and is_separate:
        return ""
    return 'needs two species that evolve separately (evolution.compete = "within")'


ASSAY: Final = Assay(
    name="opponents",
    question="Do two species that evolve together improve against the same opponents?",
    variables={
        "energy": declare_fitness(
            ("first_generation", "second_generation", "species"),
            "mean fitness of the agents of a species when these generations meet",
        ),
    },
    plan=plan_assay,
    measure=measure,
    obstacles=(
        find_archive_obstacle,
        find_birth_obstacle,
        find_model_obstacle,
        find_opponent_obstacle,
    ),
)
