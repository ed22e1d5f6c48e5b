"""Reference implementation in plain Python and float64, for oracles. It does not use the engine.

A module is a nested list [layer][source unit][target unit].
With biases, each layer has one more row: the weights of a unit that is always 1.
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
    """An item, or another agent, as an oracle gets it.

    Attributes
    ----------
    x, y : float
        Position, in units of length. A negative x means that the item is not on the map.
    kind : str
        Kind of the item, for example "food", or "agent".
    """

    x: float
    y: float
    kind: str


@dataclass
class Agent:
    """An agent, as an oracle gets it.

    Attributes
    ----------
    x, y : float
        Position, in units of length.
    heading : float
        Heading, in degrees clockwise from +x.
    inputs : list of float
        Inputs of the network in this step.
    outputs : list of float
        Outputs of the action module in this step, before learning.
    hidden : list of float
        Activations of the first hidden layer in the previous step.
    action : int
        Number of the action of this step.
    eaten_in_life : int
        Number of items eaten before this step.
    gained_in_life : float
        Energy gained before this step.
    rate : float
        Learning rate, per step.
    action_module : Module
        Weights of the action module before learning.
    reinforcement_module : Module or None
        Weights of the reinforcement module. None if the genome has none.
    others : list of Item
        Positions of the other agents of the world, with the kind "agent".
    number : int
        Number of the agent in its world.
    step : int
        Number of the step in the lifetime.
    arrays : dict
        Arrays of the part as `init_agent` set them.
        The oracle may store data for later steps here.
    """

    x: float
    y: float
    heading: float
    inputs: list[float]
    outputs: list[float]
    hidden: list[float]
    action: int
    eaten_in_life: int
    gained_in_life: float
    rate: float
    action_module: Module
    reinforcement_module: Module | None
    others: list[Item] = field(default_factory=list)
    number: int = 0
    step: int = 0
    arrays: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Naive:
    """The experiment, and functions in plain Python, as an oracle gets them.

    Attributes
    ----------
    sizes : tuple of int
        Number of units in each layer, from the inputs to the outputs.
    biases : bool
        Whether the layers have biases.
    width, height : float
        Size of the map, in units of length.
    visual_radius : float
        Visual range, in units of length.
    seed : int
        Seed of the random numbers. The run and the generation are 0.
    kinds : tuple of str
        Kinds of items, by number.
    """

    sizes: tuple[int, ...]
    biases: bool
    width: float
    height: float
    visual_radius: float
    seed: int
    kinds: tuple[str, ...] = ()

    def drawn(self, agent: Any, purpose: int) -> list[float]:
        """Return the four random numbers of an agent in its step.

        Parameters
        ----------
        agent : Agent
            The agent.
        purpose : int
            Purpose of the random numbers, for example `LIFE`.

        Returns
        -------
        list of float
            Four numbers in [0, 1).
        """
        # The words of the generator overflow by design.
        with np.errstate(over="ignore"):
            return [
                float(rng.unit(word))
                for word in rng.philox(agent.step, agent.number, 0, purpose, self.seed, 0)
            ]

    def module(self, weights: Sequence[float]) -> Module:
        """Return a module from its weights in the order of the genome."""
        remaining = iter(weights)
        return [
            [[float(next(remaining)) for _ in range(outputs)] for _ in range(inputs + self.biases)]
            for inputs, outputs in pairwise(self.sizes)
        ]

    def weights(self, module: Module) -> list[float]:
        """Return the weights of a module in the order of the genome."""
        return [weight for layer in module for row in layer for weight in row]

    def units(self, module: Module, inputs: Sequence[float]) -> list[list[float]]:
        """Return the activations of all units, layer by layer, from the inputs on."""
        layers = [[float(value) for value in inputs]]
        for layer in module:
            sources = layers[-1] + [1.0] * self.biases
            sums = [
                sum(source * row[unit] for source, row in zip(sources, layer, strict=True))
                for unit in range(len(layer[0]))
            ]
            layers.append([1 / (1 + math.exp(-total)) for total in sums])
        return layers

    def think(self, module: Module, inputs: Sequence[float]) -> list[float]:
        """Return the outputs of a module for the inputs."""
        return self.units(module, inputs)[-1]

    def backpropagate(
        self, module: Module, inputs: Sequence[float], target: Sequence[float], rate: float
    ) -> None:
        """Change the weights of a module by one step of backpropagation.

        Parameters
        ----------
        module : Module
            Weights, which are changed in place.
        inputs : sequence of float
            Inputs of the network.
        target : sequence of float
            Desired outputs.
        rate : float
            Learning rate. The step follows the gradient of half the squared error.
        """
        layers = self.units(module, inputs)
        errors = [
            (output - desired) * output * (1 - output)
            for output, desired in zip(layers[-1], target, strict=True)
        ]
        for depth in range(len(module) - 1, -1, -1):
            sources = layers[depth] + [1.0] * self.biases
            layer = module[depth]
            # The errors of the layer below follow from the weights before the change.
            below = [sum(w * error for w, error in zip(row, errors, strict=True)) for row in layer]
            for source, row in zip(sources, layer, strict=True):
                for unit, error in enumerate(errors):
                    row[unit] -= rate * error * source
            errors = [
                error * activation * (1 - activation)
                for error, activation in zip(below, layers[depth], strict=False)
            ]

    def way(self, agent: Any, item: Any) -> tuple[float, float]:
        """Return the shortest displacement (dx, dy) from an agent to an item on the torus."""
        return _shortest(item.x - agent.x, self.width), _shortest(item.y - agent.y, self.height)

    def advance(self, agent: Any, way: float) -> None:
        """Move an agent by the distance `way` in the direction of its heading."""
        angle = math.radians(agent.heading)
        agent.x = (agent.x + way * math.cos(angle)) % self.width
        agent.y = (agent.y + way * math.sin(angle)) % self.height

    def distance(self, agent: Any, item: Any) -> float:
        """Return the distance from an agent to an item, in units of length."""
        dx, dy = self.way(agent, item)
        return math.hypot(dx, dy)

    def bearing(self, agent: Any, item: Any) -> float:
        """Return the direction of an item, in degrees clockwise from the heading, in [0, 360)."""
        dx, dy = self.way(agent, item)
        angle: float = (math.degrees(math.atan2(dy, dx)) - agent.heading) % 360
        return angle

    def seen(self, agent: Any, items: Sequence[Any]) -> list[bool]:
        """Return whether an item is in the left, front and right sector of the visual range."""
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
