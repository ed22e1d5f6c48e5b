"""Oracles in plain Python: variations.

`fitter` and `second` are genomes [module][weight]. `draws` [gene][4] and `gate` are random numbers.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from statistics import NormalDist
from typing import Any

from baldwinlab.models.discrete_variation import BITS_PER_WEIGHT
from baldwinlab.models.kit import UNSET_ALLELE
from baldwinlab.parts.breeding import ITSELF


def breed_infinitesimal(part: Any, fitter: Any, second: Any, draws: Any, gate: float) -> Any:
    noise = NormalDist()
    return _vary_genes(
        fitter,
        second,
        draws,
        lambda a, b, draw: (a + b) / 2 + part.mutation_size * noise.inv_cdf(draw[2]),
    )


def breed_self_adaptive(
    part: Any, fitter: Any, second: Any, draws: Any, gate: float, genes: Mapping[str, float]
) -> Any:
    mutations = NormalDist(0, genes["step_size"])
    return _vary_genes(
        fitter,
        second,
        draws,
        lambda a, b, draw: (a if draw[0] < 0.5 else b) + mutations.inv_cdf(draw[1]),
    )


def breed_crossover(part: Any, fitter: Any, second: Any, draws: Any, gate: float) -> Any:
    return _vary_genes(
        fitter,
        second,
        draws,
        lambda a, b, draw: _mutate(part, a if draw[0] < 0.5 else b, draw, gate),
    )


def breed_gaussian(part: Any, fitter: Any, second: Any, draws: Any, gate: float) -> Any:
    def draw_mutation(draw: Any) -> float:
        is_mutated = (gate if part.mutation_gate else draw[1]) < part.mutation_rate
        # A normal distribution with the standard deviation 0 has no quantiles.
        has_effect = is_mutated and part.mutation_size > 0
        return NormalDist(0, part.mutation_size).inv_cdf(draw[2]) if has_effect else 0.0

    return _vary_genes(
        fitter, second, draws, lambda a, b, draw: (a if draw[0] < 0.5 else b) + draw_mutation(draw)
    )


def breed_one_point_crossover(part: Any, fitter: Any, second: Any, draws: Any, gate: float) -> Any:
    inherited = _cross_at_point(_flatten(fitter), _flatten(second), draws[0][3], draws[0][0])
    return _mutate_in_modules(part, inherited, draws, gate, len(fitter[0]))


def breed_copy(part: Any, fitter: Any, second: Any, draws: Any, gate: float) -> Any:
    parent = fitter if draws[0][0] < 0.5 else second
    return _mutate_in_modules(part, _flatten(parent), draws, gate, len(parent[0]))


def breed_gene_pool(part: Any, genome: Any, fitness: Any, parents: Any, draws: Any) -> Any:
    pool = []
    for first, second in parents:
        pool += [first, first if second == ITSELF else second]
    flat_genomes = [_flatten(modules) for modules in genome]

    def make_child(child_draws: Any) -> Any:
        child = []
        for number, draw in zip(range(len(flat_genomes[0])), child_draws, strict=False):
            inherited = flat_genomes[pool[int(draw[0] * len(pool))]][number]
            is_mutated = draw[1] < part.mutation_rate
            child.append(inherited + part.mutation_size * (2 * draw[2] - 1) * is_mutated)
        return _split_modules(child, len(genome[0][0]))

    return [
        genome[first] if second == ITSELF else make_child(child_draws)
        for (first, second), child_draws in zip(parents, draws, strict=True)
    ]


def breed_few_mutations(part: Any, fitter: Any, second: Any, draws: Any, gate: float) -> Any:
    child = [list(module) for module in (fitter if gate < 0.5 else second)]
    module_size = len(child[0])
    n_weights = len(child) * module_size
    for _, position_draw, change_draw, _ in draws[: part.mutations]:
        module, weight = divmod(int(position_draw * n_weights), module_size)
        child[module][weight] += (2 * change_draw - 1) * part.mutation_size
    return child


def breed_one_point_of_units(part: Any, fitter: Any, second: Any, draws: Any, gate: float) -> Any:
    child = _cross_at_point(fitter[0], second[0], gate, draws[0][0])
    n_kind_genes = part.units
    n_strength_genes = part.units**2
    for gene, draw in enumerate(draws):
        if draw[1] < part.mutation_rate:
            if gene < n_kind_genes:
                child[gene] = int(6 * draw[2])
            elif gene < n_kind_genes + n_strength_genes:
                child[gene] = int(5 * draw[2]) / 2 - 1
            else:
                child[gene] = int(2 * draw[2])
    return [child]


def breed_four_bit_weights(part: Any, fitter: Any, second: Any, draws: Any, gate: float) -> Any:
    parents = _flatten(fitter), _flatten(second)
    n_weights = len(parents[0])
    if gate < part.crossover_share:
        combination = int(gate / part.crossover_share * 2 * (n_weights - 1))
        cut = 1 + combination // 2
    else:
        position = (gate - part.crossover_share) / (1 - part.crossover_share)
        combination = int(position * 2 * (n_weights - 1))
        cut = n_weights
    first_parent = parents[combination % 2]
    last_parent = parents[1 - combination % 2]
    child = [*first_parent[:cut], *last_parent[cut:]]
    for weight, draw in enumerate(draws):
        flipped_bits = sum(
            2**bit for bit in range(BITS_PER_WEIGHT) if draw[bit] < part.mutation_rate
        )
        if flipped_bits:
            rounded = (child[weight] + 2) * 15 / 4 + 0.5
            level = int(min(max(rounded, 0), 15)) ^ flipped_bits
            child[weight] = level * 4 / 15 - 2
    return _split_modules(child, len(fitter[0]))


def breed_one_point_of_alleles(part: Any, fitter: Any, second: Any, draws: Any, gate: float) -> Any:
    def mutate(draw: float) -> float:
        zero_share = part.three_zero_shares / 3
        if draw < zero_share:
            return 0.0
        return 1.0 if draw >= 1 - zero_share else UNSET_ALLELE

    inherited = _cross_at_point(_flatten(fitter), _flatten(second), gate, draws[0][0])
    child = [
        mutate(draw[2]) if draw[1] < part.mutation_rate else allele
        for allele, draw in zip(inherited, draws, strict=True)
    ]
    return _split_modules(child, len(fitter[0]))


def breed_lattice_steps(part: Any, fitter: Any, second: Any, draws: Any, gate: float) -> Any:
    return _vary_genes(fitter, second, draws, lambda a, b, draw: a + (1 if draw[0] < 0.5 else -1))


def breed_one_point_of_bits(part: Any, fitter: Any, second: Any, draws: Any, gate: float) -> Any:
    inherited = _cross_at_point(_flatten(fitter), _flatten(second), gate, draws[0][0])
    child = [
        1 - bit if draw[1] < part.mutation_rate else bit
        for bit, draw in zip(inherited, draws, strict=True)
    ]
    return _split_modules(child, len(fitter[0]))


def breed_bit_flips(part: Any, fitter: Any, second: Any, draws: Any, gate: float) -> Any:
    def flip(a: float, b: float, draw: Any) -> float:
        bit = a if gate < 0.5 else b
        return 1 - bit if draw[1] < part.mutation_rate else bit

    return _vary_genes(fitter, second, draws, flip)


def _cross_at_point(
    fitter: Sequence[Any], second_parent: Sequence[Any], draw: float, coin: float
) -> list[Any]:
    """Return the one-point crossover of two parents."""
    first, second = (fitter, second_parent) if coin < 0.5 else (second_parent, fitter)
    cut = 1 + int(draw * (len(fitter) - 1))
    return [*first[:cut], *second[cut:]]


def _mutate(part: Any, weight: float, draw: Any, gate: float) -> float:
    """Mutate a weight uniformly if the random number of the weight or of the child is small."""
    is_mutated = (gate if part.mutation_gate else draw[1]) < part.mutation_rate
    return float(weight + (part.mutation_size * (2 * draw[2] - 1) if is_mutated else 0.0))


def _mutate_in_modules(part: Any, weights: Any, draws: Any, gate: float, length: int) -> Any:
    """Mutate a list of weights uniformly and split it into modules."""
    mutated = [
        _mutate(part, weight, draw, gate) for weight, draw in zip(weights, draws, strict=True)
    ]
    return _split_modules(mutated, length)


def _vary_genes(fitter: Any, second: Any, draws: Any, vary_gene: Callable[..., float]) -> Any:
    """Return a child. Gene i is `vary_gene` of gene i of both parents and of `draws[i]`."""
    pairs = zip(_flatten(fitter), _flatten(second), strict=True)
    child = [vary_gene(a, b, draw) for (a, b), draw in zip(pairs, draws, strict=False)]
    return _split_modules(child, len(fitter[0]))


def _split_modules(genes: Sequence[Any], length: int) -> list[Sequence[Any]]:
    """Split a list of genes into modules of `length` genes."""
    return [genes[start : start + length] for start in range(0, len(genes), length)]


def _flatten(genome: Sequence[Sequence[Any]]) -> list[Any]:
    """Return the genes of all modules of a genome as one list."""
    return [gene for module in genome for gene in module]
