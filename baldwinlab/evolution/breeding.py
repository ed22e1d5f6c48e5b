"""Breeding: selection of parents and variation of their genomes make the next generation.

A single mutant is a copy of a genome with one mutation. The variation makes a child of an agent
with itself, so that recombination has no effect. The genes that differ in this child are mutations,
and the mutant has a random one of these.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any, Final

import numpy as np

from baldwinlab.engine import poison, rng
from baldwinlab.engine.jit import cached_jit, compiled
from baldwinlab.engine.threads import run_in_ranges
from baldwinlab.evolution.founders import draw_genomes
from baldwinlab.evolution.genes import inherit_genes, make_gene_table, require_finite
from baldwinlab.evolution.inheritance import apply_teacher_control
from baldwinlab.evolution.rng_key import Fitness, GenerationKey, Genome, Parents
from baldwinlab.evolution.selection import select
from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.parts.breeding import ITSELF, RunArrays, breeding_part
from baldwinlab.parts.lifetimes import Lifetimes, make_lifetimes
from baldwinlab.parts.variation import Brood, vary_children, vary_population

# Minimum number of children that a thread makes, which takes some milliseconds.
MIN_CHILDREN_PER_THREAD: Final = 1_000


def make_generation(
    experiment: BaseExperiment,
    key: GenerationKey,
    genome: Genome,
    fitness: Fitness,
    lifetimes: Lifetimes | None = None,
    run_arrays: RunArrays | None = None,
) -> tuple[Genome, Parents]:
    """Return the genomes and the parents of the next generation.

    Returns (genomes [child, module, weight], parents [child, 2]). The parents are -1 if the
    inheritance resamples genomes.
    """
    # Settings can change between generations. The settings of the parents' generation apply.
    parent_settings = experiment.at(key.generation - 1)
    # `require_finite` needs the responsible parts. A fast test avoids the search for these parts.
    if not np.isfinite(genome).all():
        fields = _fields_that_change_genomes(parent_settings)
        require_finite(experiment, key.previous(), genome, *fields)
    if parent_settings.part("evolution.inheritance").resamples_genomes:
        no_parents = np.full((len(genome), 2), -1, np.int32)
        return draw_genomes(experiment, key), no_parents
    return breed(parent_settings, genome, fitness, key, lifetimes, run_arrays)


def _fields_that_change_genomes(experiment: BaseExperiment) -> list[str]:
    """Return the fields that choose the parts which change genomes during a lifetime."""
    if not isinstance(experiment, Experiment):
        return ["model", "evolution.inheritance"]
    fields = []
    if experiment.births_in_life:
        fields += ["world.features", "evolution.variation"]
    if experiment.part("evolution.inheritance").wants_learned(experiment):
        fields += ["learning.rule", "evolution.inheritance"]
    return fields


def breed(
    experiment: BaseExperiment,
    genome: Genome,
    fitness: Fitness,
    key: GenerationKey,
    lifetimes: Lifetimes | None = None,
    run_arrays: RunArrays | None = None,
) -> tuple[Genome, Parents]:
    """Select parents and make their children.

    A survivor is the only parent of itself: both entries of `parents` are the survivor. `key` is
    the key of the children's generation. Returns (genomes, parents) as `make_generation`.
    """
    uniforms = key.uniforms(rng.SELECTION, (len(genome), 2))
    if lifetimes is None:
        lifetimes = make_lifetimes(genome)
    lifetimes = lifetimes._replace(genome=genome)
    parents = select(experiment, fitness, uniforms, lifetimes, key, run_arrays)
    children = make_children(experiment, key, genome, fitness, parents, run_arrays)
    return apply_teacher_control(experiment, children, key), parents


def make_children(
    experiment: BaseExperiment,
    key: GenerationKey,
    genome: Genome,
    fitness: Fitness,
    parents: Parents,
    run_arrays: RunArrays | None = None,
) -> Genome:
    """Return the children of `parents` by the variation of an experiment.

    In `parents`, each `ITSELF` is replaced by the survivor. The function raises RefusedError if a
    gene is not finite.
    """
    _, n_modules, n_weights = genome.shape
    # NaN marks a gene that the variation does not write.
    children = np.full_like(genome, np.nan)
    variation, code = breeding_part(experiment, "variation", run_arrays)
    # The variation can read the genes of parts. After it, they are written again.
    genes = inherit_genes(experiment, key, genome, parents, children)
    are_independent = type(variation).part.has_independent_children()

    def breed_range(first: int, end: int) -> None:
        draws = poison.empty((n_modules * n_weights, 4))
        brood = Brood(key, genome, fitness, parents, draws, children)
        if are_independent:
            cached_jit(breed_independent_children, code)(variation, brood, first, end)
        else:
            cached_jit(breed_children, code)(variation, brood)

    # One thread makes children that depend on other children.
    minimum_size = MIN_CHILDREN_PER_THREAD if are_independent else len(children)
    run_in_ranges(breed_range, len(children), minimum_size)
    children[:, 0, make_gene_table(experiment).genes] = genes
    require_finite(experiment, key, children, "evolution.variation")
    return children


def breed_independent_children(
    variation: Any, brood: Brood, first_child: int, end_child: int
) -> None:
    """Create the children of a range, and replace each `ITSELF` in `brood.parents`."""
    vary_children(variation, brood, first_child, end_child)
    _complete_parents(brood.parents, first_child, end_child)


def breed_children(variation: Any, brood: Brood) -> None:
    """Create all children, and replace each `ITSELF` in `brood.parents`."""
    vary_population(variation, brood)
    _complete_parents(brood.parents, 0, brood.parents.shape[0])


@compiled
def _complete_parents(parents: Parents, first_child: int, end_child: int) -> None:
    """Replace each `ITSELF` by the survivor."""
    for child in range(first_child, end_child):
        if parents[child, 1] == ITSELF:
            parents[child, 1] = parents[child, 0]


def make_single_mutants(experiment: BaseExperiment, key: GenerationKey, genome: Genome) -> Genome:
    """Return a single mutant of each agent.

    - `experiment`: the experiment with the variation. If the variation has a mutation rate, the
      rate is set to 1, so that each gene mutates with equal probability.
    - `key`: key of the random numbers. No generation of the run may have it.
    - `genome`: [agent, module, weight] with the same genes at the same entries.

    Returns the mutants. If the variation changes no gene of an agent, the mutant equals the agent.
    """
    n_agents = len(genome)
    experiment = _mutate_all_genes(experiment)
    # Both parents of a child are the agent: [agent, 2].
    itself = np.repeat(np.arange(n_agents, dtype=np.int32)[:, None], 2, axis=1)
    equal_fitness = np.zeros(n_agents)
    children = make_children(experiment, key, genome, equal_fitness, itself).reshape(n_agents, -1)
    mutants = genome.reshape(n_agents, -1).copy()
    draws = key.uniforms(rng.SELECTION, (n_agents, 1))[:, 0, 0]
    for mutant, child, draw in zip(mutants, children, draws, strict=True):
        changed_genes = np.flatnonzero(child != mutant)
        if changed_genes.size:
            gene = changed_genes[int(draw * changed_genes.size)]
            mutant[gene] = child[gene]
    return mutants.reshape(genome.shape)


@lru_cache(maxsize=64)
def _mutate_all_genes(experiment: BaseExperiment) -> BaseExperiment:
    """Return the experiment with the mutation rate 1, if its variation has a rate."""
    if "mutation_rate" not in experiment.part("evolution.variation").reads:
        return experiment
    return experiment.replace(evolution={"mutation_rate": 1.0})
