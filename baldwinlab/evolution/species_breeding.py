"""Breeding of a population with several species, which compete within or across species.

The runs of a call have the same species at the same indices of agents.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from baldwinlab.engine import rng
from baldwinlab.evolution.breeding import make_children, make_generation
from baldwinlab.evolution.fitness import fitness as compute_fitness
from baldwinlab.evolution.genes import require_finite, trim_genomes
from baldwinlab.evolution.inheritance import apply_inheritance, apply_teacher_control
from baldwinlab.evolution.rng_key import Fitness, Genome, Parents, RunKeys
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
from baldwinlab.parts.lifetimes import Lifetimes, map_arrays
from baldwinlab.parts.variation import vary_population

SpeciesArrays = dict[int, RunArrays]
"""Arrays of the run by index of the species."""


def _select_run_arrays(
    arrays_of_runs: Sequence[SpeciesArrays] | None, index: int
) -> list[RunArrays] | None:
    """Return the arrays of a species by run, in which its parts keep their changes."""
    if arrays_of_runs is None:
        return None
    return [arrays_of_species.setdefault(index, {}) for arrays_of_species in arrays_of_runs]


class Offspring(NamedTuple):
    """The next generation of several runs with several species."""

    genome: Genome  # Genomes, [run, child, module, weight], species after species.
    parents: Parents  # Parents in the previous generation, [run, child, 2].
    species: SpeciesIndices  # Species of each child, [run, child], in ascending order.


class Member(NamedTuple):
    """A species of a generation: the index, the experiment, and the range of its agents."""

    number: int
    experiment: BaseExperiment
    agents: slice


def iterate_members(experiment: BaseExperiment, species: SpeciesIndices) -> Iterator[Member]:
    """Yield each species that has agents, for agents that are numbered species after species.

    `species` [agent].
    """
    for index, member in enumerate(experiment.species_experiments()):
        first_agent, end = np.searchsorted(species, [index, index + 1]).tolist()
        if end > first_agent:
            yield Member(index, member, slice(first_agent, end))


def _select_agents(lifetimes: Lifetimes, agents: slice) -> Lifetimes:
    """Return the lifetimes of some agents of all runs."""
    return map_arrays(lifetimes, lambda values: np.ascontiguousarray(values[:, agents]))


def compute_species_fitness(
    experiment: BaseExperiment,
    lifetimes: Lifetimes,
    arrays_of_runs: Sequence[SpeciesArrays] | None = None,
) -> Fitness:
    """Return the fitness of all agents [run, agent], each by the fitness part of its species.

    The parts change `arrays_of_runs`, the arrays of each run by species.
    """
    values = np.empty_like(lifetimes.energy)
    for index, member, agents in iterate_members(experiment, lifetimes.species[0]):
        member_lifetimes = _select_agents(lifetimes, agents)
        used_genomes = trim_genomes(member_lifetimes.genome, member)
        values[:, agents] = compute_fitness(
            member,
            member_lifetimes._replace(genome=used_genomes),
            _select_run_arrays(arrays_of_runs, index),
        )
    return values


def inherit_within_species(
    experiment: BaseExperiment,
    lifetimes: Lifetimes,
    learned: Genome | None,
    arrays_of_runs: Sequence[SpeciesArrays] | None = None,
) -> Genome:
    """Return the inherited genomes of all agents, computed by the inheritances of the species.

    `learned` [run, agent, weight] is the first module at death, or None if no species needs it. The
    parts change `arrays_of_runs`, the arrays of each run by species.
    """
    genomes = lifetimes.genome
    if learned is None:
        return genomes
    inherited = genomes.copy()
    for index, member, agents in iterate_members(experiment, lifetimes.species[0]):
        learned_weights = np.ascontiguousarray(learned[:, agents, : member.weight_count])
        used = trim_genomes(genomes[:, agents], member)
        _, _, n_modules, n_weights = used.shape
        run_arrays = _select_run_arrays(arrays_of_runs, index)
        changed = apply_inheritance(member, used, learned_weights, run_arrays)
        inherited[:, agents, :n_modules, :n_weights] = changed
    return inherited


def make_offspring(
    experiment: BaseExperiment,
    keys: RunKeys,
    genomes: Genome,
    fitness: Fitness,
    lifetimes: Lifetimes,
    arrays_of_runs: Sequence[SpeciesArrays] | None = None,
) -> Offspring:
    """Return the next generation of several runs with several species.

    `lifetimes`: results of the parents' generation. `lifetimes.species` is in ascending order.
    """
    settings = experiment.at(keys.generation - 1)
    species = lifetimes.species
    if settings.evolution.compete == ACROSS:
        return _breed_across(settings, keys, genomes, fitness, lifetimes, arrays_of_runs)
    genomes_of_species = []
    parents = np.full((*species.shape, 2), -1, np.int32)
    for index, member, agents in iterate_members(settings, species[0]):
        children, parents_in_species = make_generation(
            member,
            derive_key(keys, index),
            trim_genomes(genomes[:, agents], member),
            np.ascontiguousarray(fitness[:, agents]),
            _select_agents(lifetimes, agents),
            _select_run_arrays(arrays_of_runs, index),
        )
        genomes_of_species.append(children)
        # A negative number means that a child has no parent.
        has_parent = parents_in_species >= 0
        parents[:, agents] = parents_in_species + np.where(has_parent, agents.start, 0)
    return Offspring(stack_genomes(experiment, genomes_of_species), parents, species)


def _breed_across(
    experiment: BaseExperiment,
    keys: RunKeys,
    genomes: Genome,
    fitness: Fitness,
    lifetimes: Lifetimes,
    arrays_of_runs: Sequence[SpeciesArrays] | None,
) -> Offspring:
    """Select parents from all agents. A child has the species of one parent, at random.

    The variation and the teacher control of this species apply to the child.
    """
    members = experiment.species_experiments()
    require_finite(experiment, keys.previous(), genomes, "model", "evolution.inheritance")
    uniforms = keys.uniforms(rng.SELECTION, (genomes.shape[1], 2))
    # The selection is equal for all species.
    run_arrays = _select_run_arrays(arrays_of_runs, 0)
    lifetimes = lifetimes._replace(genome=genomes)
    parents = select(members[0], keys, fitness, uniforms, lifetimes, run_arrays)
    # The second parent of a survivor is the survivor, too.
    complete_parents = np.where(parents == ITSELF, parents[..., :1], parents)
    species_of_children = draw_species(keys, lifetimes.species, complete_parents)
    order = np.argsort(species_of_children, axis=1, kind="stable")
    offspring = Offspring(
        genome=np.empty_like(genomes),
        parents=np.take_along_axis(complete_parents, order[..., None], axis=1),
        species=np.take_along_axis(species_of_children, order, axis=1),
    )
    for run in range(len(genomes)):
        # The number of children of a species differs between the runs.
        selected = slice(run, run + 1)
        keys_of_run = keys._replace(runs=keys.runs[selected])
        for index, member, agents in iterate_members(experiment, offspring.species[run]):
            run_arrays = _select_run_arrays(arrays_of_runs and arrays_of_runs[selected], index)
            parents_in_species = parents[selected].copy()
            if type(member.part("evolution.variation")).vary_population is vary_population.default:
                # The children of other species are copied, because a copy is faster than variation.
                # Their numbers remain, because the random numbers of a child depend on its number.
                parents_in_species[species_of_children[selected] != index, 1] = ITSELF
            children = make_children(
                member,
                keys_of_run,
                genomes[selected],
                fitness[selected],
                parents_in_species,
                run_arrays,
            )
            varied = children[:, order[run, agents]]
            species_keys = derive_key(keys_of_run, index)
            offspring.genome[selected, agents] = apply_teacher_control(member, varied, species_keys)
    return offspring
