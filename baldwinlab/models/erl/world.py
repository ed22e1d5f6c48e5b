"""The ground of cells: walls around it, plants that grow, trees that shelter, corpses, and carnivores that hunt by a fixed rule.

All arrays of a world are made before it begins, as compiled code makes none. A cell is a number; those beside it are `side` and 1
away. What stands there is its `kind`, and `who` is the number of the agent or the carnivore that is there, or -1.

Source: Ackley and Littman 1991. To our memory: cells, kinds, how far agents and carnivores see, a carnivore every 200 steps, at
least 50 plants. Ours: plants grow beside plants; a carnivore goes for the nearest agent or corpse straight ahead, tramples plants
and eats corpses, has a second one when its energy is full, and starves; there are walls only around.
"""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from baldwinlab.engine.jit import compiled
from baldwinlab.parts import LIFE, philox, unit

WALL, PLANT, TREE, AGENT, CARNIVORE, CORPSE, EMPTY = range(7)
KINDS: Final = 6  # that are seen
SIGHT, FAR_SIGHT = 4, 6  # cells that agents and carnivores see straight ahead, in four directions
LEAST_PLANTS, CARNIVORE_EVERY, MOST_CARNIVORES = 50, 200, 200
NOBODY: Final = -1

AGENTS, HUNTERS, PLANTS, DRAWN, STEP, BORN, LEARNED = range(7)  # in `counts`


class World(NamedTuple):
    """Everything that changes. Agents are the first so many rows of what begins with `agent`; so are carnivores."""

    counts: npt.NDArray[np.int64]  # how many there are, as named above; DRAWN in this step
    key: npt.NDArray[np.int64]  # seed, run, generation, and which population of these it is
    kind: npt.NDArray[np.int8]  # [cell]
    who: npt.NDArray[np.int32]  # [cell]
    place: npt.NDArray[np.int64]  # [agent]: its cell
    energy: npt.NDArray[np.float64]  # [agent], up to 1
    health: npt.NDArray[np.float64]  # [agent], up to 1
    bits: npt.NDArray[np.int8]  # [agent, bit]: its genome
    judge: npt.NDArray[np.float32]  # [agent, input]: its evaluation network, fixed in life
    act: npt.NDArray[np.float32]  # [agent, output, input]: its action network
    seen: npt.NDArray[np.float32]  # [agent, input]: what it sensed last
    judged: npt.NDArray[np.float32]  # [agent]: and what it thought of that
    said: npt.NDArray[np.int8]  # [agent, output]: and what it did; -1 before its first step
    lair: npt.NDArray[np.int64]  # [carnivore]: its cell
    hunger: npt.NDArray[np.float64]  # [carnivore]: its energy, up to 1
    wounds: npt.NDArray[np.float64]  # [carnivore]: its health, up to 1


@compiled
def draw(world: World) -> Any:
    """Four numbers in (0, 1) that nobody else draws."""
    world.counts[DRAWN] += 1
    seed, run, generation, number = world.key[0], world.key[1], world.key[2], world.key[3]
    drawn = philox(
        world.counts[DRAWN], world.counts[STEP], generation, LIFE + (number << 16), seed, run
    )
    return unit(drawn[0]), unit(drawn[1]), unit(drawn[2]), unit(drawn[3])


@compiled
def beside(rules: Any, cell: int, direction: int) -> Any:
    """The next cell: north, east, south, west."""
    return cell + (
        -rules.grid_size
        if direction == 0
        else 1
        if direction == 1
        else rules.grid_size
        if direction == 2
        else -1
    )


@compiled
def any_cell(rules: Any, world: World) -> Any:
    drawn = draw(world)
    return int(drawn[0] * np.float32(rules.grid_size)) * rules.grid_size + int(
        drawn[1] * np.float32(rules.grid_size)
    )


@compiled
def empty_cell(rules: Any, world: World) -> Any:
    """An empty cell anywhere, or -1 where none was found in a hundred tries."""
    for _ in range(100):
        cell = any_cell(rules, world)
        if world.kind[cell] == EMPTY:
            return cell
    return NOBODY


