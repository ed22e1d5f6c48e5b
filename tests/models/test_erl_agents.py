"""Test agents: learning, inheritance, senses and actions."""

from __future__ import annotations

import math

import numpy as np
import pytest

from baldwinlab.evolution import GenerationKey
from baldwinlab.models.erl_agents import (
    N_BITS,
    N_INPUTS,
    decode_weight,
    reinforce,
    remove_dead_agents,
    reproduce,
    sense,
    step_agent,
)
from baldwinlab.models.erl_populations import ErlPopulations
from baldwinlab.models.erl_world import (
    AGENTS,
    CORPSE,
    EMPTY,
    N_SENSED_KINDS,
    PLANT,
    PLANTS,
    TREE,
    WALL,
    add_plant,
)
from tests.models.erl_worlds import (
    EAST,
    SMALL,
    make_empty_world,
    put_agent,
    set_direction,
    simulate_world,
)


def test_a_step_of_crbp_has_the_values_computed_by_hand() -> None:
    """With weights of 0, p = 1/2, so a weight changes by rate x (target - 1/2) / 4."""
    inputs = np.zeros(N_INPUTS, np.float32)
    inputs[3] = 1
    inputs[-1] = 0.5
    for action, is_better, rate, expected in [
        (1, True, 0.3, 0.0375),
        (0, True, 0.3, -0.0375),
        (1, False, 0.03, -0.00375),
        (0, False, 0.03, 0.00375),
    ]:
        weights = np.zeros(N_INPUTS, np.float32)
        reinforce(weights, inputs, action, is_better, np.float32(rate))
        assert weights[3] == pytest.approx(expected, rel=1e-6) and weights[-1] == pytest.approx(
            expected / 2, rel=1e-6
        )
        assert (weights[inputs == 0] == 0).all()


def test_an_improvement_makes_the_last_action_more_likely() -> None:
    rules, world, inputs = make_empty_world()
    agent = put_agent(rules, world, 210)
    world.evaluation_weights[agent] = 0
    world.action_weights[agent] = 0
    # The evaluation increases with energy.
    world.evaluation_weights[agent, 4 * N_SENSED_KINDS + 1] = 10
    step_agent(rules, world, agent, inputs)
    action = world.last_action[agent].copy()
    before = world.action_weights[agent].copy()
    world.energy[agent] += 0.2
    step_agent(rules, world, agent, inputs)
    change = (world.action_weights[agent] - before)[:, -1]
    assert (np.sign(change) == np.where(action == 1, 1, -1)).all()
    expected = 0.3 * 0.25 * 0.5
    np.testing.assert_allclose(np.abs(change), expected, rtol=1e-5)
    action = world.last_action[agent].copy()
    before = world.action_weights[agent].copy()
    world.energy[agent] -= 0.3
    step_agent(rules, world, agent, inputs)
    assert (
        np.sign((world.action_weights[agent] - before)[:, -1]) == np.where(action == 1, -1, 1)
    ).all(), "a deterioration makes it less likely"
    before = world.action_weights[agent].copy()
    step_agent(rules, world, agent, inputs)
    np.testing.assert_array_equal(
        world.action_weights[agent],
        before,
        "without a change, nothing is learned",
    )


@pytest.mark.parametrize("strategy", ["ERL", "E", "L", "F"])
def test_evaluation_networks_do_not_change_and_action_networks_change_only_with_learning(
    strategy: str,
) -> None:
    rules, world, _ = simulate_world(strategy)
    agents = int(world.counts[AGENTS])
    assert agents > 3
    learned = 0
    for agent in range(agents):
        newborn_weights = [
            decode_weight(rules, world.bits[agent], number) for number in range(3 * N_INPUTS)
        ]
        np.testing.assert_array_equal(world.evaluation_weights[agent], newborn_weights[:N_INPUTS])
        learned += not np.array_equal(
            world.action_weights[agent].ravel(), newborn_weights[N_INPUTS:]
        )
    assert learned > 3 if strategy in ("ERL", "L") else learned == 0


def test_learned_weights_are_not_inherited() -> None:
    """Without mutation, a child has the bits of its parents, although they have learned."""
    model = ErlPopulations(**SMALL, mutation_rate=0.0, max_steps=300)
    genomes = model.founders(1, GenerationKey(2, 0, 0))
    before = genomes.copy()
    results = model.simulate(2, [0], 0, genomes[None])
    np.testing.assert_array_equal(genomes, before)
    assert results.learned is None and results.records["born"].item() > 10
    rules, world, _ = make_empty_world(mutation_rate=0.0)
    parents = [put_agent(rules, world, 210, 1), put_agent(rules, world, 212, 1)]
    world.energy[parents] = 1
    world.action_weights[parents[0]] += 5
    reproduce(rules, world, parents[0])
    assert (
        world.counts[AGENTS] == 3
        and (world.bits[2] == 1).all()
        and (world.action_weights[2] == rules.weight_range).all()
    )


