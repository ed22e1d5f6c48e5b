"""Fitness that depends on the behavior of an agent: its distance, or the time at which it eats."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, Literal

import numpy as np

from baldwinlab.engine.jit import compiled
from baldwinlab.engine.phases import Array, per_agent
from baldwinlab.engine.simd import ZERO, square_root
from baldwinlab.evolution.rng_key import Fitness as Numbers
from baldwinlab.experiment import BaseExperiment
from baldwinlab.models.miniworld.energy import ENERGY_VALUES, energy_in_life
from baldwinlab.models.miniworld.map import shortest_difference
from baldwinlab.parts import Field, Fitness
from baldwinlab.parts.lifetimes import Lifetimes


def require_world(experiment: BaseExperiment, fitness: str) -> None:
    """Raise ValueError if the model of an experiment has no world."""
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
