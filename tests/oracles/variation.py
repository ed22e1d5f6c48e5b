"""Oracles in plain Python: variations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from statistics import NormalDist
from typing import Any

from baldwinlab.models.discrete_variation import BITS_PER_WEIGHT
from baldwinlab.models.kit import UNSET_ALLELE
from baldwinlab.parts.breeding import ITSELF


def breed_infinitesimal(part: Any, fitter: Any, second: Any, draws: Any, gate: float) -> Any:
    remaining_draws = iter(draws)
    return [
        [
            (first_weight + second_weight) / 2
            + part.mutation_size * NormalDist().inv_cdf(next(remaining_draws)[2])
            for first_weight, second_weight in zip(first_module, second_module, strict=True)
        ]
        for first_module, second_module in zip(fitter, second, strict=True)
    ]


def breed_self_adaptive(
    part: Any, fitter: Any, second: Any, draws: Any, gate: float, genes: Mapping[str, float]
) -> Any:
    mutations = NormalDist(0, genes["step_size"])
    remaining_draws = iter(draws)
    child: list[list[float]] = []
    for fitter_module, second_module in zip(fitter, second, strict=True):
        child.append([])
        for fitter_weight, second_weight in zip(fitter_module, second_module, strict=True):
            coin, quantile, _, _ = next(remaining_draws)
            inherited = fitter_weight if coin < 0.5 else second_weight
            child[-1].append(inherited + mutations.inv_cdf(quantile))
    return child


def breed_crossover(part: Any, fitter: Any, second: Any, draws: Any, gate: float) -> Any:
    # A row of random numbers for each weight of all modules.
    remaining_draws = iter(draws)
    child: list[list[float]] = []
    for fitter_module, second_module in zip(fitter, second, strict=True):
        child.append([])
        for fitter_weight, second_weight in zip(fitter_module, second_module, strict=True):
            coin, weight_gate, size_draw, _ = next(remaining_draws)
            inherited = fitter_weight if coin < 0.5 else second_weight
            is_mutated = (gate if part.mutation_gate else weight_gate) < part.mutation_rate
            mutation = part.mutation_size * (2 * size_draw - 1) if is_mutated else 0.0
            child[-1].append(inherited + mutation)
    return child


def breed_gaussian(part: Any, fitter: Any, second: Any, draws: Any, gate: float) -> Any:
    def draw_mutation(draw: Any) -> float:
        is_mutated = (gate if part.mutation_gate else draw[1]) < part.mutation_rate
        # A normal distribution with the standard deviation 0 has no quantiles.
        has_effect = is_mutated and part.mutation_size > 0
        return NormalDist(0, part.mutation_size).inv_cdf(draw[2]) if has_effect else 0.0

    remaining_draws = iter(draws)
    child: list[list[float]] = [[] for _ in fitter]
    for module, weights in enumerate(fitter):
        for weight in range(len(weights)):
            draw = next(remaining_draws)
            parent = fitter if draw[0] < 0.5 else second
            child[module].append(parent[module][weight] + draw_mutation(draw))
    return child


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
    remaining_draws = iter(draws)
    return [
        [gene + (1 if next(remaining_draws)[0] < 0.5 else -1) for gene in module]
        for module in fitter
    ]


def breed_one_point_of_bits(part: Any, fitter: Any, second: Any, draws: Any, gate: float) -> Any:
    inherited = _cross_at_point(_flatten(fitter), _flatten(second), gate, draws[0][0])
    child = [
        1 - bit if draw[1] < part.mutation_rate else bit
        for bit, draw in zip(inherited, draws, strict=True)
    ]
    return _split_modules(child, len(fitter[0]))


def breed_bit_flips(part: Any, fitter: Any, second: Any, draws: Any, gate: float) -> Any:
    parent = fitter if gate < 0.5 else second
    remaining_draws = iter(draws)
    return [
        [1 - bit if next(remaining_draws)[1] < part.mutation_rate else bit for bit in module]
        for module in parent
    ]


def _cross_at_point(
    fitter: Sequence[Any], second_parent: Sequence[Any], draw: float, coin: float
) -> list[Any]:
    """Return the one-point crossover of two parents."""
    first, second = (fitter, second_parent) if coin < 0.5 else (second_parent, fitter)
    cut = 1 + int(draw * (len(fitter) - 1))
    return [*first[:cut], *second[cut:]]


def _mutate_in_modules(part: Any, weights: Any, draws: Any, gate: float, length: int) -> Any:
    """Mutate a list of weights uniformly and split it into modules."""
    child = []
    for weight, draw in zip(weights, draws, strict=True):
        is_mutated = (gate if part.mutation_gate else draw[1]) < part.mutation_rate
        mutation = part.mutation_size * (2 * draw[2] - 1) if is_mutated else 0.0
        child.append(weight + mutation)
    return _split_modules(child, length)


def _split_modules(genes: Sequence[Any], length: int) -> list[Sequence[Any]]:
    """Split a list of genes into modules of `length` genes."""
    return [genes[start : start + length] for start in range(0, len(genes), length)]


def _flatten(genome: Sequence[Sequence[Any]]) -> list[Any]:
    """Return the genes of all modules of a genome as one list."""
    return [gene for module in genome for gene in module]


def _draw_from_pool(
    part: Any, genome: Any, pool: Any, module: int, weight: int, draw: Any
) -> float:
    """Return a weight of a child: inherited from a random parent and mutated."""
    parent = pool[int(draw[0] * len(pool))]
    inherited = genome[parent][module][weight]
    is_mutated = draw[1] < part.mutation_rate
    mutation = part.mutation_size * (2 * draw[2] - 1) if is_mutated else 0.0
    return float(inherited + mutation)
