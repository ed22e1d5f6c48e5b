"""Test carnivores, the state of cells and starvation."""

from __future__ import annotations

import numpy as np
import pytest

from baldwinlab.evolution import GenerationKey
from baldwinlab.models.erl_agents import remove_dead_agents
from baldwinlab.models.erl_populations import ErlPopulations
from baldwinlab.models.erl_world import (
    AGENT,
    AGENTS,
    CARNIVORE,
    CARNIVORES,
    CORPSE,
    EMPTY,
    PLANT,
    PLANTS,
    TREE,
    add_carnivore,
    step_carnivore,
)
from tests.models.erl_worlds import SMALL, make_empty_world, put_agent, simulate_world


def test_a_carnivore_bites_visible_agents_but_no_agent_in_a_tree() -> None:
    rules, world, _ = make_empty_world(bite_damage=0.5)
    agent = put_agent(rules, world, 20 * 10 + 12)
    add_carnivore(rules, world, 20 * 10 + 10)
    step_carnivore(rules, world, 0)
    assert world.carnivore_position[0] == 20 * 10 + 11 and world.health[agent] == 1
    step_carnivore(rules, world, 0)
    assert world.health[agent] == pytest.approx(1 - rules.bite_damage)
    step_carnivore(rules, world, 0)
    remove_dead_agents(world)
    assert world.counts[AGENTS] == 0 and world.kind[20 * 10 + 12] == CORPSE
    full = world.carnivore_energy[0]
    step_carnivore(rules, world, 0)
    assert world.carnivore_energy[0] == pytest.approx(
        full + rules.carnivore_meat_energy - rules.carnivore_cost_per_step
    )
    world.kind[20 * 10 + 14] = TREE
    safe = put_agent(rules, world, 20 * 3 + 3)
    world.kind[20 * 3 + 3] = EMPTY
    world.kind[20 * 10 + 14] = TREE
    world.position[safe] = 20 * 10 + 14
    world.occupant[20 * 10 + 14] = safe
    for _ in range(30):
        step_carnivore(rules, world, 0)
    assert world.health[safe] == 1


@pytest.mark.parametrize("strategy", ["ERL", "B"])
def test_cells_agree_with_the_positions_of_agents_and_carnivores(strategy: str) -> None:
    _, world, _ = simulate_world(strategy)
    agents = int(world.counts[AGENTS])
    carnivores = int(world.counts[CARNIVORES])
    assert agents > 3
    np.testing.assert_array_equal(world.occupant[world.position[:agents]], np.arange(agents))
    np.testing.assert_array_equal(
        world.occupant[world.carnivore_position[:carnivores]], np.arange(carnivores)
    )
    assert (
        set(world.kind[world.position[:agents]].tolist()) <= {AGENT, TREE}
        and (world.kind[world.carnivore_position[:carnivores]] == CARNIVORE).all()
    )
    assert (world.kind == PLANT).sum() == world.counts[PLANTS] and (
        world.occupant >= 0
    ).sum() == agents + carnivores
    assert (
        (world.energy[:agents] > 0).all()
        and (world.energy <= 1).all()
        and (world.health <= 1).all()
    )


def test_without_food_all_agents_starve_at_the_expected_time() -> None:
    """An energy of 0.4 and a cost of 0.01 per step give 40 steps."""
    model = ErlPopulations(
        **SMALL
        | {"initial_plants": 0, "sprouts_per_step": 0, "initial_carnivores": 0, "max_steps": 100},
        cost_per_step=0.01,
        plant_energy=0.0,
        meat_energy=0.0,
        wall_damage=0.0,
        attack_damage=0.0,
    )
    results = model.simulate(3, [0], 0, model.founders(1, GenerationKey(3, 0, 0))[None])
    assert 39 <= results.energy.item() <= 40 and results.records["extinct"].item() == 1
