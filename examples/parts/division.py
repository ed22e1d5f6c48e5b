"""Agents that die without energy and divide with enough energy, in a population of changing size.

    baldwinlab check examples/parts/division.py

`population.size` is the largest number of agents. An agent starts with an energy of 1.
"""

import numpy as np

from baldwinlab.parts import (
    ENERGY_VALUES,
    Field,
    WorldFeature,
    bear,
    die,
    energy_in_life,
    per_agent,
)

ZERO, HALF, ONE = np.float32(0), np.float32(0.5), np.float32(1)


class Division(WorldFeature, name="division"):
    """Agents pay for each step, die without energy, and divide at a threshold."""

    cost: float = Field(0.005, ge=0, le=1000, description="Cost of a step, in energy.")
    threshold: float = Field(3.0, gt=0, le=1e6, description="Energy of an agent that divides.")
    allows_births = True
    allows_deaths = True
    arrays = {"reserve": per_agent(), "gained": per_agent()}
    derived = ENERGY_VALUES

    @staticmethod
    def init_world(part, model, state, world):
        for lane in range(world * model.agents, (world + 1) * model.agents):
            part.reserve[0, lane] = ONE
            part.gained[0, lane] = ZERO

    @staticmethod
    def end_step(part, model, state, world, step):
        for agent in range(model.agents):
            lane = world * model.agents + agent
            if state.alive[0, lane]:
                gained = energy_in_life(part, state, lane)
                part.reserve[0, lane] += gained - part.gained[0, lane] - part.cost
                part.gained[0, lane] = gained
                if part.reserve[0, lane] <= ZERO:
                    die(model, state, world, agent)
                elif part.reserve[0, lane] >= part.threshold:
                    child = bear(model, state, world, agent, agent)
                    if child >= 0:
                        child_lane = world * model.agents + child
                        part.reserve[0, lane] *= HALF
                        part.reserve[0, child_lane] = part.reserve[0, lane]
                        part.gained[0, child_lane] = energy_in_life(part, state, child_lane)
