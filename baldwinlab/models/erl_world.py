"""World of `erl_populations.py`: cells with walls, plants, trees, corpses and carnivores.

All arrays of a world are allocated before the first step, because compiled code allocates no
memory. The index of a cell is row * `grid_size` + column, so the neighbors of cell c are c - 1,
c + 1, c - `grid_size` and c + `grid_size`.

The cells, the kinds, the sight of agents and carnivores, one additional carnivore every 200 steps,
and a minimum of 50 plants are from memory. Our choices are as follows. Plants grow next to plants.
A carnivore follows a fixed rule: it goes to the nearest agent or corpse in one of the four
directions, destroys plants and eats corpses. A carnivore reproduces at full energy, and starves
without food. Walls are only at the edges.
"""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from baldwinlab.engine.jit import compiled
from baldwinlab.parts import LIFE, philox, unit

# Kinds of cells, by their content.
WALL, PLANT, TREE, AGENT, CARNIVORE, CORPSE, EMPTY = range(7)
# Number of kinds that agents sense. EMPTY is not sensed.
N_SENSED_KINDS: Final = 6
# Largest distance at which agents and carnivores see a cell, in each of the four directions.
AGENT_SIGHT = 4
CARNIVORE_SIGHT = 6
# Minimum number of plants after each step.
MIN_PLANTS = 50
# Steps between two additional carnivores.
CARNIVORE_INTERVAL = 200
MAX_CARNIVORES = 200
# Index of a missing cell or of a missing occupant.
NO_NUMBER: Final = -1

# Indices of the entries of `ErlWorld.counts`.
AGENTS, CARNIVORES, PLANTS, DRAWN, STEP, BORN, LEARNED = range(7)
N_COUNTS: Final = 7
# Energy of a newborn carnivore, and of the parent after the birth.
INITIAL_CARNIVORE_ENERGY: Final = 0.5
# Maximum number of draws for an empty cell.
MAX_CELL_DRAWS: Final = 100


class ErlWorld(NamedTuple):
    """State of a world. Living agents and carnivores use the first rows of the arrays."""

    # [entry]: current numbers of agents, carnivores and plants; number of random draws in this step
    # (DRAWN); step, from 1; total numbers of births and of learning steps.
    counts: npt.NDArray[np.int64]
    # [4]: seed, run, generation and index of the population.
    key: npt.NDArray[np.int64]
    # [cell]: kind of the content, from WALL to EMPTY. A tree with an agent is a TREE.
    kind: npt.NDArray[np.int8]
    # [cell]: row of the agent or carnivore in the cell, -1 for none.
    occupant: npt.NDArray[np.int32]
    # [agent]: index of the cell.
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
    # [carnivore]: index of the cell.
    carnivore_position: npt.NDArray[np.int64]
    # [carnivore]: energy, up to 1.
    carnivore_energy: npt.NDArray[np.float64]
    # [carnivore]: health, up to 1.
    carnivore_health: npt.NDArray[np.float64]


@compiled
def draw_uniforms(world: ErlWorld) -> Any:
    """Draw four uniform random numbers in [0, 1). Each call draws other numbers."""
    world.counts[DRAWN] += 1
    seed = world.key[0]
    run = world.key[1]
    generation = world.key[2]
    population = world.key[3]
    # Different purposes give different populations independent random numbers.
    purpose = LIFE + (population << 16)
    words = philox(world.counts[DRAWN], world.counts[STEP], generation, purpose, seed, run)
    return unit(words[0]), unit(words[1]), unit(words[2]), unit(words[3])


@compiled
def neighbor_cell(rules: Any, cell: int, direction: int) -> Any:
    """Return the index of the next cell in a direction: 0 north, 1 east, 2 south, 3 west."""
    if direction == 0:
        return cell - rules.grid_size
    if direction == 1:
        return cell + 1
    if direction == 2:
        return cell + rules.grid_size
    return cell - 1


@compiled
def draw_cell(rules: Any, world: ErlWorld) -> Any:
    draws = draw_uniforms(world)
    row = int(draws[0] * np.float32(rules.grid_size))
    column = int(draws[1] * np.float32(rules.grid_size))
    return row * rules.grid_size + column


