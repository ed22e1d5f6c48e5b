"""The standard variant in NumPy, float32: one operation for all agents of all worlds, and for all items that they may see.

Source: docs/explanation/model.md. An agent is a lane: the last dimension of every array of the networks.
The agents x items arrays contain only agents near food.
Networks that do not learn are tables of the eight possible inputs.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from benchmarks.setting import Genomes, Live, Setting

WORLDS = 128  # the most of 8 to 128, and the best; fewer leave NumPy's overhead

Floats = npt.NDArray[np.float32]
Integers = npt.NDArray[np.int64]

TAN_15 = np.float32(math.tan(math.radians(15)))
COSINE = np.cos(np.radians(9 * np.arange(40))).astype(np.float32)
SINE = np.sin(np.radians(9 * np.arange(40))).astype(np.float32)
INPUTS = (np.arange(8) >> np.arange(3)[:, None] & 1).astype(np.float32)  # [sensor, code]


def agent_steps(setting: Setting) -> int:
    return WORLDS * setting.agents * setting.steps


def lives(setting: Setting, genomes: Genomes) -> Live:
    born_with = np.asarray(genomes, np.float32)
    in_turn = born_with[np.arange(WORLDS) % len(born_with)]

    def live(seed: int) -> Integers:
        worlds = Worlds(setting, in_turn, np.random.default_rng(seed))
        for time in range(setting.steps):
            worlds.step(time)
        return worlds.eaten.reshape(WORLDS, setting.agents)

    return live


def logistic(sums: Floats) -> Floats:
    np.negative(sums, out=sums)
    np.exp(sums, out=sums)
    sums += 1
    return np.reciprocal(sums, out=sums)


def layers(weights: Floats, hidden: int) -> tuple[Floats, Floats]:
    """Weights [lane, weight] as [from, to, lane], of both layers."""
    first, second = weights[:, : 3 * hidden].T, weights[:, 3 * hidden :].T
    return np.ascontiguousarray(first).reshape(3, hidden, -1), np.ascontiguousarray(second).reshape(
        hidden, 3, -1
    )


def think(first: Floats, second: Floats, inputs: Floats) -> tuple[Floats, Floats]:
    """Activations [unit, lane] of the hidden units and of the outputs."""
    hidden = logistic((inputs[:, None] * first).sum(axis=0))
    return hidden, logistic((hidden[:, None] * second).sum(axis=0))


def shortest(difference: Floats, size: float) -> Floats:
    """Differences of positions on a circle of length `size`, the short way round."""
    difference -= np.float32(size) * np.rint(difference * np.float32(1 / size))
    return difference


class Worlds:
    """All worlds, side by side. Arrays are [lane], lane = world * agents + agent, or [world, item]."""

    def __init__(self, setting: Setting, genomes: Floats, random: np.random.Generator) -> None:
        self.setting, self.random = setting, random
        worlds, agents = genomes.shape[:2]
        lanes = worlds * agents
        self.world, self.agent = (
            np.repeat(np.arange(worlds), agents),
            np.tile(np.arange(agents), worlds),
        )
        x, y, radius = setting.start
        distance, angle = (
            radius * np.sqrt(random.random(lanes)),
            random.uniform(0, 2 * np.pi, lanes),
        )
        self.x = ((x + distance * np.cos(angle)) % setting.width).astype(np.float32)
        self.y = ((y + distance * np.sin(angle)) % setting.height).astype(np.float32)
        self.heading = np.zeros(lanes, np.int64)  # in turns of 9 degrees
        self.item_x = random.uniform(*setting.food_x, (worlds, setting.items)).astype(np.float32)
        self.item_y = random.uniform(*setting.food_y, (worlds, setting.items)).astype(np.float32)
        modules = genomes.reshape(lanes, *genomes.shape[2:])
        self.first, self.second = layers(modules[:, 0], setting.hidden)
        fixed = layers(modules[:, -1], setting.hidden)
        self.answers = np.stack(
            [think(*fixed, np.broadcast_to(INPUTS[:, [code]], (3, lanes)))[1] for code in range(8)]
        )
        self.eaten = np.zeros(lanes, np.int64)
        self.code, self.outputs, self.action = (
            np.zeros(lanes, np.int64),
            np.zeros((3, lanes), np.float32),
            self.heading,
        )

    def step(self, time: int) -> None:
        near = self._near(np.arange(self.x.size), self.setting.visual_radius)
        self.code = self._sense(near)
        self.outputs = self._think_and_learn()
        self._move()
        self._eat(self._near(near, self.setting.reach), time)

    def _near(self, lanes: Integers, margin: float) -> Integers:
        """Which of the lanes may be within `margin` of an item."""
        (x, y), (across, down) = self.setting.centre, self.setting.span(margin)
        dx, dy = (
            shortest(x - self.x[lanes], self.setting.width),
            shortest(y - self.y[lanes], self.setting.height),
        )
        return lanes[(np.abs(dx) <= across) & (np.abs(dy) <= down)]

    def _ways(self, lanes: Integers) -> tuple[Floats, Floats]:
        """From these agents to all items of their worlds, [lane, item]."""
        world = self.world[lanes]
        dx = shortest(self.item_x[world] - self.x[lanes, None], self.setting.width)
        return dx, shortest(self.item_y[world] - self.y[lanes, None], self.setting.height)

    def _sense(self, lanes: Integers) -> Integers:
        dx, dy = self._ways(lanes)
        cosine, sine = COSINE[self.heading[lanes], None], SINE[self.heading[lanes], None]
        seen = dx * dx + dy * dy <= self.setting.visual_radius**2
        along, across = dx * cosine + dy * sine, dy * cosine - dx * sine
        aside, edge = np.abs(across), along * TAN_15
        side = seen & (aside > edge) & (aside < along)
        front = (seen & (aside <= edge)).any(axis=1)
        code = np.zeros_like(self.heading)
        code[lanes] = (
            (side & (across < 0)).any(axis=1) + 2 * front + 4 * (side & (across > 0)).any(axis=1)
        )
        return code

    def _think_and_learn(self) -> Floats:
        answers: Floats = np.take_along_axis(self.answers, self.code[None, None], axis=0)[0]
        if not self.setting.learns:
            return answers
        inputs, rate = INPUTS[:, self.code], np.float32(self.setting.rate)
        hidden, outputs = think(self.first, self.second, inputs)
        errors = (outputs - answers) * outputs * (1 - outputs)
        below = (self.second * errors).sum(axis=1) * hidden * (1 - hidden)
        self.second -= hidden[:, None] * (rate * errors)
        self.first -= inputs[:, None] * (rate * below)
        return outputs

    def _move(self) -> None:
        self.action = self.outputs.argmax(axis=0)
        self.heading = (self.heading + self.action - 1) % 40
        speed = np.where(self.action == 1, np.float32(2), np.float32(1))
        self.x = (self.x + speed * COSINE[self.heading]) % np.float32(self.setting.width)
        self.y = (self.y + speed * SINE[self.heading]) % np.float32(self.setting.height)

    def _eat(self, lanes: Integers, time: int) -> None:
        """Every touched item goes to the first of those who touch it, in the order of the step."""
        dx, dy = self._ways(lanes)
        row, item = np.nonzero(dx * dx + dy * dy < self.setting.reach**2)
        lane = lanes[row]
        order = np.argsort((self.agent[lane] - time) % self.setting.agents, kind="stable")
        lane, item = lane[order], item[order]
        _, first = np.unique(self.world[lane] * self.setting.items + item, return_index=True)
        world, item = self.world[lane[first]], item[first]
        np.add.at(self.eaten, lane[first], 1)
        self.item_x[world, item] = self.random.uniform(*self.setting.food_x, first.size)
        self.item_y[world, item] = self.random.uniform(*self.setting.food_y, first.size)


def trace(setting: Setting, genomes: Genomes, seed: int) -> dict[str, Any]:
    """One world's life, step by step, in the names of `baldwinlab.core.variables.TRACE`."""
    birth = np.asarray(genomes[:1], np.float32)
    worlds, rows = Worlds(setting, birth, np.random.default_rng(seed)), []
    for time in range(setting.steps):
        before = (
            worlds.x,
            worlds.y,
            worlds.heading * 9,
            worlds.item_x[0].copy(),
            worlds.item_y[0].copy(),
        )
        eaten = worlds.eaten.copy()
        worlds.step(time)
        rows.append(
            (
                *before,
                INPUTS[:, worlds.code].T,
                worlds.outputs.T,
                worlds.action,
                worlds.eaten - eaten,
            )
        )
    names = ("x", "y", "heading", "item_x", "item_y", "sensor", "output", "action", "eaten")
    found: dict[str, Any] = {
        name: np.array(column) for name, column in zip(names, zip(*rows, strict=True), strict=True)
    }
    death = birth[0].copy()
    death[:, 0] = np.concatenate(
        [worlds.first.reshape(-1, setting.agents), worlds.second.reshape(-1, setting.agents)]
    ).T
    return found | {"weight_birth": birth[0], "weight_death": death}
