"""Senses, networks, learning, actions and reproduction of an agent of `erl_populations.py`.

A genome has 336 bits: 84 weights of four bits each. The evaluation network has the first 28
weights, the action network has the other 56. The evaluation network computes an evaluation from the
inputs, in (0, 1). If the evaluation rises from one step to the next, the previous action becomes
more likely. If it falls, the opposite action becomes more likely (complementary reinforcement
backpropagation, CRBP). Learned weights are not inherited.

The inputs, the networks and the bits are from memory. The range of a weight and the interactions
between agents are our choice: the mate is the nearest agent within ten cells, crossover has two
cuts, and an agent has no child if no neighboring cell is empty.

References
----------
D. Ackley and M. Littman, "Generalization and scaling in reinforcement learning", NIPS 2 (1990), for
CRBP.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from baldwinlab.engine.arithmetic import sigmoid
from baldwinlab.engine.jit import compiled
from baldwinlab.engine.simd import ONE, ZERO
from baldwinlab.models.erl_world import (
    AGENT,
    AGENT_SIGHT,
    AGENTS,
    BORN,
    CARNIVORE,
    CORPSE,
    EMPTY,
    LEARNED,
    N_SENSED_KINDS,
    NO_NUMBER,
    PLANT,
    TREE,
    WALL,
    ErlWorld,
    clear_cell,
    draw_empty_cell,
    draw_uniforms,
    neighbor_cell,
)

# Number of inputs: six kinds of cells in four directions, health, energy, whether the agent is in a
# tree, and a bias.
N_INPUTS = 4 * N_SENSED_KINDS + 4
# Indices of the inputs that do not sense cells.
HEALTH_INPUT, ENERGY_INPUT, TREE_INPUT, BIAS_INPUT = range(4 * N_SENSED_KINDS, N_INPUTS)
N_OUTPUTS = 2
BITS_PER_WEIGHT: Final = 4
N_BITS: Final = BITS_PER_WEIGHT * N_INPUTS * (1 + N_OUTPUTS)
# Maximum distance of a mate, in cells.
MAX_MATE_DISTANCE: Final = 10


@compiled
def sense(rules: Any, world: ErlWorld, agent: int, inputs: Any) -> None:
    """Fill `inputs` [input].

    The first inputs [direction, kind] are the nearness of the nearest cell of each kind. Nearness
    is 1 for a neighboring cell, 0.5 for a cell at the distance `AGENT_SIGHT`, and 0 if no cell of
    the kind is in sight. A wall blocks the sight.
    """
    for number in range(N_INPUTS):
        inputs[number] = ZERO
    for direction in range(4):
        cell = world.position[agent]
        is_blocked = False
        for distance in range(AGENT_SIGHT):
            if not is_blocked:
                cell = neighbor_cell(rules, cell, direction)
                kind = int(world.kind[cell])
                is_blocked = kind == WALL
                number = direction * N_SENSED_KINDS + kind
                # A nearer cell of this kind has already set the input.
                if kind != EMPTY and inputs[number] == ZERO:
                    inputs[number] = np.float32(1.0 - distance / (2.0 * (AGENT_SIGHT - 1)))
    is_in_tree = world.kind[world.position[agent]] == TREE
    inputs[HEALTH_INPUT] = np.float32(world.health[agent])
    inputs[ENERGY_INPUT] = np.float32(world.energy[agent])
    inputs[TREE_INPUT] = ONE if is_in_tree else ZERO
    inputs[BIAS_INPUT] = ONE


@compiled
def activate(weights: Any, inputs: Any) -> Any:
    """Compute the activation of one output, in (0, 1), from its weights [input] and `inputs`."""
    total = ZERO
    for number in range(N_INPUTS):
        total += weights[number] * inputs[number]
    return sigmoid(total)


@compiled
def reinforce(weights: Any, inputs: Any, action: Any, is_better: bool, rate: Any) -> None:
    """Change the weights [input] of one output by one step of CRBP.

    `inputs` and `action` (0 or 1) are those of the previous step. If the evaluation has risen
    (`is_better`), the target is `action`, otherwise the opposite action.
    """
    activation = activate(weights, inputs)
    target = np.float32(action) if is_better else ONE - np.float32(action)
    change = rate * (target - activation) * activation * (ONE - activation)
    for number in range(N_INPUTS):
        weights[number] += change * inputs[number]


@compiled
def step_agent(rules: Any, world: ErlWorld, agent: int, inputs: Any) -> None:
    """Sense, learn from the last action, choose an action, and act. `inputs` is scratch."""
    draws = draw_uniforms(world)
    if rules.walks:
        random_direction = int(draws[0] * np.float32(4))
        _move_or_attack(rules, world, agent, random_direction)
        return
    sense(rules, world, agent, inputs)
    evaluation = activate(world.evaluation_weights[agent], inputs)
    has_acted = world.last_action[agent, 0] >= 0
    if rules.learns and has_acted and evaluation != world.last_evaluation[agent]:
        is_better = evaluation > world.last_evaluation[agent]
        for output in range(N_OUTPUTS):
            rate = rules.positive_learning_rate if is_better else rules.negative_learning_rate
            reinforce(
                world.action_weights[agent, output],
                world.last_inputs[agent],
                world.last_action[agent, output],
                is_better,
                rate,
            )
        world.counts[LEARNED] += 1
    for output in range(N_OUTPUTS):
        world.last_action[agent, output] = int(
            draws[output] < activate(world.action_weights[agent, output], inputs)
        )
    for number in range(N_INPUTS):
        world.last_inputs[agent, number] = inputs[number]
    world.last_evaluation[agent] = evaluation
    # The two actions are the bits of a direction: 0 north, 1 east, 2 south, 3 west.
    direction = 2 * int(world.last_action[agent, 0]) + int(world.last_action[agent, 1])
    _move_or_attack(rules, world, agent, direction)


@compiled
def _move_or_attack(rules: Any, world: ErlWorld, agent: int, direction: int) -> None:
    """Move the agent to the next cell and eat its content, or attack the occupant of the cell."""
    cell = neighbor_cell(rules, world.position[agent], direction)
    kind = world.kind[cell]
    occupant = world.occupant[cell]
    if kind == WALL:
        world.health[agent] -= rules.wall_damage
    elif kind == AGENT:
        world.health[occupant] -= rules.attack_damage
    elif kind == CARNIVORE:
        world.carnivore_health[occupant] -= rules.attack_damage
    # A plant, a corpse, an empty cell or a tree without an occupant: the agent moves there.
    elif kind != TREE or occupant == NO_NUMBER:
        gain = 0.0
        if kind == PLANT:
            gain = rules.plant_energy
        elif kind == CORPSE:
            gain = rules.meat_energy
        world.energy[agent] = min(1.0, world.energy[agent] + gain)
        leave_cell(world, agent)
        if kind != TREE:
            clear_cell(world, cell)
            world.kind[cell] = AGENT
        world.occupant[cell] = agent
        world.position[agent] = cell


@compiled
def leave_cell(world: ErlWorld, agent: int) -> None:
    """Remove the agent from its cell. A tree remains in the cell."""
    cell = world.position[agent]
    world.occupant[cell] = NO_NUMBER
    if world.kind[cell] == AGENT:
        world.kind[cell] = EMPTY


@compiled
def place_founders(rules: Any, world: ErlWorld, genomes: Any) -> None:
    """Add a founder for each genome [founder, bit], if a random empty cell is found."""
    for number in range(genomes.shape[0]):
        cell = draw_empty_cell(rules, world)
        if cell >= 0:
            for bit in range(N_BITS):
                world.bits[world.counts[AGENTS], bit] = int(genomes[number, bit] > ZERO)
            add_agent(rules, world, cell)


@compiled
def add_agent(rules: Any, world: ErlWorld, cell: int) -> None:
    """Add an agent in a cell. The first unused row of `world.bits` must have its genome."""
    agent = world.counts[AGENTS]
    world.counts[AGENTS] += 1
    world.kind[cell] = AGENT
    world.occupant[cell] = agent
    world.position[agent] = cell
    world.energy[agent] = rules.initial_energy
    world.health[agent] = 1.0
    world.last_action[agent, 0] = world.last_action[agent, 1] = -1
    for number in range(N_INPUTS):
        world.evaluation_weights[agent, number] = decode_weight(rules, world.bits[agent], number)
        for output in range(N_OUTPUTS):
            world.action_weights[agent, output, number] = decode_weight(
                rules, world.bits[agent], N_INPUTS * (1 + output) + number
            )


@compiled
def decode_weight(rules: Any, bits: Any, number: int) -> Any:
    """Return the weight with the index `number`: one of 16 values in [-range, range]."""
    value = 0
    for bit in range(BITS_PER_WEIGHT):
        value = 2 * value + int(bits[BITS_PER_WEIGHT * number + bit])
    max_value = 2**BITS_PER_WEIGHT - 1
    return rules.weight_range * np.float32(2 * value - max_value) / np.float32(max_value)


@compiled
def reproduce(rules: Any, world: ErlWorld, agent: int) -> None:
    """Add a child next to an agent if the agent has enough energy and a neighboring cell is empty.

    The parents are the agent and the nearest mate. Without a mate, the agent is the only parent. If
    the strategy does not inherit, the child has random bits.
    """
    child = world.counts[AGENTS]
    if world.energy[agent] < rules.reproduction_threshold or child == rules.max_agents:
        return
    # Take the first empty neighbor, clockwise from a random direction.
    cell = NO_NUMBER
    first_direction = int(draw_uniforms(world)[0] * np.float32(4))
    for turn in range(4):
        neighbor = neighbor_cell(rules, world.position[agent], (first_direction + turn) % 4)
        cell = neighbor if cell == NO_NUMBER and world.kind[neighbor] == EMPTY else cell
    if cell == NO_NUMBER:
        return
    if rules.inherits:
        _cross(rules, world, agent, _find_nearest_mate(rules, world, agent), child)
    else:
        # A call draws four random numbers, for four bits.
        for first_bit in range(0, N_BITS, 4):
            draws = draw_uniforms(world)
            for number in range(4):
                world.bits[child, first_bit + number] = int(draws[number] < np.float32(0.5))
    world.energy[agent] -= rules.reproduction_cost
    world.counts[BORN] += 1
    add_agent(rules, world, cell)


@compiled
def _find_nearest_mate(rules: Any, world: ErlWorld, agent: int) -> int:
    """Return the nearest other agent within `MAX_MATE_DISTANCE`, or `agent` if there is none."""
    mate = agent
    nearest_squared = MAX_MATE_DISTANCE * MAX_MATE_DISTANCE + 1
    x = world.position[agent] % rules.grid_size
    y = world.position[agent] // rules.grid_size
    for candidate in range(world.counts[AGENTS]):
        dx = world.position[candidate] % rules.grid_size - x
        dy = world.position[candidate] // rules.grid_size - y
        squared_distance = dx * dx + dy * dy
        if candidate != agent and squared_distance < nearest_squared:
            mate = candidate
            nearest_squared = squared_distance
    return mate


@compiled
def _cross(rules: Any, world: ErlWorld, first: int, second: int, child: int) -> None:
    """Write the bits of a child: the bits of `first`, and between two cuts the bits of `second`.

    Each bit can mutate.
    """
    draws = draw_uniforms(world)
    cuts = int(draws[0] * np.float32(N_BITS + 1)), int(draws[1] * np.float32(N_BITS + 1))
    for first_bit in range(0, N_BITS, 4):
        # A call draws four random numbers, one per bit.
        draws_of_bits = draw_uniforms(world)
        for number in range(4):
            bit = first_bit + number
            parent = second if min(cuts) <= bit < max(cuts) else first
            mutates = int(draws_of_bits[number] < rules.mutation_rate)
            world.bits[child, bit] = world.bits[parent, bit] ^ mutates


@compiled
def remove_dead_agents(world: ErlWorld) -> None:
    """Replace each agent without energy or health by a corpse.

    An agent in a tree leaves no corpse. The last agent moves to the row of the removed agent, so
    that the rows in use remain the first rows.
    """
    # The order is descending, so that the last agent has been checked before it changes its row.
    for agent in range(world.counts[AGENTS] - 1, -1, -1):
        if world.energy[agent] <= 0.0 or world.health[agent] <= 0.0:
            cell = world.position[agent]
            last = world.counts[AGENTS] - 1
            leave_cell(world, agent)
            if world.kind[cell] == EMPTY:
                world.kind[cell] = CORPSE
            if agent != last:
                _renumber(world, last, agent)
            world.counts[AGENTS] = last


@compiled
def _renumber(world: ErlWorld, old: int, new: int) -> None:
    """Move the data of an agent from row `old` to row `new`."""
    world.position[new] = world.position[old]
    world.energy[new] = world.energy[old]
    world.health[new] = world.health[old]
    world.last_evaluation[new] = world.last_evaluation[old]
    for bit in range(N_BITS):
        world.bits[new, bit] = world.bits[old, bit]
    for output in range(N_OUTPUTS):
        world.last_action[new, output] = world.last_action[old, output]
        for number in range(N_INPUTS):
            world.action_weights[new, output, number] = world.action_weights[old, output, number]
    for number in range(N_INPUTS):
        world.evaluation_weights[new, number] = world.evaluation_weights[old, number]
        world.last_inputs[new, number] = world.last_inputs[old, number]
    world.occupant[world.position[new]] = new