@compiled
def prepare(rules: Any, world: World) -> None:
    """Walls around, and plants, trees and carnivores anywhere."""
    world.counts[:] = 0
    for cell in range(rules.grid_size * rules.grid_size):
        x, y = cell % rules.grid_size, cell // rules.grid_size
        inside = 0 < x < rules.grid_size - 1 and 0 < y < rules.grid_size - 1
        world.kind[cell], world.who[cell] = EMPTY if inside else WALL, NOBODY
    for _ in range(rules.trees):
        cell = empty_cell(rules, world)
        if cell >= 0:
            world.kind[cell] = TREE
    for _ in range(rules.initial_plants):
        plant(rules, world, empty_cell(rules, world))
    for _ in range(rules.initial_carnivores):
        hunter_at(rules, world, empty_cell(rules, world))


@compiled
def plant(rules: Any, world: World, cell: int) -> None:
    if cell >= 0 and world.kind[cell] == EMPTY:
        world.kind[cell] = PLANT
        world.counts[PLANTS] += 1


@compiled
def grow(rules: Any, world: World) -> None:
    """Seeds fall anywhere; of so many cells that are looked at, each plant has another beside it; there are some always."""
    for _ in range(rules.sprouts_per_step):
        plant(rules, world, any_cell(rules, world))
    for _ in range(rules.growth_checks_per_step):
        cell = any_cell(rules, world)
        if world.kind[cell] == PLANT:
            plant(rules, world, beside(rules, cell, int(draw(world)[0] * np.float32(4))))
    for _ in range(LEAST_PLANTS - world.counts[PLANTS]):
        plant(rules, world, empty_cell(rules, world))


@compiled
def clear(world: World, cell: int) -> None:
    """What is eaten or trampled is gone."""
    world.counts[PLANTS] -= int(world.kind[cell] == PLANT)
    world.kind[cell] = EMPTY


@compiled
def hunter_at(rules: Any, world: World, cell: int) -> None:
    """A carnivore more, if there is room."""
    hunter = world.counts[HUNTERS]
    if cell >= 0 and hunter < MOST_CARNIVORES:
        world.kind[cell], world.who[cell] = CARNIVORE, hunter
        world.lair[hunter], world.hunger[hunter], world.wounds[hunter] = cell, 0.5, 1.0
        world.counts[HUNTERS] += 1


@compiled
def hunt(rules: Any, world: World, hunter: int) -> None:
    """Go for the nearest prey that is seen, or anywhere; bite an agent, eat a corpse; have another when full."""
    drawn = draw(world)
    direction, nearest = int(drawn[0] * np.float32(4)), FAR_SIGHT + 1
    for look in range(4):
        distance = _prey(rules, world, world.lair[hunter], look)
        if distance < nearest:
            direction, nearest = look, distance
    cell = beside(rules, world.lair[hunter], direction)
    kind = world.kind[cell]
    if kind == AGENT:
        world.health[world.who[cell]] -= rules.bite_damage
    elif kind in (EMPTY, PLANT, CORPSE):
        if kind == CORPSE:
            world.hunger[hunter] = min(1.0, world.hunger[hunter] + rules.carnivore_meat_energy)
        left = world.lair[hunter]
        clear(world, cell)
        world.kind[left], world.who[left] = EMPTY, NOBODY
        world.kind[cell], world.who[cell], world.lair[hunter] = CARNIVORE, hunter, cell
        if world.hunger[hunter] >= 1.0 and world.counts[HUNTERS] < MOST_CARNIVORES:
            world.hunger[hunter] = 0.5
            hunter_at(rules, world, left)
    world.hunger[hunter] -= rules.carnivore_cost_per_step


@compiled
def _prey(rules: Any, world: World, cell: int, direction: int) -> int:
    """How far the next agent or corpse is in a direction; beyond sight where there is none. An agent in a tree is not seen."""
    for distance in range(1, FAR_SIGHT + 1):
        cell = beside(rules, cell, direction)
        if world.kind[cell] == AGENT or world.kind[cell] == CORPSE:
            return distance
        if world.kind[cell] == WALL:
            return FAR_SIGHT + 1
    return FAR_SIGHT + 1


@compiled
def bury_hunters(world: World) -> None:
    """Who starved or was killed becomes a corpse; the last takes its number."""
    for hunter in range(world.counts[HUNTERS] - 1, -1, -1):
        if world.hunger[hunter] <= 0.0 or world.wounds[hunter] <= 0.0:
            cell, last = world.lair[hunter], world.counts[HUNTERS] - 1
            world.kind[cell], world.who[cell] = CORPSE, NOBODY
            if hunter != last:
                world.lair[hunter], world.hunger[hunter] = world.lair[last], world.hunger[last]
                world.wounds[hunter] = world.wounds[last]
                world.who[world.lair[hunter]] = hunter
            world.counts[HUNTERS] = last
