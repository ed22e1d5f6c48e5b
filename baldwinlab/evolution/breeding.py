"""Breeding: from a generation that has lived to the one that is next to live."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final

import numpy as np

from baldwinlab.engine import rng
from baldwinlab.engine.jit import entry
from baldwinlab.evolution.founders import draw_genome
from baldwinlab.evolution.inheritance import deal_teachers
from baldwinlab.evolution.moment import Fitness, Genome, Moment, Parents, Uniforms
from baldwinlab.evolution.selection import select
from baldwinlab.evolution.variation import Mutation, mutation, vary
from baldwinlab.experiment import Experiment


def next_genome(experiment: Experiment, moment: Moment, genome: Genome, fitness: Fitness) -> tuple[Genome, Parents]:
    """Genomes and parents of the generation at `moment`, from the one before it, which has lived."""
    return INHERITANCE[experiment.evolution.inheritance](experiment, genome, fitness, moment)


def breed(experiment: Experiment, genome: Genome, fitness: Fitness, moment: Moment) -> tuple[Genome, Parents]:
    """The children of a generation that has lived, and their parents. `moment` is the children's.

    Raises ValueError as `select` does.
    """
    agents, modules, weights = genome.shape
    parents = select(experiment.evolution.selection, fitness, moment.uniforms(rng.SELECTION, (agents, 2)))
    children = np.empty_like(genome)
    bear_children(mutation(experiment.evolution), moment, genome, parents, np.empty((modules * weights, 4)), children)
    return deal_teachers(experiment, children, moment), parents


def start_afresh(experiment: Experiment, genome: Genome, fitness: Fitness, moment: Moment) -> tuple[Genome, Parents]:
    """As many agents without parents, which are -1."""
    return draw_genome(experiment, moment), np.full((len(genome), 2), -1, np.int32)


@entry
def bear_children(
    settings: Mutation, moment: Moment, genome: Genome, parents: Parents, draws: Uniforms, children: Genome
) -> None:
    """Fill `children` from the genomes of their `parents`; `draws` [module and weight, 4] is scratch."""
    seed, run, generation = moment.seed, moment.run, moment.generation
    for child in range(children.shape[0]):
        rng.draw_uniforms(seed, run, generation, rng.INHERITANCE, child, draws)
        gate = rng.uniform(rng.philox(0, child, generation, rng.MUTATION_GATE, seed, run)[0])
        vary(settings, genome[parents[child, 0]], genome[parents[child, 1]], draws, gate, children[child])


INHERITANCE: Final[Mapping[str, Callable[[Experiment, Genome, Fitness, Moment], tuple[Genome, Parents]]]] = {
    "darwinian": breed,
    "none": start_afresh,
}
