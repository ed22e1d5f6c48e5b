"""Plain Python, one number after another in float64, for oracles: it knows nothing of the engine, and nothing is fast.

A module is [layer][from][to]; with biases, a layer has one more row, as if from a unit that is always 1.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np

from baldwinlab.engine import rng

Module = list[list[list[float]]]


@dataclass
class Item:
    x: float
    y: float
    kind: str


@dataclass
class Agent:
    """What an oracle gets to know of an agent."""

    x: float
    y: float
    heading: float  # degrees, clockwise from +x
    inputs: list[float]
    outputs: list[float]
    hidden: list[float]  # what the first hidden layer was a step before
    action: int
    eaten_in_life: int  # items, before this step
    gained_in_life: float  # energy, before this step
    rate: float
    action_module: Module
    reinforcement_module: Module | None
    others: list[Item] = field(
        default_factory=list
    )  # where the other agents of its world are, of the kind "agent"
    number: int = 0  # of the agent in its world
    step: int = 0
    own: dict[str, Any] = field(
        default_factory=dict
    )  # the part's arrays as `init_agent` made them, and what the oracle makes of them


@dataclass(frozen=True)
class Naive:
    """What oracles may use, of the world at hand."""

    sizes: tuple[int, ...]
    biases: bool
    width: float
    height: float
    visual_radius: float
    seed: int  # of the run, which is run 0; the generation is 0
    kinds: tuple[str, ...] = ()  # of items, by their numbers

    def drawn(self, agent: Any, purpose: int) -> list[float]:
        """The four numbers in [0, 1) that an agent draws for a purpose in its step, as `philox` gives them."""
        with np.errstate(over="ignore"):  # its words wrap around, as they should
            return [
                float(rng.unit(word))
                for word in rng.philox(agent.step, agent.number, 0, purpose, self.seed, 0)
            ]

    def module(self, weights: Sequence[float]) -> Module:
        """A module from its weights in the order in which genomes hold them."""
        left = iter(weights)
        return [
            [[float(next(left)) for _ in range(outputs)] for _ in range(inputs + self.biases)]
            for inputs, outputs in pairwise(self.sizes)
        ]

    def weights(self, module: Module) -> list[float]:
        """The weights of a module, one after another."""
        return [weight for layer in module for row in layer for weight in row]

    def units(self, module: Module, inputs: Sequence[float]) -> list[list[float]]:
        """What all units answer, layer by layer, from the inputs on."""
        layers = [[float(each) for each in inputs]]
        for layer in module:
            sources = layers[-1] + [1.0] * self.biases
            sums = [
                sum(source * row[unit] for source, row in zip(sources, layer, strict=True))
                for unit in range(len(layer[0]))
            ]
            layers.append([1 / (1 + math.exp(-each)) for each in sums])
        return layers

    def think(self, module: Module, inputs: Sequence[float]) -> list[float]:
        """What the outputs answer."""
        return self.units(module, inputs)[-1]

    def backpropagate(
        self, module: Module, inputs: Sequence[float], target: Sequence[float], rate: float
    ) -> None:
        """One step of a module towards `target`, down the gradient of half the squared error."""
        layers = self.units(module, inputs)
        errors = [(y - wanted) * y * (1 - y) for y, wanted in zip(layers[-1], target, strict=True)]
        for depth in range(len(module) - 1, -1, -1):
            sources, layer = layers[depth] + [1.0] * self.biases, module[depth]
            below = [
                sum(w * error for w, error in zip(row, errors, strict=True)) for row in layer
            ]  # of before the step
            for source, row in zip(sources, layer, strict=True):
                for unit, error in enumerate(errors):
                    row[unit] -= rate * error * source
            errors = [each * a * (1 - a) for each, a in zip(below, layers[depth], strict=False)]

    def way(self, agent: Any, item: Any) -> tuple[float, float]:
        """From an agent to an item, over the edges of the map where that is nearer."""
        return _shortest(item.x - agent.x, self.width), _shortest(item.y - agent.y, self.height)

    def advance(self, agent: Any, way: float) -> None:
        """Let an agent go straight on."""
        angle = math.radians(agent.heading)
        agent.x, agent.y = (
            (agent.x + way * math.cos(angle)) % self.width,
            (agent.y + way * math.sin(angle)) % self.height,
        )

    def distance(self, agent: Any, item: Any) -> float:
        dx, dy = self.way(agent, item)
        return math.hypot(dx, dy)

    def bearing(self, agent: Any, item: Any) -> float:
        """Where an item is, degrees clockwise from the agent's heading, in [0, 360)."""
        dx, dy = self.way(agent, item)
        angle: float = (math.degrees(math.atan2(dy, dx)) - agent.heading) % 360
        return angle

    def seen(self, agent: Any, items: Sequence[Any]) -> list[bool]:
        """Whether any of the items is in sight at the left, in front, or at the right."""
        angles = [
            self.bearing(agent, item)
            for item in items
            if self.distance(agent, item) <= self.visual_radius
        ]
        return [
            any(315 < angle < 345 for angle in angles),
            any(angle <= 15 or angle >= 345 for angle in angles),
            any(15 < angle < 45 for angle in angles),
        ]


def _shortest(difference: float, span: float) -> float:
    forwards = difference % span
    return forwards if forwards <= span / 2 else forwards - span
