"""A grid of cells with walls, plants, trees, corpses, and carnivores that follow a fixed rule.

All arrays of a world are allocated before the first step, because compiled code allocates none. A
cell is a number. Its neighbors differ by 1 and by `grid_size`. `kind` is the content of a cell.
`occupant` is the number of the agent or carnivore in the cell, or -1.

From memory are the cells, the kinds, the sight of agents and carnivores, one additional carnivore
every 200 steps, and a minimum of 50 plants. Our choices are as follows. Plants grow next to plants.
A carnivore goes to the nearest agent or corpse straight ahead, destroys plants and eats corpses. It
reproduces at full energy, and starves without food. Walls are only at the edges.

References
----------
Ackley and Littman 1991.
"""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from baldwinlab.engine.jit import compiled
from baldwinlab.parts import LIFE, philox, unit

WALL, PLANT, TREE, AGENT, CARNIVORE, CORPSE, EMPTY = range(7)
# Number of kinds that agents sense. EMPTY is not sensed.
N_SENSED_KINDS: Final = 6
# Cells that agents and carnivores see straight ahead, in four directions.
AGENT_SIGHT = 4
CARNIVORE_SIGHT = 6
MIN_PLANTS = 50
# Steps between two additional carnivores.
CARNIVORE_INTERVAL = 200
MAX_CARNIVORES = 200
# Instead of the number of a cell or of an occupant.
NO_NUMBER: Final = -1

# Entries of `World.counts`.
AGENTS, CARNIVORES, PLANTS, DRAWN, STEP, BORN, LEARNED = range(7)


class ErlWorld(NamedTuple):
    """State of a world. Agents and carnivores use the first rows of their arrays."""

    # Numbers as named above. DRAWN is the number of random draws in this step.
    counts: npt.NDArray[np.int64]
    # Seed, run, generation and number of the population.
    key: npt.NDArray[np.int64]
    # [cell]: content.
    kind: npt.NDArray[np.int8]
    # [cell]: number of the agent or carnivore, or -1.
    occupant: npt.NDArray[np.int32]
    # [agent]: cell.
    position: npt.NDArray[np.int64]
    # [agent]: energy, up to 1.
    energy: npt.NDArray[np.float64]
    # [agent]: health, up to 1.
    health: npt.NDArray[np.float64]
    # [agent, bit]: genome.
    bits: npt.NDArray[np.int8]
    # [agent, input]: evaluation network, which does not change during life.
    evaluation_weights: npt.NDArray[np.float32]
    # [agent, output, input]: action network.
    action_weights: npt.NDArray[np.float32]
    # [agent, input]: inputs of the last step.
    last_inputs: npt.NDArray[np.float32]
    # [agent]: evaluation of the last step.
    last_evaluation: npt.NDArray[np.float32]
    # [agent, output]: action of the last step; -1 before the first step.
    last_action: npt.NDArray[np.int8]
    # [carnivore]: cell.
    carnivore_position: npt.NDArray[np.int64]
    # [carnivore]: energy, up to 1.
    carnivore_energy: npt.NDArray[np.float64]
    # [carnivore]: health, up to 1.
    carnivore_health: npt.NDArray[np.float64]


@compiled
def draw_uniforms(world: ErlWorld) -> Any:
    """Draw four uniform numbers in (0, 1). Each call returns different numbers."""
    world.counts[DRAWN] += 1
    seed = world.key[0]
    run = world.key[1]
    generation = world.key[2]
    number = world.key[3]
    drawn = philox(
        world.counts[DRAWN], world.counts[STEP], generation, LIFE + (number << 16), seed, run
    )
    return unit(drawn[0]), unit(drawn[1]), unit(drawn[2]), unit(drawn[3])


@compiled
def neighbor_cell(rules: Any, cell: int, direction: int) -> Any:
    """Return the next cell in a direction: 0 north, 1 east, 2 south, 3 west."""
    if direction == 0:
        return cell - rules.grid_size
    if direction == 1:
        return cell + 1
    if direction == 2:
        return cell + rules.grid_size
    return cell - 1


@compiled
def random_cell(rules: Any, world: ErlWorld) -> Any:
    drawn = draw_uniforms(world)
    return int(drawn[0] * np.float32(rules.grid_size)) * rules.grid_size + int(
        drawn[1] * np.float32(rules.grid_size)
    )


@compiled
def random_empty_cell(rules: Any, world: ErlWorld) -> Any:
    """Return a random empty cell, or -1 after a hundred failed draws."""
    for _ in range(100):
        cell = random_cell(rules, world)
        if world.kind[cell] == EMPTY:
            return cell
    return NO_NUMBER


@compiled
def init_world(rules: Any, world: ErlWorld) -> None:
    """Build walls at the edges and add plants, trees and carnivores in random cells."""
    world.counts[:] = 0
    for cell in range(rules.grid_size * rules.grid_size):
        x = cell % rules.grid_size
        y = cell // rules.grid_size
        is_inside = 0 < x < rules.grid_size - 1 and 0 < y < rules.grid_size - 1
        world.kind[cell] = EMPTY if is_inside else WALL
        world.occupant[cell] = NO_NUMBER
    for _ in range(rules.trees):
        cell = random_empty_cell(rules, world)
        if cell >= 0:
            world.kind[cell] = TREE
    for _ in range(rules.initial_plants):
        add_plant(rules, world, random_empty_cell(rules, world))
    for _ in range(rules.initial_carnivores):
        add_carnivore(rules, world, random_empty_cell(rules, world))


