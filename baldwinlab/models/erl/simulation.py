"""Simulation of a population until it is extinct."""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import numpy as np

from baldwinlab.engine.jit import compiled, jit_entry_point
from baldwinlab.models.erl.agents import (
    place_founders,
    remove_dead_agents,
    reproduce,
    step_agent,
)
from baldwinlab.models.erl.world import (
    AGENTS,
    BORN,
    CARNIVORE_INTERVAL,
    CARNIVORES,
    DRAWN,
    STEP,
    ErlWorld,
    add_carnivore,
    draw_empty_cell,
    grow_plants,
    init_world,
    remove_dead_carnivores,
    step_carnivore,
)

# Indices of the totals: the number of births, and the sums over the steps of the numbers of agents
# and of carnivores.
BIRTHS, AGENT_STEPS, CARNIVORE_STEPS = range(3)
N_TOTALS: Final = 3


class Rules(NamedTuple):
    """Numbers of a world for compiled code, from the settings and the strategy of the model."""

    grid_size: int
    max_agents: int
    initial_plants: int
    sprouts_per_step: int
    growth_checks_per_step: int
    trees: int
    initial_carnivores: int
    plant_energy: float
    meat_energy: float
    cost_per_step: float
    initial_energy: float
    reproduction_threshold: float
    reproduction_cost: float
    healing_per_step: float
    wall_damage: float
    attack_damage: float
    bite_damage: float
    carnivore_meat_energy: float
    carnivore_cost_per_step: float
    mutation_rate: np.float32
    weight_range: np.float32
    positive_learning_rate: np.float32
    negative_learning_rate: np.float32
    learns: bool
    inherits: bool
    walks: bool


@jit_entry_point
def simulate_population(
    rules: Rules, world: ErlWorld, genomes: Any, max_steps: int, inputs: Any, totals: Any
) -> int:
    """Simulate a population and return the number of steps that it survives.

    - `world`: all its arrays are overwritten.
    - `genomes` (founders, bits): bits of the founders.
    - `inputs` (inputs,): scratch.
    - `totals` (3,): output, by `BIRTHS`, `AGENT_STEPS` and `CARNIVORE_STEPS`.
    """
    init_world(rules, world)
    place_founders(rules, world, genomes)
    step = 0
    while step < max_steps and world.counts[AGENTS] > 0:
        world.counts[STEP] = step + 1
        world.counts[DRAWN] = 0
        step_world(rules, world, inputs)
        totals[AGENT_STEPS] += world.counts[AGENTS]
        totals[CARNIVORE_STEPS] += world.counts[CARNIVORES]
        # The step in which the last agent dies does not count.
        step += int(world.counts[AGENTS] > 0)
    totals[BIRTHS] = world.counts[BORN]
    return step


@compiled
def step_world(rules: Rules, world: ErlWorld, inputs: Any) -> None:
    """Simulate one step: plants, agents, carnivores, deaths, then births."""
    grow_plants(rules, world)
    if world.counts[STEP] % CARNIVORE_INTERVAL == 0:
        add_carnivore(rules, world, draw_empty_cell(rules, world))
    for agent in range(world.counts[AGENTS]):
        if world.health[agent] > 0.0:
            step_agent(rules, world, agent, inputs)
            world.energy[agent] -= rules.cost_per_step
    for carnivore in range(world.counts[CARNIVORES]):
        if world.carnivore_health[carnivore] > 0.0:
            step_carnivore(rules, world, carnivore)
    remove_dead_carnivores(world)
    remove_dead_agents(world)
    for agent in range(world.counts[AGENTS]):
        world.health[agent] = min(1.0, world.health[agent] + rules.healing_per_step)
        reproduce(rules, world, agent)
