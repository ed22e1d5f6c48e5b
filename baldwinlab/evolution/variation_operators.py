"""Variation operators of weights: recombination of two parents, then mutation.

No operator prefers the fitter of two parents, because a random number decides from which parent a
child inherits. Therefore, neutral selection with these operators is a valid neutral control.

`infinitesimal` is the infinitesimal model of quantitative genetics. A trait has many loci with
small effects, so the children of two parents are normal around the mean of the parents, with a
variance that selection does not change.

With `self-adaptive`, each agent has the gene `step_size`, which a child inherits from one of its
parents. The gene mutates log-normally, before the weights. All weights mutate with the new step
size, so selection acts on a step size through the mutated weights. Interpretation: each weight and
the step size come from one parent. Evolution strategies often use the mean of the step sizes.

References
----------
Le 2019, section "Simulation 1: Evolution alone (EVO)": `crossover`. docs/explanation/model.md lists
the other interpretations of this section (R5).

.. [1] H.-P. Schwefel, Numerical Optimization of Computer Models (1981): normal mutations
   (`gaussian`), and inherited step sizes (`self-adaptive`).
.. [2] J. H. Holland, Adaptation in Natural and Artificial Systems (1975): `one-point-crossover`.
.. [3] S. Nolfi, J. L. Elman and D. Parisi, "Learning and evolution in neural networks", Adaptive
   Behavior 3 (1994): `copy`. Children differ from their single parent by mutation alone.
.. [4] H. Mühlenbein and H.-M. Voigt, "Gene pool recombination in genetic algorithms",
   Meta-Heuristics: Theory and Applications (1996): `gene-pool`.
.. [5] R. A. Fisher, "The correlation between relatives on the supposition of Mendelian
   inheritance", Transactions of the Royal Society of Edinburgh 52 (1918): `infinitesimal`.
.. [6] M. G. Bulmer, "The effect of selection on genetic variability", The American Naturalist 105
   (1971): `infinitesimal`.
.. [7] H.-G. Beyer, "Evolution strategies", Scholarpedia 2 (2007): one step size for n weights, with
   the learning rate 1 / sqrt(2 n) (`self-adaptive`). Eiben and Smith (2015) state 1 / sqrt(n), up
   to a factor.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from baldwinlab.engine import rng
from baldwinlab.engine.arithmetic import normal_quantile
from baldwinlab.engine.jit import compiled
from baldwinlab.parts import Brood, Field, Gene, Mating, Variation
from baldwinlab.parts.breeding import ITSELF, copy_genome


class Crossover(Variation, name="crossover"):
    """Each weight from the fitter or the second parent with equal probability; then mutation.

    References
    ----------
    Le 2019.
    """

    reads: ClassVar[tuple[str, ...]] = ("mutation_gate", "mutation_rate", "mutation_size")

    @staticmethod
    def vary(part: Any, mating: Mating) -> None:
        child = mating.child
        for module in range(child.shape[0]):
            for weight in range(child.shape[1]):
                draw = module * child.shape[1] + weight
                takes_fitter = mating.draws[draw, 0] < 0.5
                inherited = choose_gene(mating, module, weight, takes_fitter)
                child[module, weight] = mutate_uniformly(part, mating, inherited, draw)


@compiled
def choose_gene(mating: Mating, module: int, weight: int, takes_fitter: bool) -> Any:
    """Return a gene of the fitter or of the second parent."""
    # Both genes are read, because a processor predicts half of such random branches wrongly.
    gene_of_fitter = mating.fitter[module, weight]
    gene_of_second = mating.second[module, weight]
    return gene_of_fitter if takes_fitter else gene_of_second


@compiled
def mutate_uniformly(part: Any, mating: Mating, inherited: Any, draw: int) -> Any:
    """Return a weight after a possible mutation, which adds U(-size, size)."""
    # The gate is a random number of the child or of the weight.
    gate = mating.gate if part.mutation_gate else mating.draws[draw, 1]
    if gate < part.mutation_rate:
        inherited += np.float32((2.0 * mating.draws[draw, 2] - 1.0) * part.mutation_size)
    return inherited


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
        child = mating.child
        for module in range(child.shape[0]):
            for weight in range(child.shape[1]):
                draw = module * child.shape[1] + weight
                takes_fitter = mating.draws[draw, 0] < 0.5
                inherited = choose_gene(mating, module, weight, takes_fitter)
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
        child = mating.child
        # The cut is an index in the row of the weights of all modules. `mating.gate` must not
        # determine the cut, because the gate can decide whether the child mutates.
        cut = draw_cut(mating.draws[0, 3], child.size)
        for module in range(child.shape[0]):
            for weight in range(child.shape[1]):
                draw = module * child.shape[1] + weight
                takes_fitter = is_from_fitter(draw, cut, mating.draws[0, 0])
                inherited = choose_gene(mating, module, weight, takes_fitter)
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
        child = mating.child
        takes_fitter = mating.draws[0, 0] < 0.5
        for module in range(child.shape[0]):
            for weight in range(child.shape[1]):
                inherited = choose_gene(mating, module, weight, takes_fitter)
                draw = module * child.shape[1] + weight
                child[module, weight] = mutate_uniformly(part, mating, inherited, draw)


class GenePool(Variation, name="gene-pool"):
    """Each weight from a random parent, drawn from the pool of all selected parents; then mutation.

    Mutation is uniform. A surviving agent is in the pool twice. Linkage between weights is lost in
    one generation.

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
        # Row `draw` of `draws` is for weight draw % length of module draw // length.
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


class Infinitesimal(Variation, name="infinitesimal"):
    """Mean of both parents for each weight, plus N(0, `mutation_size`) for each weight.

    References
    ----------
    Fisher 1918; Bulmer 1971.
    """

    reads: ClassVar[tuple[str, ...]] = ("mutation_size",)

    @staticmethod
    def vary(part: Any, mating: Mating) -> None:
        fitter = mating.fitter
        second = mating.second
        child = mating.child
        for module in range(child.shape[0]):
            for weight in range(child.shape[1]):
                draw = mating.draws[module * child.shape[1] + weight, 2]
                mean = np.float32(0.5) * (fitter[module, weight] + second[module, weight])
                child[module, weight] = mean + np.float32(
                    normal_quantile(draw) * part.mutation_size
                )


MIN_STEP_SIZE = 1e-4
MAX_STEP_SIZE = 10.0


class SelfAdaptive(Variation, name="self-adaptive"):
    """Each weight from either parent; then normal mutation with an inherited step size.

    References
    ----------
    Schwefel 1981; Beyer 2007.
    """

    initial_step_size: float = Field(
        0.1,
        ge=MIN_STEP_SIZE,
        le=MAX_STEP_SIZE,
        description="Standard deviation of the mutations of the founders.",
    )
    genes: ClassVar[Mapping[str, Gene]] = {
        "step_size": Gene(
            initial="initial_step_size",
            low=MIN_STEP_SIZE,
            high=MAX_STEP_SIZE,
            help="standard deviation of mutations",
        )
    }

    @staticmethod
    def vary(part: Any, mating: Mating) -> None:
        child = mating.child
        # The gene has been inherited and has mutated before this hook.
        step_size = np.float64(child[0, part.step_size])
        for module in range(child.shape[0]):
            for weight in range(child.shape[1]):
                draw = module * child.shape[1] + weight
                takes_fitter = mating.draws[draw, 0] < 0.5
                inherited = choose_gene(mating, module, weight, takes_fitter)
                mutation = np.float32(step_size * normal_quantile(mating.draws[draw, 1]))
                child[module, weight] = inherited + mutation