@compiled
def add_plant(rules: Any, world: ErlWorld, cell: int) -> None:
    if cell >= 0 and world.kind[cell] == EMPTY:
        world.kind[cell] = PLANT
        world.counts[PLANTS] += 1


@compiled
def grow_plants(rules: Any, world: ErlWorld) -> None:
    """Add plants in random cells and next to plants, at least up to the minimum number."""
    for _ in range(rules.sprouts_per_step):
        add_plant(rules, world, random_cell(rules, world))
    for _ in range(rules.growth_checks_per_step):
        cell = random_cell(rules, world)
        if world.kind[cell] == PLANT:
            add_plant(
                rules,
                world,
                neighbor_cell(rules, cell, int(draw_uniforms(world)[0] * np.float32(4))),
            )
    for _ in range(MIN_PLANTS - world.counts[PLANTS]):
        add_plant(rules, world, random_empty_cell(rules, world))


@compiled
def clear_cell(world: ErlWorld, cell: int) -> None:
    """Empty a cell and count its plant as removed."""
    world.counts[PLANTS] -= int(world.kind[cell] == PLANT)
    world.kind[cell] = EMPTY


@compiled
def add_carnivore(rules: Any, world: ErlWorld, cell: int) -> None:
    """Add a carnivore in a cell, if the maximum number is not reached."""
    carnivore = world.counts[CARNIVORES]
    if cell >= 0 and carnivore < MAX_CARNIVORES:
        world.kind[cell] = CARNIVORE
        world.occupant[cell] = carnivore
        world.carnivore_position[carnivore] = cell
        world.carnivore_energy[carnivore] = 0.5
        world.carnivore_health[carnivore] = 1.0
        world.counts[CARNIVORES] += 1


@compiled
def step_carnivore(rules: Any, world: ErlWorld, carnivore: int) -> None:
    """Move a carnivore to the nearest visible prey, or in a random direction.

    It bites an agent and eats a corpse. It reproduces at full energy.
    """
    drawn = draw_uniforms(world)
    direction = int(drawn[0] * np.float32(4))
    nearest = CARNIVORE_SIGHT + 1
    for candidate in range(4):
        distance = _prey_distance(rules, world, world.carnivore_position[carnivore], candidate)
        if distance < nearest:
            direction = candidate
            nearest = distance
    cell = neighbor_cell(rules, world.carnivore_position[carnivore], direction)
    kind = world.kind[cell]
    if kind == AGENT:
        world.health[world.occupant[cell]] -= rules.bite_damage
    elif kind in (EMPTY, PLANT, CORPSE):
        if kind == CORPSE:
            world.carnivore_energy[carnivore] = min(
                1.0, world.carnivore_energy[carnivore] + rules.carnivore_meat_energy
            )
        old_cell = world.carnivore_position[carnivore]
        clear_cell(world, cell)
        world.kind[old_cell] = EMPTY
        world.occupant[old_cell] = NO_NUMBER
        world.kind[cell] = CARNIVORE
        world.occupant[cell] = carnivore
        world.carnivore_position[carnivore] = cell
        if world.carnivore_energy[carnivore] >= 1.0 and world.counts[CARNIVORES] < MAX_CARNIVORES:
            world.carnivore_energy[carnivore] = 0.5
            add_carnivore(rules, world, old_cell)
    world.carnivore_energy[carnivore] -= rules.carnivore_cost_per_step


@compiled
def _prey_distance(rules: Any, world: ErlWorld, cell: int, direction: int) -> int:
    """Return the distance of the nearest agent or corpse in a direction.

    The result is above FAR_SIGHT if there is none. An agent in a tree is not visible.
    """
    for distance in range(1, CARNIVORE_SIGHT + 1):
        cell = neighbor_cell(rules, cell, direction)
        if world.kind[cell] == AGENT or world.kind[cell] == CORPSE:
            return distance
        if world.kind[cell] == WALL:
            return CARNIVORE_SIGHT + 1
    return CARNIVORE_SIGHT + 1


@compiled
def remove_dead_carnivores(world: ErlWorld) -> None:
    """Replace each dead carnivore by a corpse.

    The last carnivore gets the number of the removed one.
    """
    for carnivore in range(world.counts[CARNIVORES] - 1, -1, -1):
        if world.carnivore_energy[carnivore] <= 0.0 or world.carnivore_health[carnivore] <= 0.0:
            cell = world.carnivore_position[carnivore]
            last = world.counts[CARNIVORES] - 1
            world.kind[cell] = CORPSE
            world.occupant[cell] = NO_NUMBER
            if carnivore != last:
                world.carnivore_position[carnivore] = world.carnivore_position[last]
                world.carnivore_energy[carnivore] = world.carnivore_energy[last]
                world.carnivore_health[carnivore] = world.carnivore_health[last]
                world.occupant[world.carnivore_position[carnivore]] = carnivore
            world.counts[CARNIVORES] = last
