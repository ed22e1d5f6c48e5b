"""The selection `species` and the variation `neat`, which together are NEAT.

Each can be combined with other parts. `neat` with another selection is NEAT without species. All
defaults are from section 4.1 of the paper, unless the description says "our choice". The paper
leaves some rules open. Our choices are as follows. If two parents have the same fitness, the
structure is that of a random parent. The number of members of a species that reproduce is the given
share plus one, as in the authors' program, from memory. A parent from another species is any agent
of the population. All children can mutate.

References
----------
Stanley and Miikkulainen 2002, section 4.1.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from baldwinlab.engine import rng
from baldwinlab.engine.jit import compiled
from baldwinlab.engine.simd import ZERO
from baldwinlab.evolution.neat.genome import (
    LAST_INNOVATION,
    SPECIES,
    init_minimal_graph,
    link_capacity,
)
from baldwinlab.evolution.neat.mutation import (
    FIRST_LINK_ROW,
    add_link,
    add_node,
    cross,
    mutate_weights,
)
from baldwinlab.evolution.neat.species import (
    assign_species,
    can_reproduce,
    next_species,
    species_status,
)
from baldwinlab.evolution.rng_key import Fitness, Genome, Parents, Uniforms
from baldwinlab.evolution.selection import Order, sort_by
from baldwinlab.parts import Brood, Field, Generation, Selection, Variation
from baldwinlab.parts.breeding import ITSELF, copy_genome


def genome_part(experiment: Any) -> Any:
    """Return the part that defines the format of genomes: a network or a model."""
    return (
        experiment.part("network.kind")
        if experiment.model == "miniworld"
        else experiment.model_part
    )


def require_graphs(experiment: Any, setting: str) -> None:
    """Raise ValueError if genomes are not graphs. `setting`: setting that needs graphs."""
    if not genome_part(experiment).has_graph_genomes:
        raise ValueError(
            f"{setting} needs genomes that are graphs: those of network.kind = 'neat', or of the "
            "models neat-xor, neat-poles and neat-poles-without-velocities"
        )


class SpeciesSelection(Selection, name="species"):
    """Children per species in proportion to the mean fitness of the species.

    The champion of a large species survives. A species that stagnates for long has no children.

    References
    ----------
    Stanley and Miikkulainen 2002.
    """

    minimum_fitness: ClassVar[float] = 0.0
    reads_only_genomes: ClassVar[bool] = True
    survival_threshold: float = Field(
        0.2,
        ge=0,
        le=1,
        description=(
            "Share of the best members of a species that reproduce, plus one (our choice)."
        ),
    )
    champion_species_size: int = Field(
        5,
        ge=0,
        le=1_000_000,
        description="Number of members above which the best member of a species survives.",
    )
    single_parent_share: float = Field(
        0.25, ge=0, le=1, description="Share of the children with a single parent, which mutate."
    )
    interspecies_mating_rate: float = Field(
        0.001,
        ge=0,
        le=1,
        description=("Probability that the second parent is drawn from the entire population."),
    )
    stagnation_generations: int = Field(
        15,
        ge=1,
        le=1_000_000,
        description=(
            "Number of generations without improvement after which a species has no children."
        ),
    )
    population_stagnation_generations: int = Field(
        20,
        ge=1,
        le=1_000_000,
        description=(
            "Number of generations without any improvement after which only the two "
            "best species reproduce."
        ),
    )

    def check(self, experiment: Any) -> None:
        require_graphs(experiment, "evolution.selection = 'species'")

    @staticmethod
    def select(part: Any, generation: Generation) -> None:
        fitness = generation.fitness
        parents = generation.parents
        genome = generation.lifetimes.genome
        for agent in range(fitness.size):
            generation.shares[agent] = -genome[agent, 0, SPECIES]
        # The order is by species, the oldest last, then by fitness, the fittest last.
        sort_by(generation.shares, fitness, generation.order)
        total, all_reproduce, has_equal_shares = _sum_species_means(part, genome, fitness)
        n_children = parents.shape[0]
        cumulative_share = 0.0
        first_child = 0
        # The members of the current species are order[end - size : end].
        end = fitness.size
        species = next_species(genome, 0)
        while species > ZERO:
            size, mean, _, _, _ = species_status(genome, fitness, species)
            if all_reproduce or can_reproduce(part, genome, fitness, species):
                cumulative_share += 1.0 if has_equal_shares else mean
                # The last cumulative sum is the total, so all children have parents.
                end_child = int(cumulative_share * n_children / total + 0.5)
                for child in range(first_child, end_child):
                    _choose_parents(
                        part, generation.uniforms, generation.order, end - size, end, child, parents
                    )
                if size > part.champion_species_size and end_child > first_child:
                    champion = generation.order[end - 1]
                    parents[first_child, 0] = champion
                    parents[first_child, 1] = ITSELF
                first_child = end_child
            species = next_species(genome, species)
            end = end - size


@compiled
def _sum_species_means(part: Any, genome: Genome, fitness: Fitness) -> Any:
    """Return (total, all_reproduce, has_equal_shares).

    `total` is the sum of the mean fitness of all reproducing species. If no species can reproduce,
    all species reproduce. If the sum is 0, all reproducing species have equal shares of the
    children, and `total` is the number of reproducing species.
    """
    n_reproducing = 0
    total = 0.0
    n_species = 0
    total_of_all = 0.0
    species = next_species(genome, 0)
    while species > ZERO:
        mean = species_status(genome, fitness, species)[1]
        n_species = n_species + 1
        total_of_all = total_of_all + mean
        if can_reproduce(part, genome, fitness, species):
            n_reproducing = n_reproducing + 1
            total = total + mean
        species = next_species(genome, species)
    if n_reproducing == 0:
        n_reproducing = n_species
        total = total_of_all
    all_reproduce = n_reproducing == n_species
    has_equal_shares = total == 0.0
    total_share = total if total > 0.0 else float(n_reproducing)
    return total_share, all_reproduce, has_equal_shares


@compiled
def _choose_parents(
    part: Any, uniforms: Uniforms, order: Order, begin: int, end: int, child: int, parents: Parents
) -> None:
    """Choose the parents of a child from the best members of a species.

    The members are `order[begin:end]`, the fittest last. The second parent can be any agent of the
    population, or the first parent itself.
    """
    draws = uniforms[child]
    size = end - begin
    n_best = min(size, int(np.float64(part.survival_threshold) * size) + 1)
    fittest = end - 1
    first = order[fittest - int(draws[0, 0] * n_best)]
    second = order[fittest - int(draws[0, 3] * n_best)]
    if draws[0, 2] < part.interspecies_mating_rate:
        second = order[int(draws[0, 3] * order.size)]
    if draws[0, 1] < part.single_parent_share:
        second = first
    parents[child, 0] = first
    parents[child, 1] = second


class Neat(Variation, name="neat"):
    """NEAT: crossover by historical marks, mutation of weights, added links and nodes, species.

    References
    ----------
    Stanley and Miikkulainen 2002.
    """

    derived: ClassVar[Mapping[str, Any]] = {
        # Whether fitness has no effect: under neutral selection, no parent is the fitter one.
        "blind": lambda part, experiment: experiment.evolution.selection == "neutral",
        # Whether new links may close loops.
        "loops": lambda part, experiment: bool(
            getattr(genome_part(experiment), "has_loops", False)
        ),
        # Number of inputs of an agent of MiniWorld, bias included.
        "inputs": lambda part, experiment: len(getattr(experiment, "inputs", ())) + 1,
        "outputs": lambda part, experiment: len(getattr(experiment, "actions", ())),
    }
    weight_mutation_rate: float = Field(
        0.8, ge=0, le=1, description="Share of the children whose weights mutate."
    )
    perturbation_share: float = Field(
        0.9,
        ge=0,
        le=1,
        description=(
            "Probability that a mutated weight is perturbed; otherwise it is drawn again."
        ),
    )
    perturbation_size: float = Field(
        1.0,
        ge=0,
        le=1000,
        description="Limit P of a perturbation, which adds U(-P, P) (our choice).",
    )
    weight_range: float = Field(
        5.0, ge=0, le=1000, description="Limit R of a new weight, drawn from U(-R, R) (our choice)."
    )
    add_node_rate: float = Field(
        0.03, ge=0, le=1, description="Probability of a new node, which splits a link."
    )
    add_link_rate: float = Field(0.05, ge=0, le=1, description="Probability of a new link.")
    disabled_link_rate: float = Field(
        0.75,
        ge=0,
        le=1,
        description=(
            "Probability that a link that is disabled in a parent is disabled in the child."
        ),
    )
    excess_coefficient: float = Field(
        1.0, ge=0, le=1000, description="Distance coefficient c1, of excess genes."
    )
    disjoint_coefficient: float = Field(
        1.0, ge=0, le=1000, description="Distance coefficient c2, of disjoint genes."
    )
    weight_coefficient: float = Field(
        0.4,
        ge=0,
        le=1000,
        description="Distance coefficient c3, of the mean difference of weights.",
    )
    compatibility_threshold: float = Field(
        3.0,
        gt=0,
        le=1000,
        description="Distance below which two networks belong to the same species.",
    )

    def check(self, experiment: Any) -> None:
        require_graphs(experiment, "evolution.variation = 'neat'")

    @staticmethod
    def init_founders(part: Any, genome: Genome) -> None:
        for agent in range(genome.shape[0]):
            init_minimal_graph(genome[agent, 0], part.inputs, part.outputs)

    @staticmethod
    def vary_population(part: Any, brood: Brood) -> None:
        genome = brood.genome
        children = brood.children
        key = brood.key
        fitness = brood.fitness
        first = int(genome[0, 0, LAST_INNOVATION]) + 1
        last = first - 1
        links = link_capacity(genome[0, 0])
        # Rows of `draws` after those of the links are scratch memory for `marks`.
        child_draws = brood.draws[: FIRST_LINK_ROW + links]
        marks = brood.draws[FIRST_LINK_ROW + links :, 0]
        for child in range(children.shape[0]):
            first_parent = brood.parents[child, 0]
            second_parent = brood.parents[child, 1]
            copy_genome(genome[first_parent], children[child])
            if second_parent == ITSELF:
                continue
            rng.draw_uniforms(
                key.seed, key.run, key.generation, rng.INHERITANCE, child, child_draws
            )
            if first_parent != second_parent:
                # If neither parent is the fitter one, a random parent gives the structure.
                is_fitter_unknown = part.blind or fitness[first_parent] == fitness[second_parent]
                if is_fitter_unknown and child_draws[1, 2] < 0.5:
                    first_parent, second_parent = second_parent, first_parent
                    copy_genome(genome[first_parent], children[child])
                cross(part, genome[second_parent, 0], child_draws, children[child, 0])
            mutate_weights(part, child_draws, children[child, 0])
            last = add_node(part, child_draws, children, child, first, last)
            last = add_link(part, child_draws, children, child, first, last, marks)
        for child in range(children.shape[0]):
            children[child, 0, LAST_INNOVATION] = last
        assign_species(part, key, genome, fitness, children)
