"""Landscapes of fitness on a line of positions, without and with plasticity."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from baldwinlab.models import kit

Fitness = kit.Numbers


@lru_cache(maxsize=64)
def make_landscape(seed: int, run: int, length: int, slope: float, roughness: float) -> Fitness:
    """Return the fitness of all positions of a run, without plasticity.

    `slope`: mean relative increase of fitness per position. The first position has 1. The array is
    read-only.
    """
    draws = kit.draw_environment(seed, run, (length, 1))[:, 0, 0]
    factors = 1 + slope + roughness * (2 * draws - 1)
    factors[0] = 1.0
    fitness: Fitness = factors.cumprod()
    # The array is cached.
    fitness.flags.writeable = False
    return fitness


def climb(fitness: Fitness, steps: int) -> kit.Integers:
    """Return the position that each position reaches in `steps` steps to the fitter neighbor."""
    padded = np.concatenate(([0.0], fitness, [0.0]))
    positions = np.arange(fitness.size)
    is_right_fitter = padded[2:] >= padded[:-2]
    neighbors = np.where(is_right_fitter, positions + 1, positions - 1)
    is_peak = padded[neighbors + 1] <= fitness
    next_positions = np.where(is_peak, positions, neighbors)
    learned = positions
    for _ in range(steps):
        learned = next_positions[learned]
    return learned


def average_neighborhood(fitness: Fitness, steps: int) -> Fitness:
    """Return the mean fitness of all positions up to `steps` away, for each position.

    Positions beyond the first and the last have the fitness of the first and the last.
    """
    offsets = np.arange(-steps, steps + 1)
    neighborhoods = np.arange(fitness.size)[:, None] + offsets
    mean: Fitness = fitness[np.clip(neighborhoods, 0, fitness.size - 1)].mean(axis=1)
    return mean
