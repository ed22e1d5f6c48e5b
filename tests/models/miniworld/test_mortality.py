"""Test agents that die and are born during a lifetime, with features that call `die` and `bear`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, ClassVar

import numpy as np
import pytest

from baldwinlab.engine import poison
from baldwinlab.engine.phases import Array, per_run
from baldwinlab.experiment import Experiment, ExperimentError, registry
from baldwinlab.models.miniworld.backends.cpu import CpuBatch
from baldwinlab.models.miniworld.lifetimes import MiniWorldSimulator
from baldwinlab.parts import Mating, Variation, WorldFeature, bear, die
from baldwinlab.parts.breeding import copy_genome
from tests.models.miniworld.plain import draw_founders, simulate_steps
from tests.worlds import make_small_experiment

DEATH_STEP = 30
BIRTH_STEP = 50
STEPS = 80
SEED = 5


class Cull(WorldFeature, name="test-cull"):
    """Let the agents with odd numbers die in step 29."""

    allows_deaths: ClassVar[bool] = True

    @staticmethod
    def end_step(part: Any, model: Any, state: Any, world: int, step: int) -> None:
        if step == 29:
            for agent in range(1, model.agents, 2):
                die(model, state, world, agent)


class CullAndBear(WorldFeature, name="test-cull-and-bear"):
    """Let the agents with odd numbers die in step 29, and agent 0 have a child in step 49."""

    allows_deaths: ClassVar[bool] = True
    allows_births: ClassVar[bool] = True

    @staticmethod
    def end_step(part: Any, model: Any, state: Any, world: int, step: int) -> None:
        if step == 29:
            for agent in range(1, model.agents, 2):
                die(model, state, world, agent)
        if step == 49:
            bear(model, state, world, 0, 0)


class BearWithoutBirths(WorldFeature, name="test-bear-without-births"):
    """Let agent 1 die and agent 0 have a child, without a declaration of births."""

    allows_deaths: ClassVar[bool] = True

    @staticmethod
    def end_step(part: Any, model: Any, state: Any, world: int, step: int) -> None:
        die(model, state, world, 1)
        bear(model, state, world, 0, 0)


class Counted(Variation, name="test-counted"):
    """A variation whose children depend on the number of earlier children of the run."""

    arrays: ClassVar[Mapping[str, Array]] = {"n_children": per_run()}

    @staticmethod
    def vary(part: Any, mating: Mating) -> None:
        part.n_children[0] += 1
        copy_genome(mating.fitter, mating.child)


@pytest.fixture(autouse=True, scope="module")
def _unregister_features() -> Iterator[None]:
    yield
    for feature in (Cull, CullAndBear, BearWithoutBirths):
        registry.remove("world feature", feature.name)
    registry.remove("variation", Counted.name)


def make_experiment(condition: str, feature: str = "test-cull", **changes: Any) -> Experiment:
    return make_small_experiment(
        condition,
        **{"world": {"features": [feature]}, "lifetime": {"steps": STEPS}} | changes,
    )


def test_a_dead_agent_neither_moves_eats_nor_learns() -> None:
    experiment = make_experiment("evo+self-taught")
    genome = draw_founders(experiment)
    at_death = simulate_steps(experiment, genome, DEATH_STEP)
    at_end = simulate_steps(experiment, genome, STEPS)
    dead = slice(1, 6, 2)
    assert (at_end.state.alive[0, :6] == [1, 0, 1, 0, 1, 0]).all()
    for name in ("positions", "heading", "weights", "eaten_in_life"):
        before = getattr(at_death.state, name)[:, dead]
        after = getattr(at_end.state, name)[:, dead]
        np.testing.assert_array_equal(after, before, err_msg=name)
    alive = slice(0, 6, 2)
    for name in ("positions", "weights"):
        before = getattr(at_death.state, name)[:, alive]
        after = getattr(at_end.state, name)[:, alive]
        assert (before != after).any(axis=0).all()
    assert (at_end.state.positions[0, dead] < 0).all()


@pytest.mark.nightly
def test_a_dead_agent_is_not_sensed() -> None:
    experiment = make_experiment("evo", senses={"kinds": ["neighbours"], "visual_radius": 40})
    start = {"x": 60, "y": 50, "radius": 0}
    crowded = experiment.replace(
        world={"start": start, "food": []}, population={"size": 2}, network={"hidden": []}
    )
    alive = CpuBatch(crowded, SEED, [0])
    # With equal outputs, the agents turn left. They stay together.
    alive.begin(0, np.zeros_like(draw_founders(crowded))[None])
    alive.state.positions[0, 1] += 10
    alive.simulate(0, 1)
    assert alive.state.activations[1, 0] == 1
    alive.simulate(29, 30)
    alive.simulate(30, 31)
    assert (alive.state.activations[:3, 0] == 0).all()


def test_records_contain_deaths_and_ages_and_learning_costs_only_while_alive() -> None:
    experiment = make_experiment("evo+self-taught", learning={"cost_per_step": 0.5})
    genomes = draw_founders(experiment)[None]
    results = MiniWorldSimulator(experiment, SEED, [0]).simulate(0, genomes)
    np.testing.assert_array_equal(results.records["alive"][0], [1, 0, 1, 0, 1, 0])
    np.testing.assert_array_equal(
        results.records["age"][0], [STEPS, DEATH_STEP, STEPS, DEATH_STEP, STEPS, DEATH_STEP]
    )
    np.testing.assert_array_equal(results.cost[0], 0.5 * results.records["age"][0])


@pytest.mark.nightly
def test_a_newborn_has_the_first_free_slot() -> None:
    experiment = make_experiment(
        "evo", "test-cull-and-bear", evolution={"mutation_rate": 1.0, "mutation_size": 0.5}
    )
    genomes = draw_founders(experiment)[None]
    results = MiniWorldSimulator(experiment, SEED, [0]).simulate(0, genomes)
    np.testing.assert_array_equal(results.records["alive"][0], [1, 1, 1, 0, 1, 0])
    np.testing.assert_array_equal(results.records["born"][0], [0, 1, 0, 0, 0, 0])
    assert results.records["age"][0, 1] == STEPS - BIRTH_STEP
    assert results.final_population is not None
    child = results.final_population.genome[0, 1]
    assert 0 < np.abs(child - genomes[0, 0]).max() <= 0.5
    np.testing.assert_array_equal(results.final_population.origin[0, 1], [0, 0])
    # The other slots have the genomes of the first agents.
    unchanged = [0, 2, 3, 4, 5]
    np.testing.assert_array_equal(
        results.final_population.genome[0, unchanged], genomes[0, unchanged]
    )


@pytest.mark.usefixtures("in_plain_python")
def test_a_newborn_inherits_genes_of_parts_and_no_content_of_memory() -> None:
    experiment = make_experiment(
        "evo",
        "test-cull-and-bear",
        evolution={"variation": "self-adaptive", "self_adaptive": {"initial_step_size": 0.5}},
    )
    genome = draw_founders(experiment)
    children = []
    for pattern in poison.PATTERNS:
        with poison.use_pattern(pattern):
            batch = simulate_steps(experiment, genome, BIRTH_STEP)
        assert batch.state.birth_count[0].tolist() == [0, 1, 0, 0, 0, 0]
        children.append(batch.state.genome[0, 1])
    assert children[0].tobytes() == children[1].tobytes()
    mutations = (children[0] - genome[0])[0]
    step_size = children[0][0, -1]
    # The gene is the last entry. It mutates log-normally, and no weight mutates far beyond it.
    assert 0.2 < step_size < 1 and mutations[-1] != 0
    assert 0.5 * step_size < mutations[:-1].std() < 2 * step_size


@pytest.mark.parametrize("variation", ["gene-pool", "test-counted"])
def test_births_need_a_variation_whose_children_are_independent(variation: str) -> None:
    refusal = (
        "world.features: test-cull-and-bear needs a variation that creates one child at a time; "
        f"evolution.variation = '{variation}' does not"
    )
    with pytest.raises(ExperimentError, match=refusal):
        make_experiment("evo", "test-cull-and-bear", evolution={"variation": variation})


@pytest.mark.usefixtures("in_plain_python")
def test_a_feature_that_bears_without_declaring_births_is_refused() -> None:
    experiment = make_experiment("evo", "test-bear-without-births")
    with pytest.raises(ValueError, match="the world feature must declare allows_births = True"):
        simulate_steps(experiment, draw_founders(experiment), 1)


@pytest.mark.usefixtures("in_plain_python")
@pytest.mark.parametrize("control", ["none", "drift"])
def test_a_newborn_learns_in_its_first_steps_and_pays_for_them(control: str) -> None:
    experiment = make_experiment(
        "evo+self-taught",
        "test-cull-and-bear",
        learning={"steps": 10, "rate": 0.5, "cost_per_step": 0.5, "control": control},
    )
    batch = simulate_steps(experiment, draw_founders(experiment), BIRTH_STEP)
    changed_steps = []
    for step in range(BIRTH_STEP, STEPS):
        weights = batch.weights()[0].copy()
        batch.simulate(step, step + 1)
        changed = (batch.weights()[0] != weights).any(axis=1)
        assert not changed[[0, 2, 3, 4, 5]].any()
        changed_steps += [step] * int(changed[1])
    assert changed_steps == [*range(BIRTH_STEP, BIRTH_STEP + 10)]
    # Half of the agents died after step 29. All agents have learned in ten steps.
    assert batch.state.population.steps_learned[0, :6].tolist() == [10] * 6


@pytest.mark.nightly
def test_agents_leave_the_items_that_they_do_not_eat() -> None:
    patches = {"features": ["patches"], "patches": {"patches": [[20, 100, 10, 90, 12, 2.0]]}}
    experiment = make_small_experiment("evo", world=patches, lifetime={"steps": 300})
    selective = experiment.replace(eats={"items": ["food"]})
    genomes = draw_founders(experiment)[None]
    expected = MiniWorldSimulator(experiment, SEED, [0]).simulate(0, genomes)
    assert expected.records["patch_eaten"].sum() > 0
    batch = CpuBatch(selective, SEED, [0])
    batch.begin(0, genomes)
    first_items = batch.items()
    batch.simulate(0, 300)
    n_food = experiment.world.food[0].count
    eaten = batch.eaten_in_life()[0]
    assert eaten[:, 0].sum() > 0
    assert (eaten[:, 1] == 0).all()
    assert (batch.state.touched[0, n_food:] == -1).all()
    np.testing.assert_array_equal(batch.items()[0, n_food:], first_items[0, n_food:])
