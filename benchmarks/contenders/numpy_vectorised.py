"""The standard variant in NumPy, float32: one operation for all agents, worlds and near items.

Source: docs/explanation/model.md. An agent is a lane: the last dimension of every array of the
networks. The agents x items arrays contain only agents near food. Networks that do not learn are
tables of the eight possible inputs.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from benchmarks.setting import Genomes, Setting, Simulate

# The fastest of 8 to 128 worlds. Fewer worlds do not hide the overhead of NumPy.
WORLDS = 128

Floats = npt.NDArray[np.float32]
Integers = npt.NDArray[np.int64]

TAN_15 = np.float32(math.tan(math.radians(15)))
COSINE = np.cos(np.radians(9 * np.arange(40))).astype(np.float32)
SINE = np.sin(np.radians(9 * np.arange(40))).astype(np.float32)
INPUTS = (np.arange(8) >> np.arange(3)[:, None] & 1).astype(np.float32)  # [sensor, code]


def agent_steps(setting: Setting) -> int:
    return WORLDS * setting.agents * setting.steps


def prepare(setting: Setting, genomes: Genomes) -> Simulate:
    newborns = np.asarray(genomes, np.float32)
    in_turn = newborns[np.arange(WORLDS) % len(newborns)]

    def simulate(seed: int) -> Integers:
        worlds = Worlds(setting, in_turn, np.random.default_rng(seed))
        for time in range(setting.steps):
            worlds.step(time)
        return worlds.eaten.reshape(WORLDS, setting.agents)

    return simulate


def logistic(sums: Floats) -> Floats:
    np.negative(sums, out=sums)
    np.exp(sums, out=sums)
    sums += 1
    return np.reciprocal(sums, out=sums)


def layers(weights: Floats, hidden: int) -> tuple[Floats, Floats]:
    """Return the weights [lane, weight] of both layers as [from, to, lane]."""
    first = np.ascontiguousarray(weights[:, : 3 * hidden].T)
    second = np.ascontiguousarray(weights[:, 3 * hidden :].T)
    return first.reshape(3, hidden, -1), second.reshape(hidden, 3, -1)


def activate(first: Floats, second: Floats, inputs: Floats) -> tuple[Floats, Floats]:
    """Return the activations [unit, lane] of the hidden units and of the outputs."""
    hidden = logistic((inputs[:, None] * first).sum(axis=0))
    return hidden, logistic((hidden[:, None] * second).sum(axis=0))


def shortest(difference: Floats, size: float) -> Floats:
    """Return the shortest differences of positions on a circle of length `size`."""
    difference -= np.float32(size) * np.rint(difference * np.float32(1 / size))
    return difference


class Worlds:
    """All worlds. Arrays are [lane], with lane = world * agents + agent, or [world, item]."""

    def __init__(self, setting: Setting, genomes: Floats, random: np.random.Generator) -> None:
        self.setting = setting
        self.random = random
        worlds, agents = genomes.shape[:2]
        lanes = worlds * agents
        self.world = np.repeat(np.arange(worlds), agents)
        self.agent = np.tile(np.arange(agents), worlds)
        x, y, radius = setting.start
        distance = radius * np.sqrt(random.random(lanes))
        angle = random.uniform(0, 2 * np.pi, lanes)
        self.x = ((x + distance * np.cos(angle)) % setting.width).astype(np.float32)
        self.y = ((y + distance * np.sin(angle)) % setting.height).astype(np.float32)
        self.heading = np.zeros(lanes, np.int64)  # in turns of 9 degrees
        self.item_x = random.uniform(*setting.food_x, (worlds, setting.items)).astype(np.float32)
        self.item_y = random.uniform(*setting.food_y, (worlds, setting.items)).astype(np.float32)
        modules = genomes.reshape(lanes, *genomes.shape[2:])
        self.first, self.second = layers(modules[:, 0], setting.hidden)
        fixed = layers(modules[:, -1], setting.hidden)
        self.answers = np.stack(
            [
                activate(*fixed, np.broadcast_to(INPUTS[:, [code]], (3, lanes)))[1]
                for code in range(8)
            ]
        )
        self.eaten = np.zeros(lanes, np.int64)
        self.code = np.zeros(lanes, np.int64)
        self.outputs = np.zeros((3, lanes), np.float32)
        self.action = self.heading

    def step(self, time: int) -> None:
        near = self._near(np.arange(self.x.size), self.setting.visual_radius)
        self.code = self._sense(near)
        self.outputs = self._activate_and_learn()
        self._move()
        self._eat(self._near(near, self.setting.reach), time)

    def _near(self, lanes: Integers, margin: float) -> Integers:
        """Return the lanes that may be within `margin` of an item."""
        x, y = self.setting.center
        width, height = self.setting.span(margin)
        dx = shortest(x - self.x[lanes], self.setting.width)
        dy = shortest(y - self.y[lanes], self.setting.height)
        return lanes[(np.abs(dx) <= width) & (np.abs(dy) <= height)]

    def _distances(self, lanes: Integers) -> tuple[Floats, Floats]:
        """Return the distances in x and y to all items of the world of a lane, [lane, item]."""
        world = self.world[lanes]
        dx = shortest(self.item_x[world] - self.x[lanes, None], self.setting.width)
        dy = shortest(self.item_y[world] - self.y[lanes, None], self.setting.height)
        return dx, dy

    def _sense(self, lanes: Integers) -> Integers:
        dx, dy = self._distances(lanes)
        cosine = COSINE[self.heading[lanes], None]
        sine = SINE[self.heading[lanes], None]
        visible = dx * dx + dy * dy <= self.setting.visual_radius**2
        along = dx * cosine + dy * sine
        across = dy * cosine - dx * sine
        offset = np.abs(across)
        edge = along * TAN_15
        side = visible & (offset > edge) & (offset < along)
        left = (side & (across < 0)).any(axis=1)
        front = (visible & (offset <= edge)).any(axis=1)
        right = (side & (across > 0)).any(axis=1)
        code = np.zeros_like(self.heading)
        code[lanes] = left + 2 * front + 4 * right
        return code

    def _activate_and_learn(self) -> Floats:
        answers: Floats = np.take_along_axis(self.answers, self.code[None, None], axis=0)[0]
        if not self.setting.learns:
            return answers
        inputs = INPUTS[:, self.code]
        rate = np.float32(self.setting.rate)
        hidden, outputs = activate(self.first, self.second, inputs)
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
        """Give every touched item to the first agent in the order of the step; replace the item."""
        dx, dy = self._distances(lanes)
        row, item = np.nonzero(dx * dx + dy * dy < self.setting.reach**2)
        lane = lanes[row]
        order = np.argsort((self.agent[lane] - time) % self.setting.agents, kind="stable")
        lane = lane[order]
        item = item[order]
        _, first = np.unique(self.world[lane] * self.setting.items + item, return_index=True)
        world = self.world[lane[first]]
        item = item[first]
        np.add.at(self.eaten, lane[first], 1)
        self.item_x[world, item] = self.random.uniform(*self.setting.food_x, first.size)
        self.item_y[world, item] = self.random.uniform(*self.setting.food_y, first.size)


def trace(setting: Setting, genomes: Genomes, seed: int) -> dict[str, Any]:
    """Return one lifetime by step, with the names of `core.variables.TRACE_VARIABLES`."""
    birth = np.asarray(genomes[:1], np.float32)
    worlds = Worlds(setting, birth, np.random.default_rng(seed))
    rows = []
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
    columns = map(np.array, zip(*rows, strict=True))
    result: dict[str, Any] = dict(zip(names, columns, strict=True))
    death = birth[0].copy()
    death[:, 0] = np.concatenate(
        [worlds.first.reshape(-1, setting.agents), worlds.second.reshape(-1, setting.agents)]
    ).T
    return result | {"weight_birth": birth[0], "weight_death": death}
