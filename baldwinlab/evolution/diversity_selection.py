"""Selections that preserve diversity: lexicase selection and fitness sharing.

Lexicase selection compares agents on several cases in random order. Fitness sharing divides the
fitness of an agent by the number of similar agents.

References
----------
.. [1] L. Spector, "Assessment of problem modality by differential performance of lexicase selection
   in genetic programming", GECCO Companion (2012).
.. [2] T. Helmuth, L. Spector and J. Matheson, "Solving uncompromising problems with lexicase
   selection", IEEE Transactions on Evolutionary Computation 19 (2015).
.. [3] D. E. Goldberg and J. Richardson, "Genetic algorithms with sharing for multimodal function
   optimization", Proceedings of the 2nd International Conference on Genetic Algorithms (1987).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from baldwinlab.engine.jit import compiled, register
from baldwinlab.engine.rng import Stream, draw
from baldwinlab.engine.simd import square_root
from baldwinlab.evolution.neat.operators import genome_part
from baldwinlab.evolution.proportional_selection import draw_index, spin
from baldwinlab.evolution.rng_key import Genome
from baldwinlab.evolution.selection import Order
from baldwinlab.experiment import BaseExperiment
from baldwinlab.parts import Field, Generation, Selection
from baldwinlab.parts.lifetimes import Lifetimes


def _read_record(records: Any, number: Any, agent: Any) -> Any:
    """Return the value of an agent in the record at index `number` of a tuple of arrays [agent]."""
    return np.float64(records[number][agent])


def _choose_record_source(records: Any, number: Any, agent: Any) -> Any:
    # Compiled code cannot index a tuple of different types by a variable, so it tests each index.
    if len(records) == 0:
        return lambda records, number, agent: 0.0
    if len(records) == 1:
        return lambda records, number, agent: np.float64(records[0][agent])
    return lambda records, number, agent: (
        np.float64(records[0][agent])
        if number == 0
        else read_record(records[1:], number - 1, agent)
    )


read_record = register(_read_record, _choose_record_source)


@compiled
def _read_case(lifetimes: Lifetimes, case: Any, agent: Any) -> float:
    """Return the value of an agent in a case: eaten items of a region, or a record."""
    n_regions = lifetimes.eaten.shape[1]
    if case < n_regions:
        return np.float64(lifetimes.eaten[agent, case])
    value = read_record(lifetimes.records, case - n_regions, agent)
    # A record without a value is the lowest value.
    return -math.inf if math.isnan(value) else value


@compiled
def _find_next_case(stream: Stream, first_draw: int, n_cases: int, previous: int) -> int:
    """Return the case after `previous` in the random order of the cases.

    The draws from `first_draw` on sort the cases. `previous` is -1 to find the first case. The
    result is -1 after the last case.
    """
    next_case = -1
    for case in range(n_cases):
        key = draw(stream, first_draw + case)
        is_later = previous < 0
        if previous >= 0:
            previous_key = draw(stream, first_draw + previous)
            is_later = bool(key > previous_key or (key == previous_key and case > previous))
        if is_later and (next_case < 0 or key < draw(stream, first_draw + next_case)):
            next_case = case
    return next_case


@compiled
def _keep_best(lifetimes: Lifetimes, case: int, candidates: Order, count: int) -> int:
    """Move the best of the first `count` candidates to the front. Return the number of the best."""
    best = -math.inf
    for index in range(count):
        best = max(best, _read_case(lifetimes, case, candidates[index]))
    n_best = 0
    for index in range(count):
        agent = candidates[index]
        if _read_case(lifetimes, case, agent) == best:
            candidates[n_best] = agent
            n_best += 1
    return n_best


class Lexicase(Selection, name="lexicase"):
    """The best agent on cases in random order. A case is a food region or a record.

    The cases of each parent have a random order. All agents are candidates. In each case, the
    candidates with the highest value remain: most items eaten in the region, or the highest record.
    A random one of the last candidates is the parent. Fitness has no effect. A record must be
    higher for a better agent.

    References
    ----------
    Spector 2012; Helmuth, Spector and Matheson 2015.
    """

    def check(self, experiment: BaseExperiment) -> None:
        if experiment.model != "miniworld" and not experiment.model_part.records:
            raise ValueError(
                f"evolution.selection = 'lexicase' needs cases, and the model {experiment.model} "
                "records no variables: choose another selection, such as 'tournament'"
            )

    @staticmethod
    def select(part: Any, generation: Generation) -> None:
        n_cases = generation.lifetimes.eaten.shape[1] + len(generation.lifetimes.records)
        # A draw for each case, and one for the choice between the last candidates.
        n_draws = n_cases + 1
        for child in range(generation.parents.shape[0]):
            for parent in range(2):
                first_draw = (2 * child + parent) * n_draws
                for agent in range(generation.fitness.size):
                    generation.order[agent] = agent
                count = generation.fitness.size
                case = _find_next_case(generation.stream, first_draw, n_cases, -1)
                while case >= 0 and count > 1:
                    count = _keep_best(generation.lifetimes, case, generation.order, count)
                    case = _find_next_case(generation.stream, first_draw, n_cases, case)
                # The last draw chooses between equal candidates.
                index = draw_index(count, draw(generation.stream, first_draw + n_cases))
                generation.parents[child, parent] = generation.order[index]


@compiled
def compute_distance(genome: Genome, first: int, second: int) -> float:
    """Return the root mean square difference between the genes of two agents."""
    n_modules = genome.shape[1]
    n_weights = genome.shape[2]
    total = 0.0
    for module in range(n_modules):
        for weight in range(n_weights):
            difference = np.float64(genome[first, module, weight]) - np.float64(
                genome[second, module, weight]
            )
            total += difference * difference
    return float(square_root(total / (n_modules * n_weights)))


@compiled
def _share(part: Any, distance: float) -> float:
    """Return the sharing function: 1 at distance 0, and 0 from the radius on."""
    if distance >= part.limit:
        return 0.0
    power = 1.0
    for _ in range(part.exponent):
        power *= distance / part.limit
    return 1.0 - power


class FitnessSharing(Selection, name="fitness-sharing"):
    """Roulette on shared fitness: the fitness of an agent, divided by its niche count.

    The niche count is the sum of 1 - (d / radius)^exponent over all agents at a distance d below
    `radius`, the agent included. The distance is the root mean square difference of the genes.
    Groups of similar agents then have children in proportion to the fitness of their members, and
    not to their number. Fitness must not be negative.

    References
    ----------
    Goldberg and Richardson 1987.
    """

    minimum_fitness: ClassVar[float] = 0.0

    radius: float = Field(
        0.5,
        gt=0,
        le=1_000_000,
        description="Distance from which agents share no fitness, in units of a gene.",
    )
    exponent: int = Field(
        1, ge=1, le=10, description="Exponent of the sharing function. 1: it falls linearly."
    )
    # A numeric field is float32 in a hook.
    derived: ClassVar[Mapping[str, Any]] = {"limit": lambda part, experiment: float(part.radius)}

    def check(self, experiment: BaseExperiment) -> None:
        if genome_part(experiment).has_graph_genomes:
            raise ValueError(
                "evolution.selection = 'fitness-sharing' compares genomes gene by gene, and the "
                "genomes are graphs: choose evolution.selection = 'species'"
            )

    @staticmethod
    def select(part: Any, generation: Generation) -> None:
        fitness = generation.fitness
        for agent in range(fitness.size):
            # The agent shares its fitness with itself.
            niche_count = 1.0
            for neighbor in range(fitness.size):
                if neighbor != agent:
                    distance = compute_distance(generation.lifetimes.genome, agent, neighbor)
                    niche_count += _share(part, distance)
            generation.shares[agent] = fitness[agent] / niche_count
        spin(generation.uniforms, generation.shares, generation.parents)
