"""Worlds as environments: checks of Gymnasium and PettingZoo, comparisons with the engine."""

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


def test_the_checks_of_pettingzoo_pass() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        parallel_api_test(bl.parallel_env(EXPERIMENT), num_cycles=200)
        parallel_seed_test(lambda: bl.parallel_env(EXPERIMENT), num_cycles=50)


def test_the_check_of_gymnasium_passes() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(bl.single_env(EXPERIMENT.replace(population={"size": 1})), skip_render_check=True)


# A new combination of parts must be compiled.
LONG = pytest.mark.nightly


@pytest.mark.parametrize(
    "changes",
    [
        pytest.param({}, id="the paper's"),
        pytest.param({"motor": {"noise": 0.3}}, id="noisy"),
        pytest.param({"motor": {"body": "stay"}}, id="another body", marks=LONG),
        pytest.param(
            {"senses": {"kinds": ["food", "last-action"]}},
            id="the last action as a sense",
            marks=LONG,
        ),
    ],
)
def test_a_policy_with_the_outputs_of_a_replay_eats_the_same_food(
    changes: dict[str, Any],
) -> None:
    experiment = EXPERIMENT.replace(**changes)
    for generation in (0, 2):
        life = bl.replay(experiment, seed=5, run=1, generation=generation)
        world = SteeredBatch(experiment, 5, [1])
        sensed = world.begin(5, generation)
        eaten = np.zeros(experiment.population.size)
        for step in range(experiment.lifetime.steps):
            np.testing.assert_array_equal(sensed[0], life["sensor"].values[step])
            sensed, gained = world.act(life["output"].values[None, step])
            eaten += gained[0]
        np.testing.assert_array_equal(eaten, life["eaten"].sum("step").values)
        assert eaten.any()


def test_each_reset_starts_the_next_generation_and_a_seed_starts_the_first() -> None:
    world = bl.parallel_env(EXPERIMENT)
    positions = []
    for seed in (5, None, None, 5):
        world.reset(seed=seed)
        positions.append(world._worlds._batch._state.positions.copy())
    assert (positions[0] == positions[3]).all()
    assert (positions[0] != positions[1]).any()
    assert (positions[1] != positions[2]).any()


def test_a_vector_of_worlds_equals_single_worlds() -> None:
    both = bl.vector_env(EXPERIMENT, worlds=2)
    draw = np.random.default_rng(1)
    agents = EXPERIMENT.population.size
    single = [SteeredBatch(EXPERIMENT, 7, [run]) for run in range(2)]
    sensed, _ = both.reset(seed=7)
    np.testing.assert_array_equal(
        sensed, np.concatenate([world.begin(7, 0)[0] for world in single])
    )
    for step in range(EXPERIMENT.lifetime.steps):
        actions = draw.integers(0, 3, 2 * agents)
        sensed, reward, ended, cut, _ = both.step(actions)
        outputs = np.eye(3, dtype=np.float32)[actions].reshape(2, 1, agents, 3)
        results = [world.act(rows) for world, rows in zip(single, outputs, strict=True)]
        np.testing.assert_array_equal(sensed, np.concatenate([inputs[0] for inputs, _ in results]))
        np.testing.assert_array_equal(reward, np.concatenate([gained[0] for _, gained in results]))
        assert not ended.any()
        assert cut.all() == (step + 1 == EXPERIMENT.lifetime.steps)
    sensed, reward, _, cut, _ = both.step(draw.integers(0, 3, 2 * agents))
    assert not cut.any() and not reward.any()
    np.testing.assert_array_equal(
        sensed, np.concatenate([world.begin(7, 1)[0] for world in single])
    )


@pytest.mark.nightly
def test_a_continuous_body_takes_one_number_per_output() -> None:
    world = bl.vector_env(EXPERIMENT.replace(motor={"body": "continuous"}))
    assert world.single_action_space.shape == (2,)
    world.reset(seed=1)
    before = world._worlds._batch._state.positions.copy()
    world.step(np.zeros((EXPERIMENT.population.size, 2), np.float32))
    # Both outputs are 0, so the agents do not move.
    assert (world._worlds._batch._state.positions == before).all()


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: bl.single_env(EXPERIMENT), "population.size = 6"),
        (lambda: bl.parallel_env(bl.load("neat-xor")), "lives have no steps"),
        (
            lambda: bl.parallel_env(EXPERIMENT.replace(lifetime={"update": "sequential"})),
            'lifetime.update = "sequential"',
        ),
        (
            lambda: bl.parallel_env(EXPERIMENT.replace(population={"worlds": 2})),
            "population.worlds and lifetime.repeats must be 1",
        ),
        (
            lambda: bl.parallel_env(EXPERIMENT.replace(lifetime={"repeats": 2})),
            "population.worlds and lifetime.repeats must be 1",
        ),
        (lambda: bl.vector_env(EXPERIMENT).reset(seed=[1, 2]), "seed must be one number"),
        (lambda: bl.parallel_env(EXPERIMENT).step({}), "reset"),
    ],
)
def test_an_unsupported_call_is_refused_with_the_reason(call: Any, message: str) -> None:
    with pytest.raises(RefusedError, match=message):
        call()
    with pytest.raises(ArgumentError):
        bl.vector_env(EXPERIMENT, worlds=0)


def test_an_error_names_the_agent_without_an_action() -> None:
    world = bl.parallel_env(EXPERIMENT)
    world.reset(seed=1)
    with pytest.raises(RefusedError, match="agent_0 has no action"):
        world.step({})


def test_without_the_libraries_the_error_names_the_extra(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    real_import = builtins.__import__

    def without(name: str, *arguments: Any) -> Any:
        if name.startswith("pettingzoo"):
            raise ImportError(name)
        return real_import(name, *arguments)

    monkeypatch.setattr(builtins, "__import__", without)
    monkeypatch.delitem(sys.modules, "baldwinlab.api.integrations.pettingzoo", raising=False)
    with pytest.raises(RefusedError, match=re.escape(installation_command("rl"))):
        _ = bl.parallel_env
