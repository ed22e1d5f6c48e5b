"""Expected time of an adaptive walk on a line of positions: a birth-death chain.

References
----------
E. Borenstein, I. Meilijson and E. Ruppin, "The effect of phenotypic plasticity on evolution in
multipeaked fitness landscapes", Journal of Evolutionary Biology 19 (2006).
"""

from __future__ import annotations

import numpy as np

from baldwinlab.analysis.theory.adaptive_walk import Floats, compute_fixation_probabilities


def compute_step_probabilities(fitness: Floats, members: int) -> tuple[Floats, Floats]:
    """Return the probabilities that a population moves to the right and to the left.

    The mutant of a generation is at the right or at the left position with probability 1/2. A
    mutant outside the positions has no fitness.
    """
    padded = np.concatenate(([0.0], fitness, [0.0]))
    right = compute_fixation_probabilities(padded[2:], fitness, members) / 2
    left = compute_fixation_probabilities(padded[:-2], fitness, members) / 2
    return right, left


def expect_walk_time(right: Floats, left: Floats, target: int) -> float:
    """Return the expected number of generations from position 0 to `target`.

    The time h(i) from position i to i + 1 is (1 + left(i) h(i - 1)) / right(i): the population
    waits, and must return from each move to the left. The sum of h(0) to h(target - 1) is
    the double sum of Borenstein and others.

    The result is infinite if a move to the right has the probability 0.
    """
    total = step_time = 0.0
    for position in range(target):
        if right[position] == 0:
            return float("inf")
        returns = left[position] * step_time if position > 0 else 0.0
        step_time = (1 + returns) / right[position]
        total += step_time
    return float(total)
