"""Fitness by behavior: the distance that an agent moves, the times of eating, or the novelty.

In novelty search, the fitness of an agent is the distance from its behavior to known behaviors.
Source: J. Lehman and K. O. Stanley, "Abandoning objectives: evolution through the search for
novelty alone", Evolutionary Computation 19 (2011).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar, Literal

import numpy as np

from baldwinlab.engine.jit import compiled
from baldwinlab.engine.phases import Array, per_agent, per_run
from baldwinlab.engine.simd import ZERO, square_root
from baldwinlab.evolution.rng_key import Fitness as Numbers
from baldwinlab.experiment import BaseExperiment
from baldwinlab.models.miniworld.map import shortest_difference
from baldwinlab.models.miniworld.regions import ENERGY_VALUES, energy_in_life
from baldwinlab.parts import Field, Fitness
from baldwinlab.parts.lifetimes import Lifetimes


def require_world(experiment: BaseExperiment, fitness: str) -> None:
    """Raise ValueError if the model of an experiment is not MiniWorld."""
    if experiment.model != "miniworld":
        raise ValueError(
            f"evolution.fitness = {fitness!r} reads positions and items, and the model "
            f"{experiment.model} has no world: choose another fitness, such as 'energy'"
        )


@compiled
def length(x: np.float32, y: np.float32) -> np.float32:
    """Return the length of a vector."""
    return np.float32(square_root(x * x + y * y))


class Distance(Fitness, name="distance"):
    """Distance that the agent moves, in units of length.

    With `measure = "path"`, it is the length of the path: the sum of the distances of all steps.
    With `measure = "displacement"`, it is the length of the straight line between the ends of the
    path. The map is a torus, and the line is that of the unrolled path: an agent that walks around
    the map has the displacement of the width of the map. The path starts at the position after the
    first step of the lifetime, so the movement of this step does not count. The path of an agent
    that is born during the lifetimes of others starts at its birthplace. The path ends at the
    position after the last step. The cost of learning has no effect.

    References
    ----------
    Sims 1994.
    """

    measure: Literal["path", "displacement"] = Field(
        "path", description="Measure of the distance: the length of the path, or its displacement."
    )
    records: ClassVar[Mapping[str, Array]] = {
        "path_length": per_agent(
            "float32", unit="units of length", help="length of the path of the agent"
        ),
        "displacement_x": per_agent(
            "float32", unit="units of length", help="sum of the movements to the right"
        ),
        "displacement_y": per_agent(
            "float32", unit="units of length", help="sum of the movements downward"
        ),
        "recorded_steps": per_agent("int32", unit="steps", help="number of recorded positions"),
    }
    arrays: ClassVar[Mapping[str, Array]] = {"last_x": per_agent(1), "last_y": per_agent(1)}
    derived: ClassVar[Mapping[str, Any]] = {
        "is_path": lambda part, experiment: part.measure == "path"
    }

    def check(self, experiment: BaseExperiment) -> None:
        require_world(experiment, "distance")

    @staticmethod
    def end_step(part: Any, model: Any, state: Any, world: int, step: int) -> None:
        for agent in range(model.agents):
            lane = world * model.agents + agent
            x = state.positions[0, lane]
            y = state.positions[1, lane]
            # A dead agent has a negative x.
            if x >= ZERO:
                if part.recorded_steps[0, lane] > 0:
                    dx = shortest_difference(x - part.last_x[0, lane], model.width)
                    dy = shortest_difference(y - part.last_y[0, lane], model.height)
                    part.path_length[0, lane] += length(dx, dy)
                    part.displacement_x[0, lane] += dx
                    part.displacement_y[0, lane] += dy
                part.last_x[0, lane] = x
                part.last_y[0, lane] = y
                part.recorded_steps[0, lane] += 1

    @staticmethod
    def evaluate(part: Any, lifetimes: Lifetimes, fitness: Numbers) -> None:
        records = lifetimes.records
        for agent in range(fitness.size):
            if part.is_path:
                fitness[agent] = records.path_length[agent]
            else:
                fitness[agent] = length(
                    records.displacement_x[agent], records.displacement_y[agent]
                )


class EarlyFood(Fitness, name="early-food"):
    """Energy of the eaten items, weighted by the time that remains when the agent eats them.

    An item that an agent eats in step t of T steps has the weight (T - t) / T, with t from 0. The
    weighted energy equals the mean over the steps of the energy gained so far. The cost of learning
    is subtracted, and a negative value becomes 0.

    References
    ----------
    Hinton and Nowlan 1987, in which fitness is proportional to the remaining trials.
    """

    records: ClassVar[Mapping[str, Array]] = {
        "early_energy": per_agent(
            "float32", unit="energy", help="energy of eaten items, weighted by the remaining time"
        )
    }
    derived: ClassVar[Mapping[str, Any]] = {
        **ENERGY_VALUES,
        "step_weight": lambda part, experiment: np.float32(1 / experiment.lifetime.steps),
    }

    def check(self, experiment: BaseExperiment) -> None:
        require_world(experiment, "early-food")

    @staticmethod
    def end_step(part: Any, model: Any, state: Any, world: int, step: int) -> None:
        for agent in range(model.agents):
            lane = world * model.agents + agent
            part.early_energy[0, lane] += energy_in_life(part, state, lane) * part.step_weight

    @staticmethod
    def evaluate(part: Any, lifetimes: Lifetimes, fitness: Numbers) -> None:
        for agent in range(fitness.size):
            weighted_energy = np.float64(lifetimes.records.early_energy[agent])
            fitness[agent] = max(0.0, weighted_energy - lifetimes.cost[agent])


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
    """Return the distance to position `number`: positions of all agents, then of the archive."""
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
    """Return the mean distance to the k nearest other positions, or 0 if there are none."""
    n_neighbors = 0
    total = 0.0
    last_distance = -1.0
    last_number = -1
    while n_neighbors < part.neighbors:
        # The next neighbor follows the previous neighbor in the order of distance, then number.
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
        # No position is left, or a position is NaN.
        if nearest_number < 0:
            break
        n_neighbors += 1
        total += nearest
        last_distance = nearest
        last_number = nearest_number
    return total / n_neighbors if n_neighbors > 0 else 0.0


class Novelty(Fitness, name="novelty"):
    """Novelty of the final position: the mean distance to the k nearest known positions.

    The known positions are the final positions of the other agents, and the archive.
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
