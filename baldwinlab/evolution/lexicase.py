"""Lexicase selection, which compares agents on several cases in random order.

References
----------
.. [1] L. Spector, "Assessment of problem modality by differential performance of lexicase selection
   in genetic programming", GECCO Companion (2012).
.. [2] T. Helmuth, L. Spector and J. Matheson, "Solving uncompromising problems with lexicase
   selection", IEEE Transactions on Evolutionary Computation 19 (2015).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from baldwinlab.engine.jit import compiled, register
from baldwinlab.engine.rng import Stream, draw
from baldwinlab.evolution.proportional_selection import draw_index
from baldwinlab.evolution.selection import Order
from baldwinlab.experiment import BaseExperiment
from baldwinlab.parts import Generation, Selection
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
