"""Novelty search: the fitness of an agent is the distance between its behavior and known behaviors.

References
----------
.. [1] J. Lehman and K. O. Stanley, "Abandoning objectives: evolution through the search for novelty
   alone", Evolutionary Computation 19 (2011).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from baldwinlab.engine.jit import compiled
from baldwinlab.engine.phases import Array, per_run
from baldwinlab.engine.simd import square_root
from baldwinlab.evolution.rng_key import Fitness as Numbers
from baldwinlab.experiment import BaseExperiment
from baldwinlab.models.miniworld.behavior_fitness import require_world
from baldwinlab.parts import Field, Fitness
from baldwinlab.parts.lifetimes import Lifetimes


@compiled
def _wrap(difference: float, span: float) -> float:
    """Return the shortest distance of two coordinates on the torus."""
    distance = abs(difference)
    return min(distance, span - distance)


@compiled
def _measure_distance(part: Any, x: float, y: float, other_x: float, other_y: float) -> float:
    dx = _wrap(x - other_x, part.width)
    dy = _wrap(y - other_y, part.height)
    return square_root(dx * dx + dy * dy)  # type: ignore[no-any-return]


@compiled
def _distance_to_behavior(part: Any, lifetimes: Lifetimes, agent: int, number: int) -> float:
    """Return the distance of an agent to a behavior: those of the agents, then the archive."""
    x = np.float64(lifetimes.position[agent, 0])
    y = np.float64(lifetimes.position[agent, 1])
    n_agents = lifetimes.energy.size
    if number < n_agents:
        other_x = np.float64(lifetimes.position[number, 0])
        other_y = np.float64(lifetimes.position[number, 1])
        return _measure_distance(part, x, y, other_x, other_y)
    entry = number - n_agents
    return _measure_distance(part, x, y, part.archive[0, entry], part.archive[1, entry])


@compiled
def _compute_novelty(part: Any, lifetimes: Lifetimes, agent: int, n_behaviors: int) -> float:
    """Return the mean distance to the k nearest behaviors without the agent itself."""
    n_neighbors = 0
    total = 0.0
    last_distance = -1.0
    last_number = -1
    while n_neighbors < part.neighbors:
        # The next neighbor is the first after the last one, by distance and then by number.
        nearest = math.inf
        nearest_number = -1
        for number in range(n_behaviors):
            if number != agent:
                distance = _distance_to_behavior(part, lifetimes, agent, number)
                is_later = distance > last_distance or (
                    distance == last_distance and number > last_number
                )
                if is_later and distance < nearest:
                    nearest = distance
                    nearest_number = number
        # No behavior is left, or the agent has no position.
        if nearest_number < 0:
            break
        n_neighbors += 1
        total += nearest
        last_distance = nearest
        last_number = nearest_number
    return total / n_neighbors if n_neighbors > 0 else 0.0


class Novelty(Fitness, name="novelty"):
    """Novelty of the final position: the mean distance to the k nearest known positions.

    The known positions are those of the other agents of the generation and those in the archive.
    Distances are the shortest on the torus. After each generation, an agent whose novelty is above
    `archive_threshold` adds its position to the archive. If the archive is full, the new position
    replaces the oldest. Energy and the cost of learning have no effect.

    References
    ----------
    Lehman and Stanley 2011.
    """

    neighbors: int = Field(15, ge=1, le=100, description="Number k of nearest positions.")
    archive_threshold: float = Field(
        6.0,
        ge=0,
        le=1_000_000,
        description="Novelty above which a position joins the archive, in units of length.",
    )
    archive_size: int = Field(
        1000, ge=1, le=100_000, description="Largest number of positions in the archive."
    )
    arrays: ClassVar[Mapping[str, Array]] = {
        "archive": per_run(2, "archive_size"),
        # Number of all positions that have joined the archive.
        "n_archived": per_run(dtype="int32"),
    }
    derived: ClassVar[Mapping[str, Any]] = {
        "threshold": lambda part, experiment: float(part.archive_threshold),
        "width": lambda part, experiment: float(experiment.world.width),
        "height": lambda part, experiment: float(experiment.world.height),
    }

    def check(self, experiment: BaseExperiment) -> None:
        require_world(experiment, "novelty")

    @staticmethod
    def evaluate(part: Any, lifetimes: Lifetimes, fitness: Numbers) -> None:
        n_entries = min(part.n_archived[0], part.archive_size)
        for agent in range(fitness.size):
            fitness[agent] = _compute_novelty(part, lifetimes, agent, fitness.size + n_entries)
        for agent in range(fitness.size):
            if fitness[agent] > part.threshold:
                entry = part.n_archived[0] % part.archive_size
                part.archive[0, entry] = lifetimes.position[agent, 0]
                part.archive[1, entry] = lifetimes.position[agent, 1]
                part.n_archived[0] += 1
