"""Agents, items and modules in plain Python: the arguments of oracles.

A module is a nested list [layer][source unit][target unit].
With biases, each layer has one more row: the weights of a unit that is always 1.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

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
        Number of the action of this step.
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
        Number of the agent in its world.
    step : int
        Number of the step in the lifetime. An agent that is born later has a later first step.
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
