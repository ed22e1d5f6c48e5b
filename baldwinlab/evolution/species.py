"""Genomes and random numbers of the species of a population.

Agents are numbered species after species. Stored genomes [agent, module, weight] have the layout of
the longest genome. Entries that a species does not use are 0.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np
import numpy.typing as npt

from baldwinlab.engine import rng
from baldwinlab.evolution.rng_key import Genome, Parents, RunKeys
from baldwinlab.experiment import BaseExperiment
from baldwinlab.experiment.species import ACROSS

# [agent]: the index of the species of each agent.
SpeciesIndices = npt.NDArray[np.int32]


@cache
def derive_seed(seed: int, species: int) -> int:
    """Return the seed of a species: `seed` for species 0, or another number in [0, 2**31)."""
    if species == 0:
        return seed
    n_species = species + 1
    words = rng.words(seed, 0, 0, rng.SPECIES_SEED, (n_species, 1))
    # The sign bit of a seed is 0.
    return int(words[species, 0, 0]) >> 1


def derive_key(keys: RunKeys, species: int) -> RunKeys:
    """Return the keys of the random numbers of a species in a generation of several runs."""
    return keys._replace(seed=derive_seed(keys.seed, species))


def list_initial_species(experiment: BaseExperiment) -> SpeciesIndices:
    """Return the species of each agent in the first generation."""
    sizes = [species.size for species in experiment.population.species]
    return np.repeat(np.arange(len(sizes), dtype=np.int32), sizes)


def count_agents(species: SpeciesIndices, n_species: int) -> npt.NDArray[np.int64]:
    """Return the number of agents of each species."""
    return np.bincount(species, minlength=n_species)


def list_founder_experiments(experiment: BaseExperiment) -> list[BaseExperiment]:
    """Return one experiment per species, from which the founders of the species are drawn.

    If selection acts across species, a child can have parents of two species. Founders then have
    all modules of the longest genome, and a species ignores the modules that it does not use.
    """
    members = experiment.species_experiments()
    if experiment.evolution.compete != ACROSS:
        return list(members)
    longest = max(members, key=lambda member: len(member.modules))
    return [
        member if len(member.modules) == len(longest.modules) else _with_modules(member, longest)
        for member in members
    ]


def _with_modules(member: BaseExperiment, longest: BaseExperiment) -> BaseExperiment:
    """Return the experiment `longest` with size and genome files of another species."""
    founders = [entry.model_dump(mode="json") for entry in member.evolution.founders]
    return longest.replace(
        population={"size": member.population.size}, evolution={"founders": founders}
    )


def stack_genomes(experiment: BaseExperiment, genomes: Sequence[Genome]) -> Genome:
    """Return the genomes of all species as one array, with 0 where a genome has no entry.

    `genomes`: genomes of each species, [run, agent, module, weight].
    """
    n_agents = sum(genome.shape[1] for genome in genomes)
    shape = (len(genomes[0]), n_agents, len(experiment.modules), experiment.genome_length)
    stacked = np.zeros(shape, np.float32)
    first_agent = 0
    for genome in genomes:
        _, n_members, n_modules, n_weights = genome.shape
        end = first_agent + n_members
        stacked[:, first_agent:end, :n_modules, :n_weights] = genome
        first_agent = end
    return stacked


def draw_species(keys: RunKeys, species: SpeciesIndices, parents: Parents) -> SpeciesIndices:
    """Return the species of each child: that of one of its parents, with equal probability.

    `species` [run, agent], `parents` [run, child, 2]. Returns species [run, child].
    """
    draws = keys.uniforms(rng.SPECIES_OF_CHILD, (parents.shape[1], 1))[:, :, 0, 0]
    donors = np.where(draws < 0.5, parents[..., 0], parents[..., 1])
    return np.take_along_axis(species, donors, axis=1)
