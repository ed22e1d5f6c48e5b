"""Oracles in plain Python: selections.

An oracle returns the indices of the two parents of each child. `uniforms` is [child][2][4].
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Sequence
from itertools import accumulate
from typing import Any

from baldwinlab.engine.rng import draw
from baldwinlab.parts.breeding import ITSELF


def choose_fitness_sharing(part: Any, generation: Any) -> Any:
    genomes = [
        [gene for module in genome for gene in module] for genome in generation.lifetimes.genome
    ]

    def share(first: Any, second: Any) -> float:
        squares = [(a - b) ** 2 for a, b in zip(first, second, strict=True)]
        distance = math.sqrt(sum(squares) / len(squares))
        return float(max(0.0, 1 - (distance / part.limit) ** part.exponent))

    shares = []
    for agent, genome in enumerate(genomes):
        neighbors = genomes[:agent] + genomes[agent + 1 :]
        niche_count = 1 + sum(share(genome, neighbor) for neighbor in neighbors)
        shares.append(generation.fitness[agent] / niche_count)
    return _spin(shares, generation.uniforms)


def choose_lexicase(part: Any, generation: Any) -> Any:
    agents = range(len(generation.fitness))
    regions = [list(case) for case in zip(*generation.lifetimes.eaten, strict=True)]

    def score(value: float) -> float:
        return -math.inf if math.isnan(value) else value

    records = [[score(value) for value in record] for record in generation.lifetimes.records]
    cases = regions + records

    def choose(number: int) -> int:
        first_draw = number * (len(cases) + 1)
        keys = [draw(generation.stream, first_draw + case) for case in range(len(cases))]
        candidates = list(agents)
        for case in sorted(range(len(cases)), key=lambda case: keys[case]):
            best = max(cases[case][agent] for agent in candidates)
            candidates = [agent for agent in candidates if cases[case][agent] == best]
        return candidates[int(draw(generation.stream, first_draw + len(cases)) * len(candidates))]

    return [[choose(2 * child), choose(2 * child + 1)] for child in range(len(generation.uniforms))]


def choose_neutral(part: Any, generation: Any) -> Any:
    return [
        [int(draw * len(generation.fitness)) for draw in draws[0][:2]]
        for draws in generation.uniforms
    ]


def choose_tournament(part: Any, generation: Any) -> Any:
    def find_winner(draws: Any) -> int:
        agents = [int(draw * len(generation.fitness)) for draw in draws]
        return max(agents, key=lambda agent: generation.fitness[agent])

    # The first two random numbers select the first parent, and the next two the second parent.
    return [[find_winner(draws[0][:2]), find_winner(draws[0][2:])] for draws in generation.uniforms]


def choose_larger_tournament(part: Any, generation: Any) -> Any:
    def find_winner(draws: Any) -> int:
        agents = [int(draw * len(generation.fitness)) for draw in draws[: part.size]]
        return max(agents, key=lambda agent: generation.fitness[agent])

    return [
        [find_winner(draws) for draws in child_draws[:2]] for child_draws in generation.uniforms
    ]


def choose_truncation(part: Any, generation: Any) -> Any:
    order = _sort_from_fittest(generation, tie=0)
    best = order[: max(1, len(order) // 2)]
    return [[best[int(draw * len(best))] for draw in draws[0][:2]] for draws in generation.uniforms]


def choose_best_copies(part: Any, generation: Any) -> Any:
    order = _sort_from_fittest(generation, tie=0)
    best = order[: max(1, int(part.parent_share * len(order) + 0.5))]
    pairs = []
    for child, (draws, _) in enumerate(generation.uniforms):
        first_parent = second_parent = best[child % len(best)]
        if draws[0] < part.two_parent_share:
            second_parent = best[int(draws[1] * len(best))]
        pairs.append([first_parent, second_parent])
    return pairs


def choose_mu_plus_lambda(part: Any, generation: Any) -> Any:
    n_agents = len(generation.fitness)
    mu = max(1, min(n_agents - 1, int(part.survivor_share * n_agents + 0.5)))
    survivors = _sort_from_fittest(generation, tie=3)[:mu]
    pairs = [[survivor, ITSELF] for survivor in survivors]
    for draws in generation.uniforms[mu:]:
        pairs.append([survivors[int(draw * mu)] for draw in draws[0][:2]])
    return pairs


def choose_rank(part: Any, generation: Any) -> Any:
    fitness = generation.fitness

    def rank(value: float) -> float:
        n_lower = sum(1.0 for compared in fitness if compared < value)
        n_equal = sum(1.0 for compared in fitness if compared == value)
        return 0.5 + n_lower + 0.5 * n_equal

    return _spin([rank(value) for value in fitness], generation.uniforms)


def choose_roulette(part: Any, generation: Any) -> Any:
    return _spin(generation.fitness, generation.uniforms)


def choose_expected_offspring(part: Any, generation: Any) -> Any:
    uniforms = generation.uniforms
    sums = _sum_shares(generation.fitness)
    n_parents = 2 * len(uniforms)
    pointers = [(index + uniforms[0][1][0]) * sums[-1] / n_parents for index in range(n_parents)]
    selected_agents = [bisect_right(sums, pointer) for pointer in pointers]
    for index in range(n_parents - 1, 0, -1):
        swap_index = int(uniforms[index // 2][0][index % 2] * (index + 1))
        swapped_agent = selected_agents[swap_index]
        selected_agents[swap_index] = selected_agents[index]
        selected_agents[index] = swapped_agent
    return [selected_agents[index : index + 2] for index in range(0, n_parents, 2)]


def choose_outcrossing(part: Any, generation: Any) -> Any:
    fitness = generation.fitness

    def draw_agent(shares: Any, draw: float) -> int:
        sums = list(accumulate(shares))
        return next(agent for agent, end in enumerate(sums) if draw * sums[-1] < end)

    shares = list(fitness) if any(fitness) else [1.0 for _ in fitness]
    pairs = []
    for first_draw, second_draw, *_ in (draws[0] for draws in generation.uniforms):
        first = draw_agent(shares, first_draw)
        second_shares = [share * (agent != first) for agent, share in enumerate(shares)]
        if not any(second_shares):
            # An agent mates with itself only if it is the only agent.
            second_shares = [
                float(agent != first or len(shares) == 1) for agent in range(len(shares))
            ]
        pairs.append([first, draw_agent(second_shares, second_draw)])
    return pairs


def choose_mutant_fixation(part: Any, generation: Any) -> Any:
    fitness = generation.fitness
    parents = []
    for resident in range(0, len(fitness) - 1, 2):
        powers = [
            (fitness[resident] / fitness[resident + 1]) ** power if fitness[resident + 1] else 1
            for power in range(part.members)
        ]
        probability = 1 / sum(powers) if fitness[resident + 1] else 0
        winner = resident + int(generation.uniforms[resident][0][0] < probability)
        parents += [[winner, ITSELF], [winner, winner]]
    return [*parents, [len(fitness) - 1, ITSELF]] if len(fitness) % 2 else parents


def _sort_from_fittest(generation: Any, tie: int) -> list[int]:
    """Return the agents, the fittest first. The random number `tie` orders equal agents."""
    return sorted(
        range(len(generation.fitness)),
        key=lambda agent: (-generation.fitness[agent], generation.uniforms[agent][1][tie]),
    )


def _spin(shares: Any, uniforms: Any) -> list[list[int]]:
    """Return the parents that a roulette wheel selects."""
    sums = _sum_shares(shares)

    def draw_agent(draw: float) -> int:
        # A product can round up to the sum. Then no end is larger, and the last agent is selected.
        ends = (agent for agent, end in enumerate(sums) if draw * sums[-1] < end)
        return next(ends, len(sums) - 1)

    # The first two random numbers of a child select its two parents.
    return [[draw_agent(draw) for draw in draws[0][:2]] for draws in uniforms]


def _sum_shares(shares: Sequence[float]) -> list[float]:
    """Return the cumulative sums of `shares`. If all are 0, each share counts as 1."""
    effective_shares = shares if any(shares) else [1.0 for _ in shares]
    return list(accumulate(effective_shares))
