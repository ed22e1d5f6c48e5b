"""Populations without generations: how an agent learns, by hand; what stays as it was; and who has which genome."""

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
    bury,
    found,
    live_step,
    reinforce,
    sense,
    settle,
    weight,
)
from baldwinlab.models.erl.agents import breed as have_child
from baldwinlab.models.erl.model import ErlPopulations, step_of
from baldwinlab.models.erl.world import (
    AGENT,
    AGENTS,
    CARNIVORE,
    CORPSE,
    DRAWN,
    EMPTY,
    HUNTERS,
    KINDS,
    PLANT,
    PLANTS,
    STEP,
    TREE,
    WALL,
    World,
    hunt,
    hunter_at,
    plant,
    prepare,
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


def bare(**fields: Any) -> tuple[Any, World, npt.NDArray[np.float32]]:
    """A walled field with nothing on it; its rules; and scratch."""
    model = ErlPopulations(
        **SMALL
        | {"initial_plants": 0, "trees": 0, "initial_carnivores": 0, "sprouts_per_step": 0}
        | fields
    )
    rules, world = model.rules(), model.world(1, 0, 0, 0)
    prepare(rules, world)
    return rules, world, np.zeros(INPUTS, np.float32)


def put_agent(rules: Any, world: World, cell: int, bits: int = 0) -> int:
    world.bits[world.counts[AGENTS]] = bits
    settle(rules, world, cell)
    return int(world.counts[AGENTS]) - 1


def goes(world: World, agent: int, direction: int) -> None:
    """Let the action network say this direction almost surely, by its bias."""
    world.act[agent] = 0
    world.act[agent, :, -1] = [15 if direction & 2 else -15, 15 if direction & 1 else -15]


def test_a_step_of_crbp_is_that_of_the_hand() -> None:
    """One input of 1 and a weight of 0: p = 1/2, so that a weight changes by rate x (target - 1/2) / 4."""
    inputs = np.zeros(INPUTS, np.float32)
    inputs[3], inputs[-1] = 1, 0.5
    for said, better, rate, expected in [
        (1, True, 0.3, 0.0375),
        (0, True, 0.3, -0.0375),
        (1, False, 0.03, -0.00375),
        (0, False, 0.03, 0.00375),
    ]:
        weights = np.zeros(INPUTS, np.float32)
        reinforce(weights, inputs, said, better, np.float32(rate))
        assert weights[3] == pytest.approx(expected, rel=1e-6) and weights[-1] == pytest.approx(
            expected / 2, rel=1e-6
        )
        assert (weights[inputs == 0] == 0).all()


def test_what_was_done_is_made_likelier_by_what_is_better_now() -> None:
    rules, world, inputs = bare()
    agent = put_agent(rules, world, 210)
    world.judge[agent], world.act[agent] = 0, 0
    world.judge[agent, 4 * KINDS + 1] = 10  # energy is good
    live_step(rules, world, agent, inputs)
    said, before = world.said[agent].copy(), world.act[agent].copy()
    world.energy[agent] += 0.2
    live_step(rules, world, agent, inputs)
    change = (world.act[agent] - before)[:, -1]
    assert (np.sign(change) == np.where(said == 1, 1, -1)).all()
    expected = 0.3 * 0.25 * 0.5
    np.testing.assert_allclose(np.abs(change), expected, rtol=1e-5)
    said, before = world.said[agent].copy(), world.act[agent].copy()
    world.energy[agent] -= 0.3
    live_step(rules, world, agent, inputs)
    assert (np.sign((world.act[agent] - before)[:, -1]) == np.where(said == 1, -1, 1)).all(), (
        "and what was worse, less likely"
    )
    before = world.act[agent].copy()
    live_step(rules, world, agent, inputs)
    np.testing.assert_array_equal(
        world.act[agent], before, "where nothing became better or worse, nothing is learned"
    )


def lived(strategy: str, steps: int = 80) -> tuple[Any, World, npt.NDArray[np.float32]]:
    """A population that was born and has lived so long."""
    model = ErlPopulations(**SMALL, strategy=strategy)
    rules, world, inputs = model.rules(), model.world(2, 0, 0, 0), np.zeros(INPUTS, np.float32)
    genomes = model.founders(1, GenerationKey(2, 0, 0)).reshape(-1, BITS)
    prepare(rules, world)
    found(rules, world, genomes)
    for step in range(steps):
        world.counts[STEP], world.counts[DRAWN] = step + 1, 0
        step_of(rules, world, inputs)
    return rules, world, genomes


@pytest.mark.parametrize("strategy", ["ERL", "E", "L", "F"])
def test_evaluation_never_changes_in_life_and_actions_only_with_learning(strategy: str) -> None:
    rules, world, _ = lived(strategy)
    agents = int(world.counts[AGENTS])
    assert agents > 3
    learned = 0
    for agent in range(agents):
        born = [weight(rules, world.bits[agent], number) for number in range(3 * INPUTS)]
        np.testing.assert_array_equal(world.judge[agent], born[:INPUTS])
        learned += not np.array_equal(world.act[agent].ravel(), born[INPUTS:])
    assert learned > 3 if strategy in ("ERL", "L") else learned == 0


def test_what_is_learned_stays_out_of_the_genome() -> None:
    """Without mutation, each bit of everybody is a founder's bit of that place; with learning off or on."""
    model = ErlPopulations(**SMALL, mutation_rate=0.0, max_steps=300)
    genomes = model.founders(1, GenerationKey(2, 0, 0))
    before = genomes.copy()
    lives = model.simulate(2, [0], 0, genomes[None])
    np.testing.assert_array_equal(genomes, before)
    assert lives.learned is None and lives.records["born"].item() > 10
    rules, world, _ = bare(mutation_rate=0.0)
    parents = [put_agent(rules, world, 210, 1), put_agent(rules, world, 212, 1)]
    world.energy[parents] = 1
    world.act[parents[0]] += 5
    have_child(rules, world, parents[0])
    assert (
        world.counts[AGENTS] == 3
        and (world.bits[2] == 1).all()
        and (world.act[2] == rules.weight_range).all()
    )


def test_a_child_has_bits_of_both_parents_between_two_cuts_and_flips_at_the_rate_of_mutation() -> (
    None
):
    rules, world, _ = bare(mutation_rate=0.0, grid_size=60, max_agents=1000)
    one, other = put_agent(rules, world, 60 * 30 + 30, 0), put_agent(rules, world, 60 * 30 + 33, 1)
    shares = []
    for _ in range(60):
        world.energy[one] = 1
        have_child(rules, world, one)
        child = int(world.counts[AGENTS]) - 1
        assert (np.diff(world.bits[child]) != 0).sum() <= 2
        shares.append(world.bits[child].mean())
        world.health[child] = 0
        bury(world)
        world.kind[world.kind == CORPSE] = EMPTY
    assert np.mean(shares) == pytest.approx(1 / 3, abs=4 * np.sqrt(1 / 18 / 60)), (
        "the mean distance of two cuts"
    )
    rules = rules._replace(mutation_rate=np.float32(0.1))
    world.energy[one] = 1
    world.place[other] = 60 * 2 + 2  # out of reach
    have_child(rules, world, one)
    assert world.bits[child].mean() == pytest.approx(0.1, abs=4 * np.sqrt(0.09 / BITS))


def test_without_heredity_a_newborn_s_bits_are_coins() -> None:
    rules, world, _ = bare(strategy="L")
    agent = put_agent(rules, world, 210, 1)
    world.energy[agent] = 1
    have_child(rules, world, agent)
    assert world.bits[1].mean() == pytest.approx(0.5, abs=4 * 0.5 / math.sqrt(BITS))


def test_carnivores_have_no_genome() -> None:
    assert {
        name
        for name in World._fields
        if len(getattr(ErlPopulations(**SMALL).world(0, 0, 0, 0), name)) == 200
    } == {
        "lair",
        "hunger",
        "wounds",
    }, "only where they are, and how hungry and hurt"


def test_an_agent_senses_the_nearest_of_each_kind_by_direction() -> None:
    rules, world, inputs = bare()
    agent = put_agent(rules, world, 20 * 10 + 10)
    plant(rules, world, 20 * 10 + 11)
    plant(rules, world, 20 * 10 + 13)
    world.kind[20 * 6 + 10] = TREE
    world.energy[agent] = 0.25
    sense(rules, world, agent, inputs)
    seen = {int(number): float(inputs[number]) for number in np.flatnonzero(inputs)}
    assert seen == {0 * KINDS + TREE: 0.5, EAST * KINDS + PLANT: 1.0, 24: 1.0, 25: 0.25, 27: 1.0}
    assert put_agent(rules, world, 20 * 10 + 18) == 1
    sense(rules, world, 1, inputs)
    assert inputs[EAST * KINDS + WALL] == 1


def test_eating_climbing_hitting_and_bumping() -> None:
    rules, world, inputs = bare()
    agent = put_agent(rules, world, 20 * 10 + 10)
    plant(rules, world, 20 * 10 + 11)
    world.kind[20 * 10 + 12] = TREE
    neighbour = put_agent(rules, world, 20 * 10 + 13)
    goes(world, agent, EAST)
    live_step(rules, world, agent, inputs)
    assert (
        world.energy[agent] == pytest.approx(rules.initial_energy + rules.plant_energy)
        and world.counts[PLANTS] == 0
    )
    goes(world, agent, EAST)
    live_step(rules, world, agent, inputs)
    assert (
        world.place[agent] == 20 * 10 + 12
        and world.kind[20 * 10 + 11] == EMPTY
        and world.kind[20 * 10 + 12] == TREE
    )
    goes(world, agent, EAST)
    live_step(rules, world, agent, inputs)
    assert world.place[agent] == 20 * 10 + 12 and world.health[neighbour] == pytest.approx(
        1 - rules.attack_damage
    )
    alone = put_agent(rules, world, 20 * 5 + 18)
    goes(world, alone, EAST)
    live_step(rules, world, alone, inputs)
    assert world.health[alone] == pytest.approx(1 - rules.wall_damage)


def test_a_carnivore_bites_whom_it_sees_and_nobody_in_a_tree() -> None:
    rules, world, _ = bare(bite_damage=0.5)
    agent = put_agent(rules, world, 20 * 10 + 12)
    hunter_at(rules, world, 20 * 10 + 10)
    hunt(rules, world, 0)
    assert world.lair[0] == 20 * 10 + 11 and world.health[agent] == 1
    hunt(rules, world, 0)
    assert world.health[agent] == pytest.approx(1 - rules.bite_damage)
    hunt(rules, world, 0)
    bury(world)
    assert world.counts[AGENTS] == 0 and world.kind[20 * 10 + 12] == CORPSE
    full = world.hunger[0]
    hunt(rules, world, 0)
    assert world.hunger[0] == pytest.approx(
        full + rules.carnivore_meat_energy - rules.carnivore_cost_per_step
    )
    world.kind[20 * 10 + 14] = TREE
    safe = put_agent(rules, world, 20 * 3 + 3)
    world.kind[20 * 3 + 3], world.kind[20 * 10 + 14] = EMPTY, TREE
    world.place[safe], world.who[20 * 10 + 14] = 20 * 10 + 14, safe
    for _ in range(30):
        hunt(rules, world, 0)
    assert world.health[safe] == 1


@pytest.mark.parametrize("strategy", ["ERL", "B"])
def test_cells_agents_and_carnivores_agree_at_every_time(strategy: str) -> None:
    _, world, _ = lived(strategy)
    agents, hunters = int(world.counts[AGENTS]), int(world.counts[HUNTERS])
    assert agents > 3
    np.testing.assert_array_equal(world.who[world.place[:agents]], np.arange(agents))
    np.testing.assert_array_equal(world.who[world.lair[:hunters]], np.arange(hunters))
    assert (
        set(world.kind[world.place[:agents]].tolist()) <= {AGENT, TREE}
        and (world.kind[world.lair[:hunters]] == CARNIVORE).all()
    )
    assert (world.kind == PLANT).sum() == world.counts[PLANTS] and (
        world.who >= 0
    ).sum() == agents + hunters
    assert (
        (world.energy[:agents] > 0).all()
        and (world.energy <= 1).all()
        and (world.health <= 1).all()
    )


def test_where_nothing_is_eaten_everybody_starves_in_time() -> None:
    """Of 0.4 and 0.01 a step: 40 steps; nobody bites, bumps or eats."""
    hungry = ErlPopulations(
        **SMALL
        | {"initial_plants": 0, "sprouts_per_step": 0, "initial_carnivores": 0, "max_steps": 100},
        cost_per_step=0.01,
        plant_energy=0.0,
        meat_energy=0.0,
        wall_damage=0.0,
        attack_damage=0.0,
    )
    found_dead = hungry.simulate(3, [0], 0, hungry.founders(1, GenerationKey(3, 0, 0))[None])
    assert 39 <= found_dead.energy.item() <= 40 and found_dead.records["extinct"].item() == 1


def test_a_population_has_the_same_bits_alone_and_beside_others() -> None:
    small = assign(bl.load("erl-populations"), [*SET, "erl_populations.max_steps=200"])
    for run, history in enumerate(simulate_histories(small, 4, [0, 1])):
        assert history.dataset().equals(bl.simulate(small, seed=4, run=run))


def test_measures_are_what_is_recorded() -> None:
    small = assign(bl.load("erl-populations"), [*SET, "erl_populations.max_steps=50"])
    run = bl.simulate(small, seed=4).expand_dims("run")
    told = {
        name: xr.DataArray(measure.of(run)).item()
        for name, measure in ErlPopulations.measures.items()
    }
    assert told == {
        "survived": run.energy.item(), "extinct": run.extinct.item(), "born": run.born.item(), "living": run.living.item()
    }  # fmt: skip


def test_populations_of_the_same_founders_have_histories_of_their_own() -> None:
    model = ErlPopulations(**SMALL, max_steps=100)
    founders = np.tile(model.founders(1, GenerationKey(4, 0, 0)), (2, 1, 1))
    living = model.simulate(4, [0], 0, founders[None]).records["living"]
    assert living[0, 0] != living[0, 1]


def test_it_keeps_the_contract_of_parts() -> None:
    assert [one for one in check_part(ErlPopulations) if one.holds is False] == []


def test_the_lives_that_are_checked_have_births_and_deaths() -> None:
    checked = ErlPopulations(**ErlPopulations.check_settings)
    lives = checked.simulate(
        11, [0, 1], 0, np.stack([checked.founders(5, GenerationKey(11, run, 0)) for run in (0, 1)])
    )
    assert lives.records["born"].min() > 0 and 0 < lives.records["extinct"].sum() < 10
    assert ((lives.records["living"] > 1) & (lives.records["living"] < checked.max_agents)).all()


def test_who_is_followed_for_longer_lives_the_same_until_then_and_who_lives_on_is_censored() -> (
    None
):
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


def test_more_founders_than_there_may_be_agents_are_refused() -> None:
    with pytest.raises(
        ExperimentError,
        match=r"erl_populations\.max_agents = 50 must be at least erl_populations\.initial_agents = 100",
    ):
        assign(bl.load("erl-populations"), ["erl_populations.max_agents=50"])
