"""Breeding of a population with several species, which compete within or across species."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from baldwinlab.engine import rng
from baldwinlab.evolution.breeding import make_children, make_generation
from baldwinlab.evolution.fitness import fitness as compute_fitness
from baldwinlab.evolution.genes import require_finite, trim_genomes
from baldwinlab.evolution.inheritance import apply_inheritance, apply_teacher_control
from baldwinlab.evolution.rng_key import Fitness, GenerationKey, Genome, Parents
from baldwinlab.evolution.selection import select
from baldwinlab.evolution.species import (
    SpeciesIndices,
    derive_key,
    draw_species,
    stack_genomes,
)
from baldwinlab.experiment import BaseExperiment
from baldwinlab.experiment.species import ACROSS
from baldwinlab.parts.breeding import ITSELF, RunArrays
from baldwinlab.parts.lifetimes import Lifetimes, select_lifetimes
from baldwinlab.parts.variation import vary_population

SpeciesArrays = dict[int, RunArrays]
"""Arrays of the run by index of the species."""


def _select_run_arrays(arrays_of_species: SpeciesArrays | None, index: int) -> RunArrays | None:
    """Return the dict of arrays of the run of a species, which the parts of the species change."""
    return None if arrays_of_species is None else arrays_of_species.setdefault(index, {})


class Offspring(NamedTuple):
    """The next generation of a population with several species."""

    genome: Genome  # Genomes, [child, module, weight], species after species.
    parents: Parents  # Parents in the previous generation, [child, 2].
    species: SpeciesIndices  # Species of each child, in ascending order.


class Member(NamedTuple):
    """A species of a generation: the index, the experiment, and the range of its agents."""

    number: int
    experiment: BaseExperiment
    agents: slice


def iterate_members(experiment: BaseExperiment, species: SpeciesIndices) -> Iterator[Member]:
    """Yield each species that has agents. `species` [agent] must be in ascending order."""
    for index, member in enumerate(experiment.species_experiments()):
        first_agent, end = np.searchsorted(species, [index, index + 1]).tolist()
        if end > first_agent:
            yield Member(index, member, slice(first_agent, end))


def compute_species_fitness(
    experiment: BaseExperiment, lifetimes: Lifetimes, arrays_of_species: SpeciesArrays | None = None
) -> Fitness:
    """Return the fitness of all agents, computed by the fitness parts of the species.

    The parts change `arrays_of_species`, the arrays of the run by species.
    """
    agent_fitness = np.empty(len(lifetimes.energy))
    for index, member, agents in iterate_members(experiment, lifetimes.species):
        member_lifetimes = select_lifetimes(lifetimes, agents)
        used_genomes = trim_genomes(member_lifetimes.genome, member)
        agent_fitness[agents] = compute_fitness(
            member,
            member_lifetimes._replace(genome=used_genomes),
            _select_run_arrays(arrays_of_species, index),
        )
    return agent_fitness


def inherit_within_species(
    experiment: BaseExperiment,
    lifetimes: Lifetimes,
    learned: Genome | None,
    arrays_of_species: SpeciesArrays | None = None,
) -> Genome:
    """Return the inherited genomes of all agents, computed by the inheritances of the species.

    `learned` [agent, weight] is the first module at death, or None if no species needs it. The
    parts change `arrays_of_species`, the arrays of the run by species.
    """
    genome = lifetimes.genome
    if learned is None:
        return genome
    inherited = genome.copy()
    for index, member, agents in iterate_members(experiment, lifetimes.species):
        learned_weights = np.ascontiguousarray(learned[agents, : member.weight_count])
        used = trim_genomes(genome[agents], member)
        _, n_modules, n_weights = used.shape
        run_arrays = _select_run_arrays(arrays_of_species, index)
        changed = apply_inheritance(member, used, learned_weights, run_arrays)
        inherited[agents, :n_modules, :n_weights] = changed
    return inherited


def make_offspring(
    experiment: BaseExperiment,
    key: GenerationKey,
    genome: Genome,
    fitness: Fitness,
    lifetimes: Lifetimes,
    arrays_of_species: SpeciesArrays | None = None,
) -> Offspring:
    """Return the next generation of a population with several species.

    `lifetimes`: results of the parents' generation. `lifetimes.species` is in ascending order.
    """
    settings = experiment.at(key.generation - 1)
    species = lifetimes.species
    if settings.evolution.compete == ACROSS:
        return _breed_across(settings, key, genome, fitness, lifetimes, arrays_of_species)
    genomes = []
    parents = np.full((len(species), 2), -1, np.int32)
    for index, member, agents in iterate_members(settings, species):
        children, parents_in_species = make_generation(
            member,
            derive_key(key, index),
            trim_genomes(genome[agents], member),
            fitness[agents],
            select_lifetimes(lifetimes, agents),
            _select_run_arrays(arrays_of_species, index),
        )
        genomes.append(children)
        # Indices within the species become indices in the population. -1 is no parent, and stays.
        has_parent = parents_in_species >= 0
        parents[agents] = parents_in_species + np.where(has_parent, agents.start, 0)
    return Offspring(stack_genomes(experiment, genomes), parents, species)


def _breed_across(
    experiment: BaseExperiment,
    key: GenerationKey,
    genome: Genome,
    fitness: Fitness,
    lifetimes: Lifetimes,
    arrays_of_species: SpeciesArrays | None,
) -> Offspring:
    """Select parents from all agents. A child has the species of one parent, at random.

    The variation and the teacher control of this species apply to the child.
    """
    members = experiment.species_experiments()
    require_finite(experiment, key.previous(), genome, "model", "evolution.inheritance")
    uniforms = key.uniforms(rng.SELECTION, (len(genome), 2))
    # All species have the same selection, so the part and the arrays of species 0 are used.
    run_arrays = _select_run_arrays(arrays_of_species, 0)
    parents = select(
        members[0], fitness, uniforms, lifetimes._replace(genome=genome), key, run_arrays
    )
    # The second parent of a survivor is the survivor, too.
    complete_parents = np.where(parents == ITSELF, parents[:, :1], parents)
    species_of_children = draw_species(key, lifetimes.species, complete_parents)
    # A stable sort keeps the order of the children within a species.
    order = np.argsort(species_of_children, kind="stable")
    sorted_species = species_of_children[order]
    children = np.empty_like(genome)
    for index, member, agents in iterate_members(experiment, sorted_species):
        run_arrays = _select_run_arrays(arrays_of_species, index)
        parents_in_species = parents.copy()
        if type(member.part("evolution.variation")).vary_population is vary_population.default:
            # The children of other species are copied, because a copy is faster than variation.
            # No child is removed, because the random numbers of a child depend on its index.
            parents_in_species[species_of_children != index, 1] = ITSELF
        all_children = make_children(member, key, genome, fitness, parents_in_species, run_arrays)
        varied = all_children[order[agents]]
        children[agents] = apply_teacher_control(member, varied, derive_key(key, index))
    return Offspring(children, complete_parents[order], sorted_species)
