"""Worlds as environments: checks of Gymnasium, PettingZoo and their clients, and of the engine."""

from __future__ import annotations

import builtins
import math
import re
import sys
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.wrappers import RecordVideo
from pettingzoo.test import parallel_api_test, parallel_seed_test

import baldwinlab as bl
from baldwinlab.api.integrations.steered_worlds import InvalidActionError
from baldwinlab.core.errors import ArgumentError, RefusedError
from baldwinlab.core.extras import installation_command
from baldwinlab.models.miniworld.external_actions import SteeredBatch
from tests.api.integrations.rl_clients import run_client
from tests.worlds import make_small_experiment

EXPERIMENT = make_small_experiment("evo")


@pytest.mark.filterwarnings("error")
def test_the_checks_of_pettingzoo_and_gymnasium_pass() -> None:
    parallel_api_test(bl.parallel_env(EXPERIMENT), num_cycles=200)
    parallel_seed_test(lambda: bl.parallel_env(EXPERIMENT), num_cycles=50)
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


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: bl.single_env(EXPERIMENT), "population.size = 6"),
        (lambda: bl.parallel_env(bl.load("neat-xor")), "lives have no steps"),
        (
            lambda: bl.parallel_env(EXPERIMENT.replace(lifetime={"update": "sequential"})),
            'lifetime.update = "sequential"',
        ),
        *(
            (
                partial(bl.parallel_env, EXPERIMENT.replace(**changes)),
                "population.worlds and lifetime.repeats must be 1",
            )
            for changes in ({"population": {"worlds": 2}}, {"lifetime": {"repeats": 2}})
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


SINGLE = EXPERIMENT.replace(population={"size": 1})
ENVIRONMENTS: dict[str, tuple[Any, Any]] = {
    "single": (lambda: bl.single_env(SINGLE), lambda action: action),
    "parallel": (lambda: bl.parallel_env(SINGLE), lambda action: {"agent_0": action}),
    "vector": (lambda: bl.vector_env(SINGLE), lambda action: [action]),
}
BAD_ACTIONS = (-1, 3, 1.5, math.nan, True, "1", None, [1], np.int64(3), np.float64(1))


@pytest.mark.parametrize("kind", ENVIRONMENTS)
def test_actions_outside_their_space_are_refused_and_change_nothing(kind: str) -> None:
    make, wrap = ENVIRONMENTS[kind]
    env: Any = make()
    env.reset(seed=1)
    for action in BAD_ACTIONS:
        with pytest.raises(gymnasium.error.InvalidAction, match="must be a whole number from 0"):
            env.step(wrap(action))
    results = env.step(wrap(np.uint8(2)))
    fresh = make()
    fresh.reset(seed=1)
    np.testing.assert_equal(fresh.step(wrap(2))[:2], results[:2])


@pytest.mark.parametrize("kind", ENVIRONMENTS)
def test_seeds_are_whole_numbers_and_no_two_are_one(kind: str) -> None:
    env: Any = ENVIRONMENTS[kind][0]()
    for seed in (1.5, -1, "2", True, math.nan, 2**32, 2**40):
        with pytest.raises(ArgumentError, match=r"seed = .* must be a whole number from 0"):
            env.reset(seed=seed)
    positions = []
    seeds: list[Any] = [0, 2**31, 2**32 - 1, 1, np.int64(1), np.uint32(1)]
    for seed in seeds:
        env.reset(seed=seed)
        positions.append(env._worlds._batch._state.positions[:, 0].tolist())
    assert positions[3] == positions[4] == positions[5]
    assert len({tuple(position) for position in positions}) == 4


@pytest.mark.parametrize("kind", ENVIRONMENTS)
def test_a_step_needs_a_lifetime(kind: str) -> None:
    make, wrap = ENVIRONMENTS[kind]
    env: Any = make()
    for call in (lambda: env.step(wrap(1)), env.render):
        with pytest.raises(gymnasium.error.ResetNeeded, match=r"call reset\(\) before"):
            call()
    env.reset()
    for _ in range(SINGLE.lifetime.steps):
        env.step(wrap(1))
    if kind != "vector":
        with pytest.raises(gymnasium.error.ResetNeeded, match=r"the lifetime is over"):
            env.step(wrap(1))


def test_actions_are_those_of_the_agents() -> None:
    env = bl.parallel_env(EXPERIMENT)
    env.reset(seed=1)
    actions = dict.fromkeys(env.agents, 1)
    with pytest.raises(InvalidActionError, match="there is no agent 'agent_9'"):
        env.step(actions | {"agent_9": 1})
    with pytest.raises(InvalidActionError, match=r"actions\['agent_2'\] = 7 must be"):
        env.step(actions | {"agent_2": 7})
    vector = bl.vector_env(EXPERIMENT)
    vector.reset(seed=1)
    bad_values: list[Any] = [1, [1, 1], np.ones((6, 1), int), [1, 1, 1, 1, [1, 2], 1]]
    for bad_actions in bad_values:
        with pytest.raises(InvalidActionError):
            vector.step(bad_actions)
    with pytest.raises(RefusedError, match="agent_0 has no action"):
        env.step({})


@pytest.mark.nightly
def test_a_continuous_body_takes_one_number_per_output_from_0_to_1() -> None:
    env = bl.single_env(SINGLE.replace(motor={"body": "continuous"}))
    env.reset(seed=1)
    for action in ([0.5], [0.5, 1.1], [-0.1, 0], [math.nan, 0], 1, [True, False], ["a", "b"]):
        with pytest.raises(InvalidActionError, match="must be an array of 2 numbers from 0 to 1"):
            env.step(action)
    env.step([0, 1])
    worlds = bl.vector_env(EXPERIMENT.replace(motor={"body": "continuous"}))
    assert worlds.single_action_space.shape == (2,)
    worlds.reset(seed=1)
    before = worlds._worlds._batch._state.positions.copy()
    worlds.step(np.zeros((EXPERIMENT.population.size, 2), np.float32))
    # Both outputs are 0, so the agents do not move.
    assert (worlds._worlds._batch._state.positions == before).all()


def test_gymnasium_makes_the_environments_of_a_preset() -> None:
    arguments: dict[str, Any] = {"preset": "evo/A", "set": {"lifetime.steps": 30}}
    env: Any = gymnasium.make("baldwinlab/Forager-v0", render_mode="rgb_array", **arguments)
    check_env(env.unwrapped, skip_render_check=True)
    assert gymnasium.make(env.spec).spec == env.spec
    inputs, _ = env.reset(seed=5)
    vector: Any = gymnasium.make_vec(
        "baldwinlab/Forager-v0", 3, render_mode="rgb_array", **arguments
    )
    all_inputs, _ = vector.reset(seed=5)
    assert all_inputs.shape == (3, *inputs.shape)
    np.testing.assert_array_equal(all_inputs[0], inputs)
    np.testing.assert_array_equal(vector.render()[0], env.render())


def test_an_image_shows_the_current_step() -> None:
    env: Any = bl.single_env(SINGLE, "rgb_array")
    assert bl.single_env(SINGLE).reset() and env.reset(seed=1)
    first = env.render()
    height, width, colors = first.shape
    assert (first.dtype, colors) == (np.uint8, 3) and width > height > 400
    env.step(1)
    second = env.render()
    assert (first != second).any()
    np.testing.assert_array_equal(env.render(), second)
    unseen = bl.single_env(SINGLE)
    unseen.reset()
    assert unseen.render() is None
    images = bl.vector_env(EXPERIMENT, worlds=2, render_mode="rgb_array")
    images.reset(seed=1)
    frames = images.render()
    assert frames is not None and len(frames) == 12
    assert (frames[0] == frames[5]).all() and (frames[0] != frames[6]).any()
    parallel = bl.parallel_env(EXPERIMENT, "rgb_array")
    parallel.reset(seed=1)
    np.testing.assert_array_equal(parallel.render(), frames[0])
    for make in (bl.parallel_env, lambda *given: bl.vector_env(given[0], 1, given[1])):
        with pytest.raises(RefusedError, match="needs single_env"):
            make(EXPERIMENT, "human")
    with pytest.raises(ArgumentError, match="render_mode = 'ansi' must be one of"):
        bl.single_env(SINGLE, "ansi")


def test_a_video_has_an_image_per_step(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Moviepy needs an older pillow than this environment, so the test replaces it."""
    videos = []

    class ImageSequenceClip:
        def __init__(self, frames: list[Any], fps: float) -> None:
            videos.append((len(frames), fps))

        def write_videofile(self, path: str, **options: Any) -> None:
            Path(path).write_bytes(b"video")

    module = ModuleType("moviepy.video.io.ImageSequenceClip")
    module.ImageSequenceClip = ImageSequenceClip  # type: ignore[attr-defined]
    for name in ("moviepy", "moviepy.video", "moviepy.video.io"):
        monkeypatch.setitem(sys.modules, name, ModuleType(name))
    monkeypatch.setitem(sys.modules, module.__name__, module)
    env: Any = RecordVideo(
        gymnasium.make("baldwinlab/Forager-v0", set={"lifetime.steps": 5}, render_mode="rgb_array"),
        str(tmp_path / "videos"),
        episode_trigger=lambda episode: True,
    )
    env.reset(seed=1)
    for _ in range(5):
        env.step(1)
    env.close()
    assert videos == [(6, 25)]


def test_a_window_needs_pygame(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pygame", None)
    env = bl.single_env(SINGLE, "human")
    with pytest.raises(gymnasium.error.DependencyNotInstalled, match="pygame"):
        env.reset(seed=1)


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


@pytest.mark.nightly
@pytest.mark.parametrize("start_method", ["spawn", "forkserver", "fork"])
def test_stable_baselines_trains_in_two_processes(start_method: str) -> None:
    assert run_client("train", start_method) == 2_000


@pytest.mark.nightly
def test_supersuit_steps_two_worlds_in_two_processes() -> None:
    result = run_client("supersuit")
    # Two worlds of four agents, each with three frames of three inputs. One lifetime ends.
    assert result == {"shape": [8, 9], "ends": 8}


@pytest.mark.nightly
def test_gymnasium_records_a_video_and_opens_a_window(tmp_path: Path) -> None:
    assert run_client("video", tmp_path) == ["rl-video-episode-0.mp4"]
