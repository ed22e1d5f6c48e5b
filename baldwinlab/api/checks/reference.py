"""Arguments of oracles: agents and items, and reference functions in plain Python and float64.

The functions do not use the engine, except its random numbers. A module is a nested list
[layer][source unit][target unit]. With biases, each layer has one more row at the end: the weights
of a unit that is always 1.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np

from baldwinlab.engine import rng

Module = list[list[list[float]]]
"""Weights, [layer][source unit][target unit]."""


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
        Index of the action of this step.
    eaten_in_life : int
        Number of items eaten since birth, before this step.
    gained_in_life : float
        Energy gained since birth, before this step.
    rate : float
        Learning rate, per step.
    action_module : Module
        Weights of the action module before learning.
    reinforcement_module : Module or None
        Weights of the reinforcement module. None if the genome has none.
    other_agents : list of Item
        Positions of the other agents of the world, with the kind "agent".
    number : int
        Index of the agent in the world.
    step : int
        Index of the step in the lifetime. An agent that is born later has a later first step.
    arrays : dict
        Arrays of the part as `init_agent` set them at birth.
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
    other_agents: list[Item] = field(default_factory=list)
    number: int = 0
    step: int = 0
    arrays: dict[str, Any] = field(default_factory=dict)

    def __getattr__(self, name: str) -> Any:
        """Raise AttributeError with the names of the attributes, because `name` is none."""
        attributes = ", ".join(sorted(self.__dataclass_fields__))
        raise AttributeError(
            f"an agent of an oracle has no attribute {name!r}; it has {attributes}"
        )


@dataclass(frozen=True)
class Naive:
    """Argument of an oracle: the experiment, and functions in plain Python.

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
        Kinds of items. The index in the tuple is the number of a kind in the engine.
    """

    sizes: tuple[int, ...]
    biases: bool
    width: float
    height: float
    visual_radius: float
    seed: int
    kinds: tuple[str, ...] = ()

    def random_numbers(self, agent: Any, purpose: int) -> list[float]:
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
        # The integers of the generator overflow by design.
        with np.errstate(over="ignore"):
            return [
                float(rng.unit(word))
                for word in rng.philox(agent.step, agent.number, 0, purpose, self.seed, 0)
            ]

    def module(self, weights: Sequence[float]) -> Module:
        """Return a module from its weights.

        Parameters
        ----------
        weights : sequence of float
            Weights in the order of the genome.

        Returns
        -------
        Module
            Weights, [layer][source unit][target unit].
        """
        remaining = map(float, weights)
        module = []
        for inputs, outputs in pairwise(self.sizes):
            rows = inputs + self.biases
            module.append([[next(remaining) for _ in range(outputs)] for _ in range(rows)])
        return module

    def weights(self, module: Module) -> list[float]:
        """Return the weights of a module.

        Parameters
        ----------
        module : Module
            Weights, [layer][source unit][target unit].

        Returns
        -------
        list of float
            Weights in the order of the genome.
        """
        return [weight for layer in module for row in layer for weight in row]

    def units(self, module: Module, inputs: Sequence[float]) -> list[list[float]]:
        """Return the activations of all units.

        Parameters
        ----------
        module : Module
            Weights, [layer][source unit][target unit].
        inputs : sequence of float
            Inputs of the network.

        Returns
        -------
        list of list of float
            Activations, [layer][unit]. The first layer has the inputs.
        """
        layers = [[float(value) for value in inputs]]
        for layer in module:
            # `biases` is False (0) or True (1): one more unit with the value 1.
            sources = layers[-1] + [1.0] * self.biases
            sums = [
                sum(source * row[unit] for source, row in zip(sources, layer, strict=True))
                for unit in range(len(layer[0]))
            ]
            layers.append([1 / (1 + math.exp(-total)) for total in sums])
        return layers

    def synapses(self, agent: Any) -> Iterator[tuple[list[float], int, float, float]]:
        """Yield every weight of the action module of an agent, with its activations.

        Parameters
        ----------
        agent : Agent
            The agent. Its network is feed-forward.

        Yields
        ------
        row : list of float
            Weights of a source unit. `row[unit]` is the weight; an oracle assigns to it.
        unit : int
            Index of the target unit in the next layer.
        x, y : float
            Activations of the source unit and of the target unit.
        """
        units = self.units(agent.action_module, agent.inputs)
        for layer, sources, targets in zip(agent.action_module, units, units[1:], strict=False):
            for x, row in zip(sources + [1.0] * self.biases, layer, strict=True):
                for unit, y in enumerate(targets):
                    yield row, unit, x, y

    def think(self, module: Module, inputs: Sequence[float]) -> list[float]:
        """Return the outputs of a module.

        Parameters
        ----------
        module : Module
            Weights, [layer][source unit][target unit].
        inputs : sequence of float
            Inputs of the network.

        Returns
        -------
        list of float
            Activations of the output units.
        """
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
        for depth in reversed(range(len(module))):
            sources = layers[depth] + [1.0] * self.biases
            layer = module[depth]
            # The errors of the previous layer follow from the weights before the change.
            source_errors = [
                sum(weight * error for weight, error in zip(row, errors, strict=True))
                for row in layer
            ]
            for source, row in zip(sources, layer, strict=True):
                for unit, error in enumerate(errors):
                    row[unit] -= rate * error * source
            errors = [
                error * activation * (1 - activation)
                # `strict=False` drops the last error, which is that of the bias.
                for error, activation in zip(source_errors, layers[depth], strict=False)
            ]

    def displacement(self, agent: Any, item: Any) -> tuple[float, float]:
        """Return the shortest displacement from an agent to an item on the torus.

        Parameters
        ----------
        agent : Agent
            The agent.
        item : Item or Agent
            The item.

        Returns
        -------
        tuple of float
            The displacement (dx, dy), in units of length.
        """
        return _shortest(item.x - agent.x, self.width), _shortest(item.y - agent.y, self.height)

    def advance(self, agent: Any, distance: float) -> None:
        """Move an agent in the direction of its heading.

        Parameters
        ----------
        agent : Agent
            The agent, which is changed.
        distance : float
            The distance, in units of length.
        """
        angle = math.radians(agent.heading)
        agent.x = (agent.x + distance * math.cos(angle)) % self.width
        agent.y = (agent.y + distance * math.sin(angle)) % self.height

    def distance(self, agent: Any, item: Any) -> float:
        """Return the distance from an agent to an item.

        Parameters
        ----------
        agent : Agent
            The agent.
        item : Item or Agent
            The item.

        Returns
        -------
        float
            The distance, in units of length.
        """
        dx, dy = self.displacement(agent, item)
        return math.hypot(dx, dy)

    def bearing(self, agent: Any, item: Any) -> float:
        """Return the direction of an item, relative to the heading.

        Parameters
        ----------
        agent : Agent
            The agent.
        item : Item or Agent
            The item.

        Returns
        -------
        float
            The angle, in degrees clockwise from the heading, in [0, 360).
        """
        dx, dy = self.displacement(agent, item)
        angle: float = (math.degrees(math.atan2(dy, dx)) - agent.heading) % 360
        return angle

    def visible_sectors(self, agent: Any, items: Sequence[Any]) -> list[bool]:
        """Return whether each sector of the visual range contains an item.

        Parameters
        ----------
        agent : Agent
            The agent.
        items : sequence of Item
            The items.

        Returns
        -------
        list of bool
            Results of the left, front and right sector.
        """
        # Each sector has 30 degrees. The front sector includes its edges, 15 and 345 degrees.
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
