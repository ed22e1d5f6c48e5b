"""An agent: what it senses, what it thinks of that, what it learns by it and does; and how it is bred.

Its genome is 336 bits: 84 weights of four each, first the 28 of the evaluation network, then the 56 of the action network. The
first says how good what is sensed is. If that is better than a step before, what was done then is made likelier, else less
likely (complementary reinforcement backpropagation, CRBP). Nothing that is learned is inherited.

Source: Ackley and Littman 1991, and D. Ackley and M. Littman, "Generalization and scaling in reinforcement learning", NIPS 2
(1990), for CRBP. To our memory: inputs, networks, bits. Ours: the range of a weight; what agents do to each other; a mate
is the nearest within ten cells; two cuts; nobody is born where no cell beside the parent is empty.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from baldwinlab.engine.arithmetic import sigmoid
from baldwinlab.engine.jit import compiled
from baldwinlab.models.erl.world import (
    AGENT,
    AGENTS,
    BORN,
    CARNIVORE,
    CORPSE,
    EMPTY,
    KINDS,
    LEARNED,
    NOBODY,
    PLANT,
    SIGHT,
    TREE,
    WALL,
    World,
    beside,
    clear,
    draw,
    empty_cell,
)

INPUTS, OUTPUTS = 4 * KINDS + 4, 2  # and health, energy, whether in a tree, and a bias
BITS_OF_WEIGHT: Final = 4
BITS: Final = BITS_OF_WEIGHT * INPUTS * (1 + OUTPUTS)
REACH: Final = 10  # cells, to a mate
ONE, ZERO = np.float32(1), np.float32(0)


@compiled
def sense(rules: Any, world: World, agent: int, inputs: Any) -> None:
    """Fill `inputs` [input]: of each direction and kind the nearest, 1 beside it to 0.5 at the end of sight, 0 for none."""
    for number in range(INPUTS):
        inputs[number] = ZERO
    for direction in range(4):
        cell, blocked = world.place[agent], False
        for distance in range(SIGHT):
            if not blocked:
                cell = beside(rules, cell, direction)
                kind = int(world.kind[cell])
                blocked = kind == WALL
                if kind != EMPTY and inputs[direction * KINDS + kind] == ZERO:
                    inputs[direction * KINDS + kind] = np.float32(
                        1.0 - distance / (2.0 * (SIGHT - 1))
                    )
    inputs[4 * KINDS], inputs[4 * KINDS + 1] = (
        np.float32(world.health[agent]),
        np.float32(world.energy[agent]),
    )
    inputs[4 * KINDS + 2] = ONE if world.kind[world.place[agent]] == TREE else ZERO
    inputs[4 * KINDS + 3] = ONE


@compiled
def answer(weights: Any, inputs: Any) -> Any:
    """What one output says, in (0, 1)."""
    total = ZERO
    for number in range(INPUTS):
        total += weights[number] * inputs[number]
    return sigmoid(total)


@compiled
def reinforce(weights: Any, inputs: Any, said: Any, better: bool, rate: Any) -> None:
    """One step of CRBP of one output: towards what it said where that was for the better, else towards the contrary."""
    found = answer(weights, inputs)
    wanted = np.float32(said) if better else ONE - np.float32(said)
    change = rate * (wanted - found) * found * (ONE - found)
    for number in range(INPUTS):
        weights[number] += change * inputs[number]


@compiled
def live_step(rules: Any, world: World, agent: int, inputs: Any) -> None:
    """Sense, learn by what became of the step before, choose a direction by chance, and go there. `inputs` is scratch."""
    drawn = draw(world)
    if rules.walks:
        _go(rules, world, agent, int(drawn[0] * np.float32(4)))
        return
    sense(rules, world, agent, inputs)
    judged = answer(world.judge[agent], inputs)
    if rules.learns and world.said[agent, 0] >= 0 and judged != world.judged[agent]:
        better = judged > world.judged[agent]
        for output in range(OUTPUTS):
            rate = rules.positive_learning_rate if better else rules.negative_learning_rate
            reinforce(
                world.act[agent, output], world.seen[agent], world.said[agent, output], better, rate
            )
        world.counts[LEARNED] += 1
    for output in range(OUTPUTS):
        world.said[agent, output] = int(drawn[output] < answer(world.act[agent, output], inputs))
    for number in range(INPUTS):
        world.seen[agent, number] = inputs[number]
    world.judged[agent] = judged
    _go(rules, world, agent, 2 * int(world.said[agent, 0]) + int(world.said[agent, 1]))


@compiled
def _go(rules: Any, world: World, agent: int, direction: int) -> None:
    """To the next cell, if it can be entered: eat what is there; hit who is there."""
    cell = beside(rules, world.place[agent], direction)
    kind, who = world.kind[cell], world.who[cell]
    if kind == WALL:
        world.health[agent] -= rules.wall_damage
    elif kind == AGENT:
        world.health[who] -= rules.attack_damage
    elif kind == CARNIVORE:
        world.wounds[who] -= rules.attack_damage
    elif kind != TREE or who == NOBODY:
        gain = rules.plant_energy if kind == PLANT else rules.meat_energy if kind == CORPSE else 0.0
        world.energy[agent] = min(1.0, world.energy[agent] + gain)
        leave(world, agent)
        if kind != TREE:
            clear(world, cell)
            world.kind[cell] = AGENT
        world.who[cell], world.place[agent] = agent, cell


@compiled
def leave(world: World, agent: int) -> None:
    """The cell is free again."""
    cell = world.place[agent]
    world.who[cell] = NOBODY
    if world.kind[cell] == AGENT:
        world.kind[cell] = EMPTY


@compiled
def found(rules: Any, world: World, genomes: Any) -> None:
    """The founders, of these bits [founder, bit], anywhere."""
    for number in range(genomes.shape[0]):
        cell = empty_cell(rules, world)
        if cell >= 0:
            for bit in range(BITS):
                world.bits[world.counts[AGENTS], bit] = int(genomes[number, bit] > ZERO)
            settle(rules, world, cell)


@compiled
def settle(rules: Any, world: World, cell: int) -> None:
    """Let the next agent, whose bits are there, be born in a cell."""
    agent = world.counts[AGENTS]
    world.counts[AGENTS] += 1
    world.kind[cell], world.who[cell], world.place[agent] = AGENT, agent, cell
    world.energy[agent], world.health[agent] = rules.initial_energy, 1.0
    world.said[agent, 0] = world.said[agent, 1] = -1
    for number in range(INPUTS):
        world.judge[agent, number] = weight(rules, world.bits[agent], number)
        for output in range(OUTPUTS):
            world.act[agent, output, number] = weight(
                rules, world.bits[agent], INPUTS * (1 + output) + number
            )


@compiled
def weight(rules: Any, bits: Any, number: int) -> Any:
    """Of four bits, one of sixteen values from -range to range."""
    value = 0
    for bit in range(BITS_OF_WEIGHT):
        value = 2 * value + int(bits[BITS_OF_WEIGHT * number + bit])
    return rules.weight_range * np.float32(2 * value - 15) / np.float32(15)


@compiled
def breed(rules: Any, world: World, agent: int) -> None:
    """If it has the energy, and there is room: a child beside it, of it and of the nearest mate, or of it alone."""
    child = world.counts[AGENTS]
    if world.energy[agent] < rules.reproduction_threshold or child == rules.max_agents:
        return
    cell, first = NOBODY, int(draw(world)[0] * np.float32(4))
    for turn in range(4):
        near = beside(rules, world.place[agent], (first + turn) % 4)
        cell = near if cell == NOBODY and world.kind[near] == EMPTY else cell
    if cell == NOBODY:
        return
    if rules.inherits:
        _cross(rules, world, agent, _mate(rules, world, agent), child)
    else:
        for first_bit in range(0, BITS, 4):
            drawn = draw(world)
            for bit in range(4):
                world.bits[child, first_bit + bit] = int(drawn[bit] < np.float32(0.5))
    world.energy[agent] -= rules.reproduction_cost
    world.counts[BORN] += 1
    settle(rules, world, cell)


@compiled
def _mate(rules: Any, world: World, agent: int) -> int:
    """The nearest other within reach; itself where there is none."""
    mate, nearest = agent, REACH * REACH + 1
    x, y = world.place[agent] % rules.grid_size, world.place[agent] // rules.grid_size
    for other in range(world.counts[AGENTS]):
        dx, dy = world.place[other] % rules.grid_size - x, world.place[other] // rules.grid_size - y
        if other != agent and dx * dx + dy * dy < nearest:
            mate, nearest = other, dx * dx + dy * dy
    return mate


@compiled
def _cross(rules: Any, world: World, one: int, other: int, child: int) -> None:
    """Bits of one, but between two cuts of the other; then each may flip."""
    drawn = draw(world)
    cuts = int(drawn[0] * np.float32(BITS + 1)), int(drawn[1] * np.float32(BITS + 1))
    for first_bit in range(0, BITS, 4):
        flips = draw(world)
        for number in range(4):
            bit = first_bit + number
            parent = other if min(cuts) <= bit < max(cuts) else one
            world.bits[child, bit] = world.bits[parent, bit] ^ int(
                flips[number] < rules.mutation_rate
            )


@compiled
def bury(world: World) -> None:
    """Who has no energy or no health left becomes a corpse, if it is in no tree; the last takes its number."""
    for agent in range(world.counts[AGENTS] - 1, -1, -1):
        if world.energy[agent] <= 0.0 or world.health[agent] <= 0.0:
            cell, last = world.place[agent], world.counts[AGENTS] - 1
            leave(world, agent)
            if world.kind[cell] == EMPTY:
                world.kind[cell] = CORPSE
            if agent != last:
                _renumber(world, last, agent)
            world.counts[AGENTS] = last


@compiled
def _renumber(world: World, old: int, new: int) -> None:
    world.place[new], world.energy[new], world.health[new] = (
        world.place[old],
        world.energy[old],
        world.health[old],
    )
    world.judged[new] = world.judged[old]
    for bit in range(BITS):
        world.bits[new, bit] = world.bits[old, bit]
    for output in range(OUTPUTS):
        world.said[new, output] = world.said[old, output]
        for number in range(INPUTS):
            world.act[new, output, number] = world.act[old, output, number]
    for number in range(INPUTS):
        world.judge[new, number], world.seen[new, number] = (
            world.judge[old, number],
            world.seen[old, number],
        )
    world.who[world.place[new]] = new