@compiled
def draw_empty_cell(rules: Any, world: ErlWorld) -> Any:
    """Return a random empty cell, or -1 after `MAX_CELL_DRAWS` failed draws."""
    for _ in range(MAX_CELL_DRAWS):
        cell = draw_cell(rules, world)
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
        cell = draw_empty_cell(rules, world)
        if cell >= 0:
            world.kind[cell] = TREE
    for _ in range(rules.initial_plants):
        add_plant(rules, world, draw_empty_cell(rules, world))
    for _ in range(rules.initial_carnivores):
        add_carnivore(rules, world, draw_empty_cell(rules, world))


@compiled
def add_plant(rules: Any, world: ErlWorld, cell: int) -> None:
    """Add a plant in a cell if the cell is empty. Do nothing if `cell` is -1."""
    if cell >= 0 and world.kind[cell] == EMPTY:
        world.kind[cell] = PLANT
        world.counts[PLANTS] += 1


@compiled
def grow_plants(rules: Any, world: ErlWorld) -> None:
    """Add plants in random cells and next to plants, then plants up to `MIN_PLANTS`."""
    for _ in range(rules.sprouts_per_step):
        add_plant(rules, world, draw_cell(rules, world))
    for _ in range(rules.growth_checks_per_step):
        cell = draw_cell(rules, world)
        if world.kind[cell] == PLANT:
            direction = int(draw_uniforms(world)[0] * np.float32(4))
            add_plant(rules, world, neighbor_cell(rules, cell, direction))
    for _ in range(MIN_PLANTS - world.counts[PLANTS]):
        add_plant(rules, world, draw_empty_cell(rules, world))


@compiled
def clear_cell(world: ErlWorld, cell: int) -> None:
    """Make a cell empty. Subtract 1 from the number of plants if the cell has a plant."""
    world.counts[PLANTS] -= int(world.kind[cell] == PLANT)
    world.kind[cell] = EMPTY


@compiled
def add_carnivore(rules: Any, world: ErlWorld, cell: int) -> None:
    """Add a carnivore in a cell, up to `MAX_CARNIVORES`. Do nothing if `cell` is -1."""
    carnivore = world.counts[CARNIVORES]
    if cell >= 0 and carnivore < MAX_CARNIVORES:
        world.kind[cell] = CARNIVORE
        world.occupant[cell] = carnivore
        world.carnivore_position[carnivore] = cell
        world.carnivore_energy[carnivore] = INITIAL_CARNIVORE_ENERGY
        world.carnivore_health[carnivore] = 1.0
        world.counts[CARNIVORES] += 1


@compiled
def step_carnivore(rules: Any, world: ErlWorld, carnivore: int) -> None:
    """Move a carnivore by one cell toward the nearest visible prey, or in a random direction.

    The carnivore bites an agent or eats a corpse in the next cell, and reproduces at full energy.
    """
    draws = draw_uniforms(world)
    direction = int(draws[0] * np.float32(4))
    nearest_distance = CARNIVORE_SIGHT + 1
    for candidate in range(4):
        distance = _find_prey_distance(rules, world, world.carnivore_position[carnivore], candidate)
        if distance < nearest_distance:
            direction = candidate
            nearest_distance = distance
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
            # The parent has an energy of 1/2 after the birth. `add_carnivore` gives the child 1/2.
            world.carnivore_energy[carnivore] = INITIAL_CARNIVORE_ENERGY
            add_carnivore(rules, world, old_cell)
    world.carnivore_energy[carnivore] -= rules.carnivore_cost_per_step


@compiled
def _find_prey_distance(rules: Any, world: ErlWorld, cell: int, direction: int) -> int:
    """Return the distance of the nearest agent or corpse in a direction, in cells.

    Returns `CARNIVORE_SIGHT` + 1 if none is in sight. An agent in a tree is not visible.
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
    """Replace each dead carnivore by a corpse. The last carnivore moves to the row of the dead one.

    The order is descending, so that the last carnivore has been checked before it changes its row.
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
