"""Breeding: selection of parents and variation of their genomes make the next generation.

A single mutant is a copy of a genome with one mutation. The variation makes a child of an agent
with itself, so that recombination has no effect. The genes that differ in this child are mutations,
and the mutant has a random one of these.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache, partial
from typing import Any, NamedTuple

import numpy as np

from baldwinlab.engine import poison, rng
from baldwinlab.engine.jit import cached_jit, compiled
from baldwinlab.evolution.founders import draw_genomes
from baldwinlab.evolution.genes import are_finite, inherit_genes, make_gene_table, require_finite
from baldwinlab.evolution.inheritance import apply_teacher_control
from baldwinlab.evolution.rng_key import (
    Fitness,
    GenerationKey,
    Genome,
    Parents,
    RunKeys,
    split_runs,
)
from baldwinlab.evolution.selection import select
from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.parts.breeding import ITSELF, PartCall, RunArrays, list_part_calls
from baldwinlab.parts.lifetimes import Lifetimes, make_lifetimes
from baldwinlab.parts.variation import Brood, vary_children, vary_population


def make_generation(
    experiment: BaseExperiment,
    keys: RunKeys,
    genomes: Genome,
    fitness: Fitness,
    lifetimes: Lifetimes | None = None,
    run_arrays: Sequence[RunArrays] | None = None,
) -> tuple[Genome, Parents]:
    """Return the genomes and the parents of the next generation of several runs.

    `genomes` [run, agent, module, weight], `fitness` [run, agent]: the parents' generation. `keys`:
    keys of the children's generation. Returns the children's genomes and their parents
    [run, child, 2], which are -1 if the inheritance resamples genomes.
    """
    parent_settings = experiment.at(keys.generation - 1)
    # The error names the responsible parts. The search for them takes time, so a test precedes it.
    if not are_finite(genomes):
        fields = _fields_that_change_genomes(parent_settings)
        require_finite(experiment, keys.previous(), genomes, *fields)
    if parent_settings.part("evolution.inheritance").resamples_genomes:
        no_parents = np.full((*genomes.shape[:2], 2), -1, np.int32)
        return draw_genomes(experiment, keys), no_parents
    return breed(parent_settings, keys, genomes, fitness, lifetimes, run_arrays)


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
    keys: RunKeys,
    genomes: Genome,
    fitness: Fitness,
    lifetimes: Lifetimes | None = None,
    run_arrays: Sequence[RunArrays] | None = None,
) -> tuple[Genome, Parents]:
    """Select parents and make their children, in several runs.

    A survivor is the only parent of itself: both entries of `parents` are the survivor. The
    parameters, results and errors are those of `make_generation`.
    """
    if lifetimes is None:
        lifetimes = make_lifetimes(genomes)
    lifetimes = lifetimes._replace(genome=genomes)
    uniforms = keys.uniforms(rng.SELECTION, (fitness.shape[1], 2))
    parents = select(experiment, keys, fitness, uniforms, lifetimes, run_arrays)
    children = make_children(experiment, keys, genomes, fitness, parents, run_arrays)
    return apply_teacher_control(experiment, children, keys), parents


def make_children(
    experiment: BaseExperiment,
    keys: RunKeys,
    genomes: Genome,
    fitness: Fitness,
    parents: Parents,
    run_arrays: Sequence[RunArrays] | None = None,
) -> Genome:
    """Return the children of `parents` [run, child, 2] by the variation of an experiment.

    In `parents`, each `ITSELF` is replaced by the survivor. The function raises RefusedError if a
    gene is not finite.
    """
    children = poison.empty(genomes.shape, genomes.dtype)
    first_gene = make_gene_table(experiment).first
    genes = inherit_genes(experiment, keys, genomes, parents, children)
    broods = Broods(keys, genomes, fitness, parents, first_gene, genes, children)
    n_runs, n_children = children.shape[:2]
    for call in list_part_calls(experiment, "variation", n_runs, run_arrays):
        if type(call.values).part.has_independent_children():
            # Threads share the children of all runs.
            children_of_call = range(call.runs.start * n_children, call.runs.stop * n_children)
            split_runs(children_of_call, 1, partial(_breed_range, call, breed_independent, broods))
        else:
            split_runs(call.runs, n_children, partial(_breed_range, call, breed_runs, broods))
    require_finite(experiment, keys, children, "evolution.variation")
    return children


class Broods(NamedTuple):
    """The populations, parents and children of several runs."""

    keys: RunKeys  # Keys of the children's generation.
    genomes: Genome  # [run, agent, module, weight].
    fitness: Fitness  # [run, agent].
    parents: Parents  # [run, child, 2].
    first_gene: int  # Index of the first gene of the parts in the first module of a genome.
    genes: Genome  # [run, child, gene]: genes of parts of the children.
    children: Genome  # Output, [run, child, module, weight].


def _breed_range(
    call: PartCall, function: Callable[..., None], broods: Broods, first: int, end: int
) -> None:
    """Call a function that creates children with memory for their random numbers."""
    _, _, n_modules, n_weights = broods.children.shape
    # [gene, 4]. The numbers of successive genes are adjacent, so that LLVM vectorizes the loops.
    draws = poison.empty((4, n_modules * n_weights)).T
    cached_jit(function, call.code)(call.values, broods, draws, first, end)


def breed_independent(
    variation: Any, broods: Broods, draws: Fitness, first_child: int, end_child: int
) -> None:
    """Create a range of the children of all runs, which do not depend on each other.

    Child `c` of run `r` has the number r * n + c, with n children in each run.
    """
    n_children = broods.children.shape[1]
    first = first_child
    while first < end_child:
        run = first // n_children
        end = min(end_child, (run + 1) * n_children)
        first_of_run = first - run * n_children
        end_of_run = end - run * n_children
        brood = _begin_brood(broods, draws, run, first_of_run, end_of_run)
        vary_children(variation, brood, first_of_run, end_of_run)
        _complete_parents(brood.parents, first_of_run, end_of_run)
        _write_genes(broods, run, first_of_run, end_of_run)
        first = end


def breed_runs(
    variation: Any, broods: Broods, draws: Fitness, first_run: int, end_run: int
) -> None:
    """Create all children of a range of runs."""
    n_children = broods.children.shape[1]
    for run in range(first_run, end_run):
        breed_children(variation, _begin_brood(broods, draws, run, 0, n_children))
        _write_genes(broods, run, 0, n_children)


@compiled
def _begin_brood(
    broods: Broods, draws: Fitness, run: int, first_child: int, end_child: int
) -> Brood:
    """Return the brood of a run, with only the genes of parts in a range of its children."""
    children = broods.children[run]
    # NaN marks a gene that the variation does not write.
    children[first_child:end_child] = np.nan
    # The variation can read the genes of parts.
    _write_genes(broods, run, first_child, end_child)
    return Brood(
        key=GenerationKey(broods.keys.seed, broods.keys.runs[run], broods.keys.generation),
        genome=broods.genomes[run],
        fitness=broods.fitness[run],
        parents=broods.parents[run],
        draws=draws,
        children=children,
    )


@compiled
def _write_genes(broods: Broods, run: int, first_child: int, end_child: int) -> None:
    """Write the genes of parts of a range of children, which the variation cannot change."""
    for child in range(first_child, end_child):
        genes = broods.genes[run, child]
        for gene in range(genes.size):
            broods.children[run, child, 0, broods.first_gene + gene] = genes[gene]


@compiled
def breed_children(variation: Any, brood: Brood) -> None:
    """Create all children of a run, and replace each `ITSELF` in their parents."""
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
    equal_fitness = np.zeros((1, n_agents))
    keys = key.as_run_keys()
    children = make_children(experiment, keys, genome[None], equal_fitness, itself[None])
    children = children.reshape(n_agents, -1)
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
