"""Variation operators in addition to `crossover`, the operator of the first paper.

No operator prefers the fitter of two parents. A random number decides from which parent a child
inherits. Therefore, neutral selection with these operators is a valid neutral control.

References
----------
.. [1] H.-P. Schwefel, Numerical Optimization of Computer Models (1981): normal mutations
   (`gaussian`).
.. [2] J. H. Holland, Adaptation in Natural and Artificial Systems (1975): `one-point-crossover`.
.. [3] S. Nolfi, J. L. Elman and D. Parisi, "Learning and evolution in neural networks", Adaptive
   Behavior 3 (1994): `copy`. Children differ from their single parent by mutation alone.
.. [4] H. Mühlenbein and H.-M. Voigt, "Gene pool recombination in genetic algorithms",
   Meta-Heuristics: Theory and Applications (1996): `gene-pool`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from statistics import NormalDist
from typing import Any, ClassVar

import numpy as np

from baldwinlab.engine import rng
from baldwinlab.engine.arithmetic import normal_quantile
from baldwinlab.engine.jit import compiled
from baldwinlab.evolution.rng_key import Fitness, GenerationKey, Genome, Parents, Uniforms
from baldwinlab.evolution.variation import Crossover, Draws, OneGenome
from baldwinlab.parts import Variation
from baldwinlab.parts.breeding import ITSELF, copy_genome


@compiled
def draw_cut(draw: float, n_genes: int) -> int:
    """Return the index of the first gene after the cut of one-point crossover.

    The cut is uniform over the gaps between genes. `draw` is uniform in (0, 1).
    """
    n_gaps = n_genes - 1
    return 1 + int(draw * n_gaps)


@compiled
def is_from_fitter(gene: int, cut: int, coin: float) -> bool:
    """Return whether one-point crossover takes a gene from the fitter parent.

    `coin` is uniform in (0, 1) and selects the parent of the first genes.
    """
    return (gene < cut) == (coin < 0.5)


def flatten(genome: Sequence[Sequence[Any]]) -> list[Any]:
    """Return the genes of all modules of a genome as one list, for oracles."""
    return [gene for module in genome for gene in module]


def split_modules(genes: Sequence[Any], length: int) -> list[Sequence[Any]]:
    """Split a list of genes into modules of `length` genes, for oracles."""
    return [genes[start : start + length] for start in range(0, len(genes), length)]


def cross_at_point(
    fitter: Sequence[Any], second_parent: Sequence[Any], draw: float, coin: float
) -> list[Any]:
    """Return the one-point crossover of two parents, for oracles."""
    first, second = (fitter, second_parent) if coin < 0.5 else (second_parent, fitter)
    cut = 1 + int(draw * (len(fitter) - 1))
    return [*first[:cut], *second[cut:]]


class Gaussian(Variation, name="gaussian"):
    """Each weight from either parent; mutation adds N(0, `mutation_size`).

    References
    ----------
    Schwefel 1981.
    """

    settings: ClassVar[tuple[str, ...]] = Crossover.settings
    derived: ClassVar[Mapping[str, Any]] = Crossover.derived

    @staticmethod
    def vary(
        part: Any, fitter: OneGenome, second: OneGenome, draws: Draws, gate: float, child: OneGenome
    ) -> None:
        for module in range(child.shape[0]):
            for weight in range(child.shape[1]):
                draw = module * child.shape[1] + weight
                takes_fitter = draws[draw, 0] < 0.5
                inherited = fitter[module, weight] if takes_fitter else second[module, weight]
                weight_gate = gate if part.one_gate else draws[draw, 1]
                if weight_gate < part.rate:
                    inherited += np.float32(normal_quantile(draws[draw, 2]) * part.size)
                child[module, weight] = inherited

    @staticmethod
    def oracle(part: Any, fitter: Any, second: Any, draws: Any, gate: float) -> Any:
        def draw_mutation(draw: Any) -> float:
            is_mutated = (gate if part.one_gate else draw[1]) < part.rate
            # A normal distribution with the standard deviation 0 has no quantiles.
            has_effect = is_mutated and part.size > 0
            return NormalDist(0, part.size).inv_cdf(draw[2]) if has_effect else 0.0

        remaining_draws = iter(draws)
        child: list[list[float]] = [[] for _ in fitter]
        for module, weights in enumerate(fitter):
            for weight in range(len(weights)):
                draw = next(remaining_draws)
                parent = fitter if draw[0] < 0.5 else second
                child[module].append(parent[module][weight] + draw_mutation(draw))
        return child


class OnePointCrossover(Variation, name="one-point-crossover"):
    """One-point crossover of the weights of all modules in a row; then uniform mutation.

    References
    ----------
    Holland 1975.
    """

    settings: ClassVar[tuple[str, ...]] = Crossover.settings
    derived: ClassVar[Mapping[str, Any]] = Crossover.derived

    @staticmethod
    def vary(
        part: Any, fitter: OneGenome, second: OneGenome, draws: Draws, gate: float, child: OneGenome
    ) -> None:
        # The cut is a position in the list of the weights of all modules. The gate cannot determine
        # the cut, because the gate can decide whether the child mutates.
        cut = draw_cut(draws[0, 3], child.size)
        for module in range(child.shape[0]):
            for weight in range(child.shape[1]):
                draw = module * child.shape[1] + weight
                uses_fitter = is_from_fitter(draw, cut, draws[0, 0])
                inherited = fitter[module, weight] if uses_fitter else second[module, weight]
                child[module, weight] = _mutate(part, inherited, draws, draw, gate)

    @staticmethod
    def oracle(part: Any, fitter: Any, second: Any, draws: Any, gate: float) -> Any:
        inherited = cross_at_point(flatten(fitter), flatten(second), draws[0][3], draws[0][0])
        return _mutate_in_modules(part, inherited, draws, gate, len(fitter[0]))


class Copy(Variation, name="copy"):
    """Copy of one parent, chosen at random; each weight can mutate uniformly.

    References
    ----------
    Nolfi, Elman and Parisi 1994.
    """

    settings: ClassVar[tuple[str, ...]] = Crossover.settings
    derived: ClassVar[Mapping[str, Any]] = Crossover.derived

    @staticmethod
    def vary(
        part: Any, fitter: OneGenome, second: OneGenome, draws: Draws, gate: float, child: OneGenome
    ) -> None:
        for module in range(child.shape[0]):
            for weight in range(child.shape[1]):
                inherited = fitter[module, weight] if draws[0, 0] < 0.5 else second[module, weight]
                draw = module * child.shape[1] + weight
                child[module, weight] = _mutate(part, inherited, draws, draw, gate)

    @staticmethod
    def oracle(part: Any, fitter: Any, second: Any, draws: Any, gate: float) -> Any:
        parent = fitter if draws[0][0] < 0.5 else second
        return _mutate_in_modules(part, flatten(parent), draws, gate, len(parent[0]))


class GenePool(Variation, name="gene-pool"):
    """Each weight from a random parent, drawn from the pool of all selected parents; then mutation.

    Mutation is uniform.
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
        key: GenerationKey,
        genome: Genome,
        fitness: Fitness,
        parents: Parents,
        draws: Uniforms,
        children: Genome,
    ) -> None:
        # Random number `draw` is for weight draw % length of module draw // length.
        length = children.shape[2]
        for child in range(children.shape[0]):
            if parents[child, 1] == ITSELF:
                copy_genome(genome[parents[child, 0]], children[child])
                continue
            rng.draw_uniforms(key.seed, key.run, key.generation, rng.INHERITANCE, child, draws)
            for draw in range(children.shape[1] * length):
                # An index in the pool of parents, two for each child.
                pool_index = int(draws[draw, 0] * parents.size)
                pool_child = pool_index // 2
                parent = parents[pool_child, pool_index % 2]
                if parent == ITSELF:
                    parent = parents[pool_child, 0]
                inherited = genome[parent, draw // length, draw % length]
                if draws[draw, 1] < part.rate:
                    inherited += np.float32((2.0 * draws[draw, 2] - 1.0) * part.size)
                children[child, draw // length, draw % length] = inherited

    @staticmethod
    def oracle(part: Any, genome: Any, fitness: Any, parents: Any, draws: Any) -> Any:
        pool = []
        for first, second in parents:
            pool += [first, first if second == ITSELF else second]

        def make_child(child_draws: Any) -> Any:
            remaining_draws = iter(child_draws)
            child: list[list[float]] = [[] for _ in genome[0]]
            for module, weights in enumerate(genome[0]):
                for weight in range(len(weights)):
                    draw = next(remaining_draws)
                    child[module].append(_draw_from_pool(part, genome, pool, module, weight, draw))
            return child

        return [
            genome[first] if second == ITSELF else make_child(child_draws)
            for (first, second), child_draws in zip(parents, draws, strict=True)
        ]


@compiled
def _mutate(part: Any, inherited: Any, draws: Draws, draw: int, gate: float) -> Any:
    """Return a weight after the mutation of the operator `crossover`."""
    weight_gate = gate if part.one_gate else draws[draw, 1]
    if weight_gate < part.rate:
        inherited += np.float32((2.0 * draws[draw, 2] - 1.0) * part.size)
    return inherited


def _mutate_in_modules(part: Any, weights: Any, draws: Any, gate: float, length: int) -> Any:
    """Mutate a list of weights uniformly and split it into modules, for oracles."""
    child = []
    for weight, draw in zip(weights, draws, strict=True):
        is_mutated = (gate if part.one_gate else draw[1]) < part.rate
        mutation = part.size * (2 * draw[2] - 1) if is_mutated else 0.0
        child.append(weight + mutation)
    return split_modules(child, length)


def _draw_from_pool(
    part: Any, genome: Any, pool: Any, module: int, weight: int, draw: Any
) -> float:
    """Return a weight of a child: inherited from a random parent and mutated, for the oracle."""
    parent = pool[int(draw[0] * len(pool))]
    inherited = genome[parent][module][weight]
    is_mutated = draw[1] < part.rate
    mutation = part.size * (2 * draw[2] - 1) if is_mutated else 0.0
    return float(inherited + mutation)
