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

from typing import Any, ClassVar

import numpy as np

from baldwinlab.engine import rng
from baldwinlab.engine.arithmetic import normal_quantile
from baldwinlab.engine.jit import compiled
from baldwinlab.evolution.variation import Crossover, mutate_uniformly
from baldwinlab.parts import Brood, Mating, Variation
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


class Gaussian(Crossover, name="gaussian"):
    """Each weight from either parent; mutation adds N(0, `mutation_size`).

    References
    ----------
    Schwefel 1981.
    """

    @staticmethod
    def vary(part: Any, mating: Mating) -> None:
        fitter = mating.fitter
        second = mating.second
        child = mating.child
        for module in range(child.shape[0]):
            for weight in range(child.shape[1]):
                draw = module * child.shape[1] + weight
                takes_fitter = mating.draws[draw, 0] < 0.5
                inherited = fitter[module, weight] if takes_fitter else second[module, weight]
                weight_gate = mating.gate if part.mutation_gate else mating.draws[draw, 1]
                if weight_gate < part.mutation_rate:
                    inherited += np.float32(
                        normal_quantile(mating.draws[draw, 2]) * part.mutation_size
                    )
                child[module, weight] = inherited


class OnePointCrossover(Crossover, name="one-point-crossover"):
    """One-point crossover of the weights of all modules in a row; then uniform mutation.

    References
    ----------
    Holland 1975.
    """

    @staticmethod
    def vary(part: Any, mating: Mating) -> None:
        fitter = mating.fitter
        second = mating.second
        child = mating.child
        # The cut is a position in the list of the weights of all modules. The gate cannot determine
        # the cut, because the gate can decide whether the child mutates.
        cut = draw_cut(mating.draws[0, 3], child.size)
        for module in range(child.shape[0]):
            for weight in range(child.shape[1]):
                draw = module * child.shape[1] + weight
                uses_fitter = is_from_fitter(draw, cut, mating.draws[0, 0])
                inherited = fitter[module, weight] if uses_fitter else second[module, weight]
                child[module, weight] = mutate_uniformly(part, mating, inherited, draw)


class Copy(Variation, name="copy"):
    """Copy of one parent, chosen at random; each weight can mutate uniformly.

    References
    ----------
    Nolfi, Elman and Parisi 1994.
    """

    reads: ClassVar[tuple[str, ...]] = Crossover.reads

    @staticmethod
    def vary(part: Any, mating: Mating) -> None:
        fitter = mating.fitter
        second = mating.second
        child = mating.child
        for module in range(child.shape[0]):
            for weight in range(child.shape[1]):
                inherited = (
                    fitter[module, weight] if mating.draws[0, 0] < 0.5 else second[module, weight]
                )
                draw = module * child.shape[1] + weight
                child[module, weight] = mutate_uniformly(part, mating, inherited, draw)


class GenePool(Variation, name="gene-pool"):
    """Each weight from a random parent, drawn from the pool of all selected parents; then mutation.

    Mutation is uniform.
    A surviving agent is in the pool twice.
    Linkage between weights is lost in one generation.

    References
    ----------
    Mühlenbein and Voigt 1996.
    """

    reads: ClassVar[tuple[str, ...]] = ("mutation_rate", "mutation_size")

    @staticmethod
    def vary_population(part: Any, brood: Brood) -> None:
        key = brood.key
        children = brood.children
        draws = brood.draws
        parents = brood.parents
        # Random number `draw` is for weight draw % length of module draw // length.
        length = children.shape[2]
        for child in range(children.shape[0]):
            if parents[child, 1] == ITSELF:
                copy_genome(brood.genome[parents[child, 0]], children[child])
                continue
            rng.draw_uniforms(key.seed, key.run, key.generation, rng.INHERITANCE, child, draws)
            for draw in range(children.shape[1] * length):
                # An index in the pool of parents, two for each child.
                pool_index = int(draws[draw, 0] * parents.size)
                pool_child = pool_index // 2
                parent = parents[pool_child, pool_index % 2]
                if parent == ITSELF:
                    parent = parents[pool_child, 0]
                inherited = brood.genome[parent, draw // length, draw % length]
                if draws[draw, 1] < part.mutation_rate:
                    inherited += np.float32((2.0 * draws[draw, 2] - 1.0) * part.mutation_size)
                children[child, draw // length, draw % length] = inherited
