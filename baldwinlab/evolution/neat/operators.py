"""The variation `neat` and the selection `species`, which together are NEAT, of genomes that are graphs.

Each goes with other parts, too: `neat` with any selection, which is NEAT without species.

Source: Stanley and Miikkulainen 2002, section 4.1, for all numbers but those that are called ours. Open there, and read so: of
parents that are equally fit a coin says whose structure is inherited; of a species the given share breeds and one more, as, to
our memory, in the authors' program; a partner from another species is anybody of the population; all children may mutate.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from baldwinlab.engine import rng
from baldwinlab.engine.jit import compiled
from baldwinlab.evolution.neat import oracle
from baldwinlab.evolution.neat.genome import LEDGER, SPECIES, ZERO, begin, room
from baldwinlab.evolution.neat.mutation import OF_LINKS, add_link, add_node, cross, mutate_weights
from baldwinlab.evolution.neat.species import may_breed, next_species, settle, standing
from baldwinlab.evolution.rng_key import Fitness, GenerationKey, Genome, Parents, Uniforms
from baldwinlab.evolution.sorting import Keys, Order, sort_by
from baldwinlab.parts import Field, Selection, Variation
from baldwinlab.parts.evolution_parts import ITSELF, copy_genome


def _holder(experiment: Any) -> Any:
    """The part that says what genomes are."""
    return (
        experiment.part("network.kind") if experiment.model == "miniworld" else experiment.of_model
    )


def require_graphs(experiment: Any, what: str) -> None:
    """Raises ValueError where genomes are no graphs."""
    if not getattr(_holder(experiment), "graphs", False):
        raise ValueError(
            f"{what} needs genomes that are graphs: those of network.kind = 'neat', or of the models neat-xor, "
            "neat-poles and neat-poles-without-velocities"
        )


class Species(Selection, name="species"):
    """Children per species in proportion to its mean fitness.

    The champion of a large species survives.
    A species without improvement for a long time has no children.

    References
    ----------
    Stanley and Miikkulainen 2002.
    """

    least: ClassVar[float] = 0.0
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
    def select_with_genomes(
        part: Any,
        genome: Genome,
        fitness: Fitness,
        uniforms: Uniforms,
        shares: Keys,
        order: Order,
        parents: Parents,
    ) -> None:
        for agent in range(fitness.size):
            shares[agent] = -genome[agent, 0, SPECIES]
        sort_by(
            shares, fitness, order
        )  # species by species, the oldest last, and of each the fittest last
        total, all_breed, alike = _total(part, genome, fitness)
        children, given, first, end = parents.shape[0], 0.0, 0, fitness.size
        species = next_species(genome, 0)
        while species > ZERO:
            size, mean, _, _, _ = standing(genome, fitness, species)
            if all_breed or may_breed(part, genome, fitness, species):
                given += 1.0 if alike else mean
                until = int(given * children / total + 0.5)
                for child in range(first, until):
                    _mate(part, uniforms, order, end - size, end, child, parents)
                if size > part.champion_species_size and until > first:
                    parents[first, 0], parents[first, 1] = order[end - 1], ITSELF
                first = until
            species, end = next_species(genome, species), end - size

    @staticmethod
    def oracle(part: Any, genome: Any, fitness: Any, uniforms: Any) -> Any:
        return oracle.parents(part, genome, fitness, uniforms)


@compiled
def _total(part: Any, genome: Genome, fitness: Fitness) -> Any:
    """The mean fitness of the species that breed, added up; whether all breed; whether they are alike, as nobody has any."""
    breeding, total = 0, 0.0
    everyone, total_of_all = 0, 0.0
    species = next_species(genome, 0)
    while species > ZERO:
        mean = standing(genome, fitness, species)[1]
        everyone, total_of_all = everyone + 1, total_of_all + mean
        if may_breed(part, genome, fitness, species):
            breeding, total = breeding + 1, total + mean
        species = next_species(genome, species)
    if breeding == 0:
        breeding, total = everyone, total_of_all
    all_breed = breeding == everyone
    return (total if total > 0.0 else float(breeding)), all_breed, total == 0.0


@compiled
def _mate(
    part: Any, uniforms: Uniforms, order: Order, begin: int, end: int, child: int, parents: Parents
) -> None:
    """Two of those that survive of a species, which stand last from `begin` to `end`; or one; or one and anybody."""
    draws = uniforms[child]
    survivors = min(end - begin, int(np.float64(part.survival_threshold) * (end - begin)) + 1)
    one, other = (
        order[end - 1 - int(draws[0, 0] * survivors)],
        order[end - 1 - int(draws[0, 3] * survivors)],
    )
    if draws[0, 2] < part.interspecies_mating_rate:
        other = order[int(draws[0, 3] * order.size)]
    if draws[0, 1] < part.single_parent_share:
        other = one
    parents[child, 0], parents[child, 1] = one, other


class Neat(Variation, name="neat"):
    """NEAT: crossover by historical marks, mutation of weights, added links and nodes, species.

    References
    ----------
    Stanley and Miikkulainen 2002.
    """

    settings: ClassVar[tuple[str, ...]] = ()
    derived: ClassVar[Mapping[str, Any]] = {
        "blind": lambda part, experiment: (
            experiment.evolution.selection == "neutral"
        ),  # then nobody counts as the fitter one
        "loops": lambda part, experiment: bool(
            getattr(_holder(experiment), "loops", False)
        ),  # whether new links may close any
        "inputs": lambda part, experiment: (
            len(getattr(experiment, "inputs", ())) + 1
        ),  # with the bias, of foragers
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
        1.0,
        ge=0,
        le=1000,
        description="Distance coefficient c1, of excess genes.",
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
            begin(genome[agent, 0], part.inputs, part.outputs)

    @staticmethod
    def vary_population(
        part: Any,
        key: GenerationKey,
        genome: Genome,
        fitness: Fitness,
        parents: Parents,
        draws: Uniforms,
        children: Genome,
    ) -> None:
        first = int(genome[0, 0, LEDGER]) + 1
        last, links = first - 1, room(genome[0, 0])
        used, marks = draws[: OF_LINKS + links], draws[OF_LINKS + links :, 0]
        for child in range(children.shape[0]):
            one, other = parents[child, 0], parents[child, 1]
            copy_genome(genome[one], children[child])
            if other == ITSELF:
                continue
            rng.draw_uniforms(key.seed, key.run, key.generation, rng.INHERITANCE, child, used)
            if one != other:
                if (part.blind or fitness[one] == fitness[other]) and used[1, 2] < 0.5:
                    one, other = other, one
                    copy_genome(genome[one], children[child])
                cross(part, genome[other, 0], used, children[child, 0])
            mutate_weights(part, used, children[child, 0])
            last = add_node(part, used, children, child, first, last)
            last = add_link(part, used, children, child, first, last, marks)
        for child in range(children.shape[0]):
            children[child, 0, LEDGER] = last
        settle(part, key, genome, fitness, children)

    @staticmethod
    def oracle(part: Any, genome: Any, fitness: Any, parents: Any, draws: Any) -> Any:
        return oracle.children(part, genome, fitness, parents, draws)
