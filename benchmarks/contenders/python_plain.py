"""The standard variant in plain Python with the standard library: one world, agent by agent.

Source: docs/explanation/model.md. It is faster than the oracle of the tests, which verifies it:
bearings are compared as slopes, agents far from food do not compute bearings,
and networks that do not learn are tables of the eight possible inputs.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from random import Random
from typing import Any

from benchmarks.setting import Genomes, Setting, Simulate

TAN_15 = math.tan(math.radians(15))
COSINE = [math.cos(math.radians(9 * turns)) for turns in range(40)]
SINE = [math.sin(math.radians(9 * turns)) for turns in range(40)]
INPUTS = [(code & 1, code >> 1 & 1, code >> 2 & 1) for code in range(8)]  # left, front, right

Layer = list[list[float]]  # weight = layer[to][from]


@dataclass(slots=True)
class Agent:
    x: float
    y: float
    first: Layer
    second: Layer
    answers: list[list[float]]  # by input code, of the network that does not learn
    heading: int = 0  # in turns of 9 degrees
    code: int = 0
    outputs: list[float] = field(default_factory=list)
    action: int = 1
    eaten: int = 0


def agent_steps(setting: Setting) -> int:
    return setting.agents * setting.steps


def prepare(setting: Setting, genomes: Genomes) -> Simulate:
    def simulate(seed: int) -> list[list[int]]:
        world = World(setting, genomes[seed % len(genomes)], Random(seed))
        for time in range(setting.steps):
            world.step(time)
        return [[agent.eaten for agent in world.agents]]

    return simulate


def layers(weights: list[float], hidden: int) -> tuple[Layer, Layer]:
    first = [[weights[source * hidden + unit] for source in range(3)] for unit in range(hidden)]
    second = [
        [weights[3 * hidden + unit * 3 + action] for unit in range(hidden)] for action in range(3)
    ]
    return first, second


def activate_layer(layer: Layer, inputs: Any) -> list[float]:
    return [1 / (1 + math.exp(-sum(map(float.__mul__, row, inputs)))) for row in layer]


def activate_network(first: Layer, second: Layer, code: int) -> tuple[list[float], list[float]]:
    left, front, right = INPUTS[code]
    hidden = [
        1 / (1 + math.exp(-(left * row[0] + front * row[1] + right * row[2]))) for row in first
    ]
    return hidden, activate_layer(second, hidden)


def shortest(difference: float, size: float) -> float:
    """Return the shortest difference of two positions on a circle of length `size`."""
    half = size / 2
    if difference > half:
        return difference - size
    if difference < -half:
        return difference + size
    return difference


class World:
    """One world, with its agents and items."""

    def __init__(self, setting: Setting, genomes: list[list[list[float]]], random: Random) -> None:
        self.setting = setting
        self.random = random
        self.agents = [self._make_newborn(genome) for genome in genomes]
        self.items = [self._draw_position() for _ in range(setting.items)]

    def _draw_position(self) -> tuple[float, float]:
        return self.random.uniform(*self.setting.food_x), self.random.uniform(*self.setting.food_y)

    def _make_newborn(self, genome: list[list[float]]) -> Agent:
        x, y, radius = self.setting.start
        distance = radius * math.sqrt(self.random.random())
        angle = self.random.uniform(0, 2 * math.pi)
        fixed = layers(genome[-1], self.setting.hidden)
        return Agent(
            (x + distance * math.cos(angle)) % self.setting.width,
            (y + distance * math.sin(angle)) % self.setting.height,
            *layers(genome[0], self.setting.hidden),
            [activate_network(*fixed, code)[1] for code in range(8)],
        )

    def step(self, time: int) -> None:
        for agent in self.agents:
            agent.code = self._sense(agent)
        for agent in self.agents:
            self._activate_and_learn(agent)
            self._move(agent)
        self._eat(time)

    def _is_near(self, agent: Agent, margin: float) -> bool:
        """Return whether an item can be within `margin`."""
        x, y = self.setting.center
        width, height = self.setting.span(margin)
        return (
            abs(shortest(x - agent.x, self.setting.width)) <= width
            and abs(shortest(y - agent.y, self.setting.height)) <= height
        )

    def _sense(self, agent: Agent) -> int:
        setting = self.setting
        if not self._is_near(agent, setting.visual_radius):
            return 0
        cosine = COSINE[agent.heading]
        sine = SINE[agent.heading]
        limit = setting.visual_radius**2
        code = 0
        for item_x, item_y in self.items:
            dx = shortest(item_x - agent.x, setting.width)
            dy = shortest(item_y - agent.y, setting.height)
            if dx * dx + dy * dy <= limit:
                along = dx * cosine + dy * sine
                across = dy * cosine - dx * sine
                if abs(across) <= along * TAN_15:
                    code |= 2
                elif abs(across) < along:
                    code |= 1 if across < 0 else 4
        return code

    def _activate_and_learn(self, agent: Agent) -> None:
        if not self.setting.learns:
            agent.outputs = agent.answers[agent.code]
            return
        hidden, agent.outputs = activate_network(agent.first, agent.second, agent.code)
        target = agent.answers[agent.code]
        rate = self.setting.rate
        inputs = INPUTS[agent.code]
        errors = [
            (output - goal) * output * (1 - output)
            for output, goal in zip(agent.outputs, target, strict=True)
        ]
        for unit, row in enumerate(agent.first):
            # Without input, the first layer does not change.
            if agent.code:
                below = sum(
                    error * agent.second[action][unit] for action, error in enumerate(errors)
                )
                below *= rate * hidden[unit] * (1 - hidden[unit])
                row[:] = [
                    weight - below * source for weight, source in zip(row, inputs, strict=True)
                ]
        for error, row in zip(errors, agent.second, strict=True):
            row[:] = [
                weight - rate * error * source for weight, source in zip(row, hidden, strict=True)
            ]

    def _move(self, agent: Agent) -> None:
        agent.action = agent.outputs.index(max(agent.outputs))
        agent.heading = (agent.heading + agent.action - 1) % 40
        speed = 2 if agent.action == 1 else 1
        agent.x = (agent.x + speed * COSINE[agent.heading]) % self.setting.width
        agent.y = (agent.y + speed * SINE[agent.heading]) % self.setting.height

    def _eat(self, time: int) -> None:
        setting = self.setting
        eaten = set()
        for turn in range(setting.agents):
            agent = self.agents[(time + turn) % setting.agents]
            if self._is_near(agent, setting.reach):
                for number, (x, y) in enumerate(self.items):
                    dx = shortest(x - agent.x, setting.width)
                    dy = shortest(y - agent.y, setting.height)
                    if dx * dx + dy * dy < setting.reach**2 and number not in eaten:
                        agent.eaten += 1
                        eaten.add(number)
        for number in eaten:
            self.items[number] = self._draw_position()


def trace(setting: Setting, genomes: Genomes, seed: int) -> dict[str, Any]:
    """Return one lifetime by step, with the names of `core.variables.TRACE_VARIABLES`."""
    world = World(setting, genomes[0], Random(seed))
    names = ("x", "y", "heading", "item_x", "item_y", "sensor", "output", "action", "eaten")
    rows: dict[str, Any] = {name: [] for name in names}
    for time in range(setting.steps):
        agents = world.agents
        eaten = [agent.eaten for agent in agents]
        rows["item_x"].append([x for x, _ in world.items])
        rows["item_y"].append([y for _, y in world.items])
        for name, factor in (("x", 1), ("y", 1), ("heading", 9)):
            rows[name].append([getattr(agent, name) * factor for agent in agents])
        world.step(time)
        rows["sensor"].append([INPUTS[agent.code] for agent in agents])
        rows["output"].append([agent.outputs for agent in agents])
        rows["action"].append([agent.action for agent in agents])
        rows["eaten"].append(
            [agent.eaten - before for agent, before in zip(agents, eaten, strict=True)]
        )
    rows["weight_birth"] = genomes[0]
    rows["weight_death"] = [
        [_flat(agent), *genome[1:]] for agent, genome in zip(world.agents, genomes[0], strict=True)
    ]
    return rows


def _flat(agent: Agent) -> list[float]:
    """Return the weights of the action module in the order of a genome."""
    first = [row[source] for source in range(3) for row in agent.first]
    return first + [row[unit] for unit in range(len(agent.first)) for row in agent.second]
