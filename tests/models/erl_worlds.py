"""Small worlds of populations without generations."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from baldwinlab.evolution import GenerationKey
from baldwinlab.models.erl_agents import N_BITS, N_INPUTS, add_agent, place_founders
from baldwinlab.models.erl_populations import ErlPopulations, step_world
from baldwinlab.models.erl_world import AGENTS, DRAWN, STEP, ErlWorld, init_world

SMALL: dict[str, Any] = {
    "grid_size": 20,
    "initial_agents": 12,
    "max_agents": 40,
    "initial_plants": 60,
    "trees": 5,
    "initial_carnivores": 2,
    "sprouts_per_step": 3,
    "bite_damage": 0.1,
}


SETTINGS = [
    "record.genome_every=1",
    *(f"erl_populations.{name}={value}" for name, value in SMALL.items()),
]


EAST = 1


def make_empty_world(**fields: Any) -> tuple[Any, ErlWorld, npt.NDArray[np.float32]]:
    """Return the rules, a world with walls only, and scratch memory for inputs."""
    model = ErlPopulations(
        **SMALL
        | {"initial_plants": 0, "trees": 0, "initial_carnivores": 0, "sprouts_per_step": 0}
        | fields
    )
    rules = model.rules()
    world = model.world(1, 0, 0, 0)
    init_world(rules, world)
    return rules, world, np.zeros(N_INPUTS, np.float32)


def put_agent(rules: Any, world: ErlWorld, cell: int, bits: int = 0) -> int:
    world.bits[world.counts[AGENTS]] = bits
    add_agent(rules, world, cell)
    return int(world.counts[AGENTS]) - 1


def set_direction(world: ErlWorld, agent: int, direction: int) -> None:
    """Set the biases of the action network so that it almost certainly chooses `direction`."""
    world.action_weights[agent] = 0
    world.action_weights[agent, :, -1] = [
        15 if direction & 2 else -15,
        15 if direction & 1 else -15,
    ]


def simulate_world(strategy: str, steps: int = 80) -> tuple[Any, ErlWorld, npt.NDArray[np.float32]]:
    """Return the rules, the world after a number of steps, and genomes [founder, bit]."""
    model = ErlPopulations(**SMALL, strategy=strategy)
    rules = model.rules()
    world = model.world(2, 0, 0, 0)
    inputs = np.zeros(N_INPUTS, np.float32)
    genomes = model.founders(1, GenerationKey(2, 0, 0)).reshape(-1, N_BITS)
    init_world(rules, world)
    place_founders(rules, world, genomes)
    for step in range(steps):
        world.counts[STEP] = step + 1
        world.counts[DRAWN] = 0
        step_world(rules, world, inputs)
    return rules, world, genomes
