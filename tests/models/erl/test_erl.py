"""Test populations without generations: learning, inheritance, actions and the state of cells."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import xarray as xr

import baldwinlab as bl
from baldwinlab.api.checks import check_part
from baldwinlab.evolution import GenerationKey
from baldwinlab.experiment import ExperimentError, assign
from baldwinlab.models.erl.agents import (
    BITS,
    INPUTS,
    add_agent,
    decode_weight,
    place_founders,
    reinforce,
    remove_dead_agents,
    reproduce,
    sense,
    step_agent,
)
from baldwinlab.models.erl.model import ErlPopulations, step_world
from baldwinlab.models.erl.world import (
    AGENT,
    AGENTS,
    CARNIVORE,
    CARNIVORES,
    CORPSE,
    DRAWN,
    EMPTY,
    KINDS,
    PLANT,
    PLANTS,
    STEP,
    TREE,
    WALL,
    ErlWorld,
    add_carnivore,
    add_plant,
    init_world,
    step_carnivore,
)
from baldwinlab.simulation.simulate import simulate_histories

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
SET = [
    "record.genome_every=1",
    *(f"erl_populations.{name}={value}" for name, value in SMALL.items()),
]
EAST = 1


def empty_world(**fields: Any) -> tuple[Any, ErlWorld, npt.NDArray[np.float32]]:
    """Return rules, a world with walls only, and scratch."""
    model = ErlPopulations(
        **SMALL
        | {"initial_plants": 0, "trees": 0, "initial_carnivores": 0, "sprouts_per_step": 0}
        | fields
    )
    rules = model.rules()
    world = model.world(1, 0, 0, 0)
    init_world(rules, world)
    return rules, world, np.zeros(INPUTS, np.float32)


def put_agent(rules: Any, world: ErlWorld, cell: int, bits: int = 0) -> int:
    world.bits[world.counts[AGENTS]] = bits
    add_agent(rules, world, cell)
    return int(world.counts[AGENTS]) - 1


def set_direction(world: ErlWorld, agent: int, direction: int) -> None:
    """Set the biases of the action network so that it almost certainly chooses a direction."""
    world.action_weights[agent] = 0
    world.action_weights[agent, :, -1] = [
        15 if direction & 2 else -15,
        15 if direction & 1 else -15,
    ]


def test_a_step_of_crbp_has_the_values_computed_by_hand() -> None:
    """With weights of 0, p = 1/2, so a weight changes by rate x (target - 1/2) / 4."""
    inputs = np.zeros(INPUTS, np.float32)
    inputs[3] = 1
    inputs[-1] = 0.5
    for action, is_better, rate, expected in [
        (1, True, 0.3, 0.0375),
        (0, True, 0.3, -0.0375),
        (1, False, 0.03, -0.00375),
        (0, False, 0.03, 0.00375),
    ]:
        weights = np.zeros(INPUTS, np.float32)
        reinforce(weights, inputs, action, is_better, np.float32(rate))
        assert weights[3] == pytest.approx(expected, rel=1e-6) and weights[-1] == pytest.approx(
            expected / 2, rel=1e-6
        )
        assert (weights[inputs == 0] == 0).all()


def test_an_improvement_makes_the_last_action_more_likely() -> None:
    rules, world, inputs = empty_world()
    agent = put_agent(rules, world, 210)
    world.evaluation_weights[agent] = 0
    world.action_weights[agent] = 0
    # The evaluation increases with energy.
    world.evaluation_weights[agent, 4 * KINDS + 1] = 10
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


def simulated_world(
    strategy: str, steps: int = 80
) -> tuple[Any, ErlWorld, npt.NDArray[np.float32]]:
    """Return a population after a number of steps, with the genomes of its founders."""
    model = ErlPopulations(**SMALL, strategy=strategy)
    rules = model.rules()
    world = model.world(2, 0, 0, 0)
    inputs = np.zeros(INPUTS, np.float32)
    genomes = model.founders(1, GenerationKey(2, 0, 0)).reshape(-1, BITS)
    init_world(rules, world)
    place_founders(rules, world, genomes)
    for step in range(steps):
        world.counts[STEP] = step + 1
        world.counts[DRAWN] = 0
        step_world(rules, world, inputs)
    return rules, world, genomes


@pytest.mark.parametrize("strategy", ["ERL", "E", "L", "F"])
def test_evaluation_networks_do_not_change_and_action_networks_change_only_with_learning(
    strategy: str,
) -> None:
    rules, world, _ = simulated_world(strategy)
    agents = int(world.counts[AGENTS])
    assert agents > 3
    learned = 0
    for agent in range(agents):
        newborn_weights = [
            decode_weight(rules, world.bits[agent], number) for number in range(3 * INPUTS)
        ]
        np.testing.assert_array_equal(world.evaluation_weights[agent], newborn_weights[:INPUTS])
        learned += not np.array_equal(world.action_weights[agent].ravel(), newborn_weights[INPUTS:])
    assert learned > 3 if strategy in ("ERL", "L") else learned == 0


def test_learned_weights_are_not_inherited() -> None:
    """Without mutation, a child has the bits of its parents, although they have learned."""
    model = ErlPopulations(**SMALL, mutation_rate=0.0, max_steps=300)
    genomes = model.founders(1, GenerationKey(2, 0, 0))
    before = genomes.copy()
    results = model.simulate(2, [0], 0, genomes[None])
    np.testing.assert_array_equal(genomes, before)
    assert results.learned is None and results.records["born"].item() > 10
    rules, world, _ = empty_world(mutation_rate=0.0)
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
    rules, world, _ = empty_world(mutation_rate=0.0, grid_size=60, max_agents=1000)
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
    assert world.bits[child].mean() == pytest.approx(0.1, abs=4 * np.sqrt(0.09 / BITS))


def test_without_heredity_the_bits_of_newborns_are_random() -> None:
    rules, world, _ = empty_world(strategy="L")
    agent = put_agent(rules, world, 210, 1)
    world.energy[agent] = 1
    reproduce(rules, world, agent)
    assert world.bits[1].mean() == pytest.approx(0.5, abs=4 * 0.5 / math.sqrt(BITS))


def test_carnivores_have_no_genome() -> None:
    assert {
        name
        for name in ErlWorld._fields
        if len(getattr(ErlPopulations(**SMALL).world(0, 0, 0, 0), name)) == 200
    } == {
        "carnivore_position",
        "carnivore_energy",
        "carnivore_health",
    }, "they have only a position, energy and health"


def test_an_agent_senses_the_nearest_of_each_kind_by_direction() -> None:
    rules, world, inputs = empty_world()
    agent = put_agent(rules, world, 20 * 10 + 10)
    add_plant(rules, world, 20 * 10 + 11)
    add_plant(rules, world, 20 * 10 + 13)
    world.kind[20 * 6 + 10] = TREE
    world.energy[agent] = 0.25
    sense(rules, world, agent, inputs)
    sensed = {int(number): float(inputs[number]) for number in np.flatnonzero(inputs)}
    assert sensed == {0 * KINDS + TREE: 0.5, EAST * KINDS + PLANT: 1.0, 24: 1.0, 25: 0.25, 27: 1.0}
    assert put_agent(rules, world, 20 * 10 + 18) == 1
    sense(rules, world, 1, inputs)
    assert inputs[EAST * KINDS + WALL] == 1


def test_an_agent_eats_enters_trees_attacks_and_is_hurt_by_walls() -> None:
    rules, world, inputs = empty_world()
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


def test_a_carnivore_bites_visible_agents_but_no_agent_in_a_tree() -> None:
    rules, world, _ = empty_world(bite_damage=0.5)
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
    _, world, _ = simulated_world(strategy)
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


def test_a_population_is_bit_identical_in_a_batch() -> None:
    small = assign(bl.load("erl-populations"), [*SET, "erl_populations.max_steps=200"])
    for run, history in enumerate(simulate_histories(small, 4, [0, 1])):
        assert history.dataset().equals(bl.simulate(small, seed=4, run=run))


def test_measures_equal_the_records() -> None:
    small = assign(bl.load("erl-populations"), [*SET, "erl_populations.max_steps=50"])
    run = bl.simulate(small, seed=4).expand_dims("run")
    measured = {
        name: xr.DataArray(measure.of(run)).item()
        for name, measure in ErlPopulations.measures.items()
    }
    assert measured == {
        "survived": run.energy.item(), "extinct": run.extinct.item(),
        "born": run.born.item(), "living": run.living.item(),
    }  # fmt: skip


def test_populations_of_the_same_founders_have_different_histories() -> None:
    model = ErlPopulations(**SMALL, max_steps=100)
    founders = np.tile(model.founders(1, GenerationKey(4, 0, 0)), (2, 1, 1))
    n_agents = model.simulate(4, [0], 0, founders[None]).records["living"]
    assert n_agents[0, 0] != n_agents[0, 1]


def test_the_part_passes_all_checks() -> None:
    assert [finding for finding in check_part(ErlPopulations) if finding.holds is False] == []


def test_the_settings_for_checks_have_births_and_deaths() -> None:
    model = ErlPopulations(**ErlPopulations.check_settings)
    results = model.simulate(
        11, [0, 1], 0, np.stack([model.founders(5, GenerationKey(11, run, 0)) for run in (0, 1)])
    )
    assert results.records["born"].min() > 0 and 0 < results.records["extinct"].sum() < 10
    assert ((results.records["living"] > 1) & (results.records["living"] < model.max_agents)).all()


def test_a_longer_run_has_the_same_beginning_and_surviving_populations_are_censored() -> None:
    ends = {}
    for steps in (200, 400):
        small = assign(bl.load("erl-populations"), [*SET, f"erl_populations.max_steps={steps}"])
        ends[steps] = xr.concat(
            [history.dataset() for history in simulate_histories(small, 4, range(6))], "run"
        )
    shorter, longer = (ends[steps].energy.values.ravel() for steps in (200, 400))
    assert longer.min() < 200 < longer.max()
    np.testing.assert_array_equal(shorter, np.minimum(longer, 200))
    censored = ErlPopulations.measures["survived"].censored
    assert censored is not None
    np.testing.assert_array_equal(censored(ends[400]), longer == 400)


def test_a_number_of_founders_above_the_maximum_population_is_refused() -> None:
    with pytest.raises(
        ExperimentError,
        match=r"erl_populations\.max_agents = 50 must be at least "
        r"erl_populations\.initial_agents = 100",
    ):
        assign(bl.load("erl-populations"), ["erl_populations.max_agents=50"])
