"""Worlds as environments: their own libraries' checks, and the engine's very lives."""

from __future__ import annotations

import builtins
import re
import sys
import warnings
from typing import Any

import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from pettingzoo.test import parallel_api_test, parallel_seed_test

import baldwinlab as bl
from baldwinlab.core.errors import ArgumentError, RefusedError
from baldwinlab.core.extras import installation_command
from baldwinlab.models.miniworld.external_actions import SteeredBatch
from tests.worlds import make_small_experiment

EXPERIMENT = make_small_experiment("evo")


def test_pettingzoo_finds_nothing_wrong() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        parallel_api_test(bl.parallel_env(EXPERIMENT), num_cycles=200)
        parallel_seed_test(lambda: bl.parallel_env(EXPERIMENT), num_cycles=50)


def test_gymnasium_finds_nothing_wrong() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(bl.single_env(EXPERIMENT.replace(population={"size": 1})), skip_render_check=True)


LONG = pytest.mark.nightly  # a combination of parts to compile


@pytest.mark.parametrize(
    "changes",
    [
        pytest.param({}, id="the paper's"),
        pytest.param({"motor": {"noise": 0.3}}, id="noisy"),
        pytest.param({"motor": {"body": "stay"}}, id="another body", marks=LONG),
        pytest.param(
            {"senses": {"kinds": ["food", "last-action"]}},
            id="a sense of one's own action",
            marks=LONG,
        ),
    ],
)
def test_a_policy_that_copies_an_evolved_network_gets_the_food_of_the_engines_run(
    changes: dict[str, Any],
) -> None:
    experiment = EXPERIMENT.replace(**changes)
    for generation in (0, 2):
        life = bl.replay(experiment, seed=5, run=1, generation=generation)
        world = SteeredBatch(experiment, 5, [1])
        sensed, eaten = world.begin(5, generation), np.zeros(experiment.population.size)
        for step in range(experiment.lifetime.steps):
            np.testing.assert_array_equal(sensed[0], life["sensor"].values[step])
            sensed, gained = world.act(life["output"].values[None, step])
            eaten += gained[0]
        np.testing.assert_array_equal(eaten, life["eaten"].sum("step").values)
        assert eaten.any(), "somebody ate"


def test_each_reset_is_the_next_generation_and_a_seed_begins_anew() -> None:
    world = bl.parallel_env(EXPERIMENT)
    places = []
    for seed in (5, None, None, 5):
        world.reset(seed=seed)
        places.append(world._worlds._steered._state.positions.copy())
    assert (
        (places[0] == places[3]).all()
        and (places[0] != places[1]).any()
        and (places[1] != places[2]).any()
    )


def test_a_vector_of_worlds_is_its_worlds_side_by_side() -> None:
    both, draw = bl.vector_env(EXPERIMENT, worlds=2), np.random.default_rng(1)
    agents = EXPERIMENT.population.size
    alone = [SteeredBatch(EXPERIMENT, 7, [run]) for run in range(2)]
    sensed, _ = both.reset(seed=7)
    np.testing.assert_array_equal(sensed, np.concatenate([world.begin(7, 0)[0] for world in alone]))
    for step in range(EXPERIMENT.lifetime.steps):
        actions = draw.integers(0, 3, 2 * agents)
        sensed, reward, ended, cut, _ = both.step(actions)
        outputs = np.eye(3, dtype=np.float32)[actions].reshape(2, 1, agents, 3)
        found = [world.act(told) for world, told in zip(alone, outputs, strict=True)]
        np.testing.assert_array_equal(sensed, np.concatenate([senses[0] for senses, _ in found]))
        np.testing.assert_array_equal(reward, np.concatenate([gained[0] for _, gained in found]))
        assert not ended.any() and cut.all() == (step + 1 == EXPERIMENT.lifetime.steps)
    sensed, reward, _, cut, _ = both.step(draw.integers(0, 3, 2 * agents))
    assert not cut.any() and not reward.any()
    np.testing.assert_array_equal(sensed, np.concatenate([world.begin(7, 1)[0] for world in alone]))


def test_a_body_that_does_something_of_all_outputs_takes_numbers() -> None:
    world = bl.vector_env(EXPERIMENT.replace(motor={"body": "continuous"}))
    assert world.single_action_space.shape == (2,)
    world.reset(seed=1)
    before = world._worlds._steered._state.positions.copy()
    world.step(np.zeros((EXPERIMENT.population.size, 2), np.float32))
    assert (world._worlds._steered._state.positions == before).all(), "both wheels stand still"


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        (lambda: bl.single_env(EXPERIMENT), "population.size = 6"),
        (lambda: bl.parallel_env(bl.load("neat-xor")), "lives have no steps"),
        (
            lambda: bl.parallel_env(EXPERIMENT.replace(lifetime={"update": "sequential"})),
            'lifetime.update = "sequential"',
        ),
        (lambda: bl.vector_env(EXPERIMENT).reset(seed=[1, 2]), "seed must be one number"),
        (lambda: bl.parallel_env(EXPERIMENT).step({}), "reset"),
    ],
)
def test_what_cannot_be_is_refused_in_a_sentence(asked: Any, said: str) -> None:
    with pytest.raises(RefusedError, match=said):
        asked()
    with pytest.raises(ArgumentError):
        bl.vector_env(EXPERIMENT, worlds=0)


def test_an_agent_that_is_told_nothing_is_named() -> None:
    world = bl.parallel_env(EXPERIMENT)
    world.reset(seed=1)
    with pytest.raises(RefusedError, match="agent_0 has no action"):
        world.step({})


def test_without_the_extra_one_sentence_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    real_import = builtins.__import__

    def without(name: str, *arguments: Any) -> Any:
        if name.startswith("gymnasium"):
            raise ImportError(name)
        return real_import(name, *arguments)

    monkeypatch.setattr(builtins, "__import__", without)
    monkeypatch.delitem(sys.modules, "baldwinlab.api.integrations.gymnasium")
    with pytest.raises(RefusedError, match=re.escape(installation_command("rl"))):
        _ = bl.parallel_env