def test_children_have_bits_of_both_parents_with_two_cuts_and_mutations() -> None:
    rules, world, _ = make_empty_world(mutation_rate=0.0, grid_size=60, max_agents=1000)
    first = put_agent(rules, world, 60 * 30 + 30, 0)
    second = put_agent(rules, world, 60 * 30 + 33, 1)
    shares = []
    for _ in range(60):
        world.energy[first] = 1
        reproduce(rules, world, first)
        child = int(world.counts[AGENTS]) - 1
        assert (np.diff(world.bits[child]) != 0).sum() <= 2
        shares.append(world.bits[child].mean())
        world.health[child] = 0
        remove_dead_agents(world)
        world.kind[world.kind == CORPSE] = EMPTY
    assert np.mean(shares) == pytest.approx(1 / 3, abs=4 * np.sqrt(1 / 18 / 60)), (
        "1/3 is the mean distance of two cuts"
    )
    rules = rules._replace(mutation_rate=np.float32(0.1))
    world.energy[first] = 1
    # Move the second parent out of reach.
    world.position[second] = 60 * 2 + 2
    reproduce(rules, world, first)
    assert world.bits[child].mean() == pytest.approx(0.1, abs=4 * np.sqrt(0.09 / N_BITS))


def test_without_heredity_the_bits_of_newborns_are_random() -> None:
    rules, world, _ = make_empty_world(strategy="L")
    agent = put_agent(rules, world, 210, 1)
    world.energy[agent] = 1
    reproduce(rules, world, agent)
    assert world.bits[1].mean() == pytest.approx(0.5, abs=4 * 0.5 / math.sqrt(N_BITS))


def test_an_agent_senses_the_nearest_of_each_kind_by_direction() -> None:
    rules, world, inputs = make_empty_world()
    agent = put_agent(rules, world, 20 * 10 + 10)
    add_plant(rules, world, 20 * 10 + 11)
    add_plant(rules, world, 20 * 10 + 13)
    world.kind[20 * 6 + 10] = TREE
    world.energy[agent] = 0.25
    sense(rules, world, agent, inputs)
    sensed = {int(number): float(inputs[number]) for number in np.flatnonzero(inputs)}
    assert sensed == {
        0 * N_SENSED_KINDS + TREE: 0.5,
        EAST * N_SENSED_KINDS + PLANT: 1.0,
        24: 1.0,
        25: 0.25,
        27: 1.0,
    }
    assert put_agent(rules, world, 20 * 10 + 18) == 1
    sense(rules, world, 1, inputs)
    assert inputs[EAST * N_SENSED_KINDS + WALL] == 1


def test_an_agent_eats_enters_trees_attacks_and_is_hurt_by_walls() -> None:
    rules, world, inputs = make_empty_world()
    agent = put_agent(rules, world, 20 * 10 + 10)
    add_plant(rules, world, 20 * 10 + 11)
    world.kind[20 * 10 + 12] = TREE
    neighbor = put_agent(rules, world, 20 * 10 + 13)
    set_direction(world, agent, EAST)
    step_agent(rules, world, agent, inputs)
    assert (
        world.energy[agent] == pytest.approx(rules.initial_energy + rules.plant_energy)
        and world.counts[PLANTS] == 0
    )
    set_direction(world, agent, EAST)
    step_agent(rules, world, agent, inputs)
    assert (
        world.position[agent] == 20 * 10 + 12
        and world.kind[20 * 10 + 11] == EMPTY
        and world.kind[20 * 10 + 12] == TREE
    )
    set_direction(world, agent, EAST)
    step_agent(rules, world, agent, inputs)
    assert world.position[agent] == 20 * 10 + 12 and world.health[neighbor] == pytest.approx(
        1 - rules.attack_damage
    )
    agent_at_wall = put_agent(rules, world, 20 * 5 + 18)
    set_direction(world, agent_at_wall, EAST)
    step_agent(rules, world, agent_at_wall, inputs)
    assert world.health[agent_at_wall] == pytest.approx(1 - rules.wall_damage)
