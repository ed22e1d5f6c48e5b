"""Breeding as it is done elsewhere: selection without its noise and by copies, variation by a bell curve, one cut, or none.

No variation here favours the fitter one of two parents: what a child has of each is left to a coin, so that parents at random
(`neutral`) stay a neutral twin.

Sources: J. E. Baker, "Reducing bias and inefficiency in the selection algorithm", Proceedings of the 2nd International
Conference on Genetic Algorithms (1987), for `expected-offspring`; S. Nolfi, J. L. Elman and D. Parisi, "Learning and evolution
in neural networks", Adaptive Behavior 3 (1994), for `best-copies`: there the best 20 of 100 have five children each, which
differ from them by mutation alone (`copy`); D. Floreano and J. Urzelai, "Evolutionary robots with on-line self-organization and
behavioral fitness", Neural Networks 13 (2000), for its `mated`; H.-P. Schwefel, Numerical Optimization of Computer Models
(1981), for normal mutations; D. E. Goldberg and K. Deb, "A comparative analysis of selection schemes used in genetic
algorithms", Foundations of Genetic Algorithms 1 (1991), for `larger-tournament`; J. H. Holland, Adaptation in Natural and
Artificial Systems (1975), for crossover at one point; H. Mühlenbein and H.-M. Voigt, "Gene pool recombination in genetic
algorithms", Meta-Heuristics: Theory and Applications (1996), for `gene-pool`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import accumulate
from statistics import NormalDist
from typing import Any, ClassVar

import numpy as np

from baldwinlab.engine import rng
from baldwinlab.engine.arithmetic import normal_quantile
from baldwinlab.engine.jit import compiled
from baldwinlab.evolution.rng_key import Fitness, Genome, Moment, Parents, Uniforms
from baldwinlab.evolution.selection import first_above
from baldwinlab.evolution.sorting import Keys, Order, sort_by
from baldwinlab.evolution.variation import Crossover, Draws, OneGenome
from baldwinlab.parts import Field, Selection, Variation
from baldwinlab.parts.evolution_parts import ITSELF, copy_genome


@compiled
def cut_at(draw: float, places: int) -> int:
    """The first place behind the cut of crossover at one point, uniform over the gaps between places; `draw` is in (0, 1)."""
    return 1 + int(draw * (places - 1))


@compiled
def is_of_fitter(place: int, cut: int, coin: float) -> bool:
    """Whether crossover at one point takes a place from the fitter parent; a coin in (0, 1) says whose places come first."""
    return (place < cut) == (coin < 0.5)


def flatten(genome: Sequence[Sequence[Any]]) -> list[Any]:
    """Return the genes of all modules of a genome in a row, for oracles."""
    return [gene for module in genome for gene in module]


def split_modules(genes: Sequence[Any], length: int) -> list[Sequence[Any]]:
    """Split a row of genes into modules of `length`, for oracles."""
    return [genes[first : first + length] for first in range(0, len(genes), length)]


def joined(fitter: Sequence[Any], other: Sequence[Any], draw: float, coin: float) -> list[Any]:
    """For oracles: the same, of whole parents."""
    first, second = (fitter, other) if coin < 0.5 else (other, fitter)
    cut = 1 + int(draw * (len(fitter) - 1))
    return [*first[:cut], *second[cut:]]


class ExpectedOffspring(Selection, name="expected-offspring"):
    """Roulette with low variance: an agent is a parent as often as expected, rounded up or down.

    References
    ----------
    Baker 1987 (stochastic universal sampling).
    """

    least: ClassVar[float] = 0.0

    @staticmethod
    def select(
        part: Any,
        fitness: Fitness,
        uniforms: Uniforms,
        shares: Keys,
        order: Order,
        parents: Parents,
    ) -> None:
        """One spin of a wheel with as many pointers, evenly spaced, as there are places for parents; then these are shuffled."""
        total, last = _slices(fitness, shares)
        places, agent = 2 * parents.shape[0], 0
        for place in range(places):
            pointer = (place + uniforms[0, 1, 0]) * total / places
            while agent < last and shares[agent] <= pointer:
                agent += 1
            parents[place // 2, place % 2] = agent
        for place in range(places - 1, 0, -1):
            other = int(uniforms[place // 2, 0, place % 2] * (place + 1))
            moved = parents[other // 2, other % 2]
            parents[other // 2, other % 2] = parents[place // 2, place % 2]
            parents[place // 2, place % 2] = moved

    @staticmethod
    def oracle(part: Any, fitness: Any, uniforms: Any) -> Any:
        slices = list(accumulate(fitness if any(fitness) else [1.0 for _ in fitness]))
        places = 2 * len(uniforms)
        pointers = [(place + uniforms[0][1][0]) * slices[-1] / places for place in range(places)]
        drawn = [
            next(agent for agent, end in enumerate(slices) if pointer < end) for pointer in pointers
        ]
        for place in range(places - 1, 0, -1):
            other = int(uniforms[place // 2][0][place % 2] * (place + 1))
            drawn[place], drawn[other] = drawn[other], drawn[place]
        return [drawn[place : place + 2] for place in range(0, places, 2)]


class BestCopies(Selection, name="best-copies"):
    """The best agents, with the same number of children each and one parent per child.

    If the number is not even, the fittest agents have one child more.
    The share `mated` of the children has a second parent among the best.

    References
    ----------
    Nolfi, Elman and Parisi 1994; Floreano and Urzelai 2000.
    """

    share: float = Field(
        0.2,
        gt=0,
        le=1,
        description="share of the agents that have children, the fittest; at least one agent",
    )
    mated: float = Field(
        0.0,
        ge=0,
        le=1,
        description="share of the children that have a second parent, any of the fittest",
    )

    @staticmethod
    def select(
        part: Any,
        fitness: Fitness,
        uniforms: Uniforms,
        shares: Keys,
        order: Order,
        parents: Parents,
    ) -> None:
        best = max(1, int(part.share * fitness.size + 0.5))
        for agent in range(fitness.size):
            shares[agent] = -fitness[agent]
        sort_by(shares, uniforms[:, 1, 0], order)  # equals in random order
        for child in range(parents.shape[0]):
            parents[child, 0] = parents[child, 1] = order[child % best]
            if uniforms[child, 0, 0] < part.mated:
                parents[child, 1] = order[int(uniforms[child, 0, 1] * best)]

    @staticmethod
    def oracle(part: Any, fitness: Any, uniforms: Any) -> Any:
        order = sorted(
            range(len(fitness)), key=lambda agent: (-fitness[agent], uniforms[agent][1][0])
        )
        best = order[: max(1, int(part.share * len(fitness) + 0.5))]
        pairs = [[best[child % len(best)]] * 2 for child in range(len(uniforms))]
        for pair, (draws, _) in zip(pairs, uniforms, strict=True):
            if draws[0] < part.mated:
                pair[1] = best[int(draws[1] * len(best))]
        return pairs


class Outcrossing(Selection, name="outcrossing"):
    """Roulette in which the second parent is another agent than the first.

    References
    ----------
    Hinton and Nowlan 1987.
    """

    least: ClassVar[float] = 0.0

    @staticmethod
    def select(
        part: Any,
        fitness: Fitness,
        uniforms: Uniforms,
        shares: Keys,
        order: Order,
        parents: Parents,
    ) -> None:
        total, _ = _slices(fitness, shares)
        for child in range(parents.shape[0]):
            first = first_above(shares, uniforms[child, 0, 0] * total)
            before = shares[first - 1] if first > 0 else 0.0
            others = before + (total - shares[first])
            if others > 0.0:
                pointer = uniforms[child, 0, 1] * others
                second = first_above(
                    shares, pointer if pointer < before else shares[first] + (pointer - before)
                )
            elif fitness.size > 1:  # nobody else has any fitness
                second = np.int64(uniforms[child, 0, 1] * (fitness.size - 1))
                second += np.int64(second >= first)
            else:
                second = first
            parents[child, 0], parents[child, 1] = first, second

    @staticmethod
    def oracle(part: Any, fitness: Any, uniforms: Any) -> Any:
        def drawn(shares: Any, draw: float) -> int:
            slices = list(accumulate(shares))
            return next(agent for agent, end in enumerate(slices) if draw * slices[-1] < end)

        shares, pairs = list(fitness) if any(fitness) else [1.0 for _ in fitness], []
        for one, two, *_ in (draws[0] for draws in uniforms):
            first = drawn(shares, one)
            others = [share * (agent != first) for agent, share in enumerate(shares)]
            alike = [float(agent != first or len(shares) == 1) for agent in range(len(shares))]
            pairs.append([first, drawn(others if any(others) else alike, two)])
        return pairs


class LargerTournament(Selection, name="larger-tournament"):
    """The fittest of `size` randomly drawn agents. Of equal agents, the one drawn first.

    References
    ----------
    Goldberg and Deb 1991.
    """

    size: int = Field(3, ge=2, le=4, description="agents that are drawn for each parent")

    @staticmethod
    def select(
        part: Any,
        fitness: Fitness,
        uniforms: Uniforms,
        shares: Keys,
        order: Order,
        parents: Parents,
    ) -> None:
        for child in range(parents.shape[0]):
            for parent in range(2):
                best = int(uniforms[child, parent, 0] * fitness.size)
                for draw in range(1, part.size):
                    agent = int(uniforms[child, parent, draw] * fitness.size)
                    best = agent if fitness[agent] > fitness[best] else best
                parents[child, parent] = best

    @staticmethod
    def oracle(part: Any, fitness: Any, uniforms: Any) -> Any:
        fought = [
            [[int(draw * len(fitness)) for draw in draws[: part.size]] for draws in of_child[:2]]
            for of_child in uniforms
        ]
        return [
            [max(each, key=lambda agent: fitness[agent]) for each in of_child]
            for of_child in fought
        ]


class Gaussian(Variation, name="gaussian"):
    """Each weight from either parent; mutation adds N(0, `mutation_size`).

    References
    ----------
    Schwefel 1981.
    """

    derived: ClassVar[Mapping[str, Any]] = Crossover.derived

    @staticmethod
    def vary(
        part: Any, fitter: OneGenome, other: OneGenome, draws: Draws, gate: float, child: OneGenome
    ) -> None:
        for module in range(child.shape[0]):
            for weight in range(child.shape[1]):
                draw = module * child.shape[1] + weight
                inherited = (
                    fitter[module, weight] if draws[draw, 0] < 0.5 else other[module, weight]
                )
                if (gate if part.one_gate else draws[draw, 1]) < part.rate:
                    inherited += np.float32(normal_quantile(draws[draw, 2]) * part.size)
                child[module, weight] = inherited

    @staticmethod
    def oracle(part: Any, fitter: Any, other: Any, draws: Any, gate: float) -> Any:
        def mutation(draw: Any) -> float:
            opens = (gate if part.one_gate else draw[1]) < part.rate
            return NormalDist(0, part.size).inv_cdf(draw[2]) if opens and part.size else 0.0

        rest = iter(draws)
        genes = [zip(ours, theirs, rest) for ours, theirs in zip(fitter, other, strict=True)]  # noqa: B905  (draws go on)
        return [
            [(one if draw[0] < 0.5 else two) + mutation(draw) for one, two, draw in module]
            for module in genes
        ]


class OnePointCrossover(Variation, name="one-point-crossover"):
    """One-point crossover of the weights of all modules in a row; then uniform mutation.

    References
    ----------
    Holland 1975.
    """

    derived: ClassVar[Mapping[str, Any]] = Crossover.derived

    @staticmethod
    def vary(
        part: Any, fitter: OneGenome, other: OneGenome, draws: Draws, gate: float, child: OneGenome
    ) -> None:
        cut = cut_at(
            draws[0, 3], child.size
        )  # of the modules in a row; not the gate's number, which may be the child's
        for module in range(child.shape[0]):
            for weight in range(child.shape[1]):
                draw = module * child.shape[1] + weight
                of_fitter = is_of_fitter(draw, cut, draws[0, 0])
                inherited = fitter[module, weight] if of_fitter else other[module, weight]
                child[module, weight] = _mutated(part, inherited, draws, draw, gate)

    @staticmethod
    def oracle(part: Any, fitter: Any, other: Any, draws: Any, gate: float) -> Any:
        inherited = joined(flatten(fitter), flatten(other), draws[0][3], draws[0][0])
        return _in_modules(part, inherited, draws, gate, len(fitter[0]))


class Copy(Variation, name="copy"):
    """Copy of one parent, chosen at random; each weight can mutate uniformly.

    References
    ----------
    Nolfi, Elman and Parisi 1994.
    """

    derived: ClassVar[Mapping[str, Any]] = Crossover.derived

    @staticmethod
    def vary(
        part: Any, fitter: OneGenome, other: OneGenome, draws: Draws, gate: float, child: OneGenome
    ) -> None:
        for module in range(child.shape[0]):
            for weight in range(child.shape[1]):
                inherited = fitter[module, weight] if draws[0, 0] < 0.5 else other[module, weight]
                child[module, weight] = _mutated(
                    part, inherited, draws, module * child.shape[1] + weight, gate
                )

    @staticmethod
    def oracle(part: Any, fitter: Any, other: Any, draws: Any, gate: float) -> Any:
        parent = fitter if draws[0][0] < 0.5 else other
        return _in_modules(part, flatten(parent), draws, gate, len(parent[0]))


class GenePool(Variation, name="gene-pool"):
    """Each weight from a randomly drawn parent of all selected parents; then uniform mutation.

    A surviving agent is in the pool twice.
    Linkage between weights is lost in one generation.

    References
    ----------
    Mühlenbein and Voigt 1996.
    """

    settings: ClassVar[tuple[str, ...]] = ("mutation_rate", "mutation_size")
    derived: ClassVar[Mapping[str, Any]] = {
        "rate": lambda part, experiment: float(experiment.evolution.mutation_rate),
        "size": lambda part, experiment: float(experiment.evolution.mutation_size),
    }

    @staticmethod
    def vary_population(
        part: Any,
        moment: Moment,
        genome: Genome,
        fitness: Fitness,
        parents: Parents,
        draws: Uniforms,
        children: Genome,
    ) -> None:
        length = children.shape[2]
        for child in range(children.shape[0]):
            if parents[child, 1] == ITSELF:
                copy_genome(genome[parents[child, 0]], children[child])
                continue
            rng.draw_uniforms(
                moment.seed, moment.run, moment.generation, rng.INHERITANCE, child, draws
            )
            for draw in range(children.shape[1] * length):
                place = int(draws[draw, 0] * parents.size)
                parent = parents[place // 2, place % 2]
                if parent == ITSELF:
                    parent = parents[place // 2, 0]
                inherited = genome[parent, draw // length, draw % length]
                if draws[draw, 1] < part.rate:
                    inherited += np.float32((2.0 * draws[draw, 2] - 1.0) * part.size)
                children[child, draw // length, draw % length] = inherited

    @staticmethod
    def oracle(part: Any, genome: Any, fitness: Any, parents: Any, draws: Any) -> Any:
        pool = [agent for one, two in parents for agent in (one, one if two == ITSELF else two)]

        def child_of(of_child: Any) -> Any:
            rest = iter(of_child)
            return [
                [
                    _from_pool(part, genome, pool, module, weight, next(rest))
                    for weight in range(len(genes))
                ]
                for module, genes in enumerate(genome[0])
            ]

        return [
            genome[one] if two == ITSELF else child_of(of_child)
            for (one, two), of_child in zip(parents, draws, strict=True)
        ]


@compiled
def _slices(fitness: Fitness, shares: Keys) -> Any:
    """Fill `shares` with fitness added up, alike for all if nobody has any. Gives where it ends, and who has the last slice."""
    nobody = True
    for agent in range(fitness.size):
        nobody = nobody and fitness[agent] == 0.0
    total, last = 0.0, 0
    for agent in range(fitness.size):
        total += 1.0 if nobody else fitness[agent]
        shares[agent] = total
        if nobody or fitness[agent] > 0.0:
            last = agent
    return total, last


@compiled
def _mutated(part: Any, inherited: Any, draws: Draws, draw: int, gate: float) -> Any:
    """A weight after the mutation that `crossover` has."""
    if (gate if part.one_gate else draws[draw, 1]) < part.rate:
        inherited += np.float32((2.0 * draws[draw, 2] - 1.0) * part.size)
    return inherited


def _in_modules(part: Any, weights: Any, draws: Any, gate: float, length: int) -> Any:
    """The oracles' uniform mutation, of a genome whose modules lie in a row."""
    opens = [(gate if part.one_gate else draw[1]) < part.rate for draw in draws]
    child = [
        old + is_open * part.size * (2 * draw[2] - 1)
        for old, is_open, draw in zip(weights, opens, draws, strict=True)
    ]
    return split_modules(child, length)


def _from_pool(part: Any, genome: Any, pool: Any, module: int, weight: int, draw: Any) -> float:
    """For the oracle of `gene-pool`: one weight of a child."""
    inherited = genome[pool[int(draw[0] * len(pool))]][module][weight]
    return float(inherited + (draw[1] < part.rate) * part.size * (2 * draw[2] - 1))
