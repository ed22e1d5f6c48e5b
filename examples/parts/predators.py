"""Predators that follow a fixed rule: each goes to the nearest agent, and kills by contact.

    baldwinlab check examples/parts/predators.py

`docs/how-to/predators-and-prey.md` describes predators that evolve.
"""

import numpy as np

from baldwinlab.parts import (
    Field,
    WorldFeature,
    die,
    draw_unit,
    per_world,
    purpose,
    shortest_difference,
    square_root,
    wrap_position,
)

BIRTHPLACE = purpose("predators: birthplace")
PREDATORS = 3


class Predators(WorldFeature, name="predators"):
    """Three predators, which go to the nearest agent. An agent that they touch dies."""

    speed: float = Field(0.5, gt=0, le=10, description="Speed, in units of length per step.")
    arrays = {"predators": per_world(PREDATORS, 2)}
    allows_deaths = True

    @staticmethod
    def init_world(part, model, state, world):
        for predator in range(PREDATORS):
            for axis in range(2):
                side = model.width if axis == 0 else model.height
                share = draw_unit(state, world, BIRTHPLACE, predator, axis)
                part.predators[world, predator, axis] = share * side

    @staticmethod
    def end_step(part, model, state, world, step):
        for predator in range(PREDATORS):
            x = part.predators[world, predator, 0]
            y = part.predators[world, predator, 1]
            nearest = np.float32(np.inf)
            for agent in range(model.agents):
                lane = world * model.agents + agent
                dx = shortest_difference(state.positions[0, lane] - x, model.width)
                dy = shortest_difference(state.positions[1, lane] - y, model.height)
                distance = np.float32(square_root(dx * dx + dy * dy))
                if state.alive[0, lane] > 0 and distance < nearest:
                    nearest = distance
                    share = min(part.speed / max(distance, part.speed), np.float32(1))
                    part.predators[world, predator, 0] = wrap_position(x + share * dx, model.width)
                    part.predators[world, predator, 1] = wrap_position(y + share * dy, model.height)
                    if distance < model.reach:
                        die(model, state, world, agent)
