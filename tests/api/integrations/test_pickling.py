"""Environments, experiments, studies and parts are read by a new process and continue equally."""

from __future__ import annotations

import copy
import multiprocessing
import os
import pickle
import subprocess
import sys
from pathlib import Path
from typing import Any

import cloudpickle
import gymnasium
import numpy as np
import pytest

import baldwinlab as bl
from baldwinlab.parts.loading import load_file
from tests.worlds import make_small_experiment

ROOT = Path(__file__).parents[3]
POISON = ROOT / "examples/parts/poison.py"
EXPERIMENT = make_small_experiment("evo")


def step(env: Any, steps: int) -> np.ndarray:
    """Return the observations and rewards of some steps of a ParallelEnv or VectorEnv."""
    values = []
    for number in range(steps):
        if hasattr(env, "num_envs"):
            observations, rewards, *_ = env.step((np.arange(env.num_envs) + number) % 3)
        else:
            actions = {agent: (number + i) % 3 for i, agent in enumerate(env.agents)}
            results = env.step(actions)
            observations, rewards = (np.array([*entry.values()]) for entry in results[:2])
        values.append(np.column_stack([observations, rewards]))
    return np.stack(values)


@pytest.mark.parametrize("read", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))])
@pytest.mark.parametrize("make", [bl.parallel_env, bl.vector_env])
def test_a_copy_continues_the_lifetime_and_does_not_change_the_original(
    make: Any, read: Any
) -> None:
    env = make(EXPERIMENT)
    env.reset(seed=3)
    step(env, 10)
    copied = read(env)
    copied_results = step(copied, 30)
    np.testing.assert_array_equal(step(env, 30), copied_results)
    # The next generation is that of the same seed.
    env.reset()
    copied.reset()
    np.testing.assert_array_equal(step(env, 5), step(copied, 5))


def test_an_environment_of_one_agent_is_copied_with_its_images() -> None:
    env = bl.single_env(EXPERIMENT.replace(population={"size": 1}), "rgb_array")
    env.reset(seed=3)
    env.step(1)
    copied = pickle.loads(pickle.dumps(env))
    np.testing.assert_array_equal(copied.render(), env.render())
    results, expected = copied.step(2), env.step(2)
    np.testing.assert_array_equal(results[0], expected[0])
    assert results[1:] == expected[1:]


@pytest.mark.parametrize("name", ["neat-xor", "mayley-1996:climbing/smooth", "evo+self-taught/A"])
def test_a_copy_of_an_experiment_of_any_model_is_equal(name: str) -> None:
    experiment = bl.load(name)
    for copied in (
        copy.copy(experiment),
        copy.deepcopy(experiment),
        experiment.model_copy(),
        pickle.loads(pickle.dumps(experiment)),
    ):
        assert copied == experiment and type(copied) is type(experiment)
        assert hash(copied) == hash(experiment)


CHILD = """
import pickle, sys
from pathlib import Path
from tests.api.integrations.test_pickling import step
folder = Path(sys.argv[1])
objects = {path.stem: pickle.loads(path.read_bytes()) for path in sorted(folder.glob("*.pickle"))}
results = {
    "experiment": objects["experiment"].to_dict(),
    "env": step(objects["env"], 20),
    "cloud": step(objects["cloud"], 20),
    "fitness": objects["problem"].evaluate(objects["problem"].founders(6)).fitness,
    "part": objects["part"].model_dump(),
    "class": objects["class"].__qualname__,
    "study": objects["study"].conditions,
}
(folder / "results").write_bytes(pickle.dumps(results))
"""


def test_a_new_process_continues_with_a_part_whose_file_was_moved(tmp_path: Path) -> None:
    file = tmp_path / "poison.py"
    file.write_bytes(POISON.read_bytes())
    parts = load_file(file)
    file.unlink()
    experiment = EXPERIMENT.replace(
        name="poisoned",
        world={"features": ["poison"], "poison": {"x": [20, 100], "y": [10, 90]}},
        senses={"kinds": ["food", "poison"]},
        evolution={"generations": 1},
    )
    study = bl.run(experiment, runs=1, out=tmp_path / "study")
    env = bl.parallel_env(experiment)
    env.reset(seed=3)
    step(env, 10)
    problem = bl.make_problem(experiment, seed=4)
    objects = {
        "experiment": experiment,
        "env": env,
        "problem": problem,
        "part": experiment.world.poison,  # type: ignore[attr-defined]
        "class": parts.Poison,
        "study": study,
    }
    for name, value in objects.items():
        (tmp_path / f"{name}.pickle").write_bytes(pickle.dumps(value))
    (tmp_path / "cloud.pickle").write_bytes(cloudpickle.dumps(env))
    subprocess.run(
        [sys.executable, "-c", CHILD, str(tmp_path)],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        check=True,
    )
    results = pickle.loads((tmp_path / "results").read_bytes())
    expected = step(env, 20)
    np.testing.assert_array_equal(results["env"], expected)
    np.testing.assert_array_equal(results["cloud"], expected)
    assert results["experiment"] == experiment.to_dict()
    fitness = problem.evaluate(problem.founders(6)).fitness
    np.testing.assert_array_equal(results["fitness"], fitness)
    assert results["part"] == experiment.world.poison.model_dump()  # type: ignore[attr-defined]
    assert results["class"] == "Poison"
    assert results["study"] == ("poisoned",)


def _step_in_child(queue: Any, env: Any) -> None:
    queue.put(step(env, 20))


@pytest.mark.skipif(sys.platform != "linux", reason="other systems do not fork")
def test_an_environment_goes_on_in_a_process_that_was_forked() -> None:
    env = bl.parallel_env(EXPERIMENT)
    env.reset(seed=3)
    context = multiprocessing.get_context("fork")
    queue = context.Queue()
    process = context.Process(target=_step_in_child, args=(queue, env))
    process.start()
    np.testing.assert_array_equal(queue.get(timeout=600), step(env, 20))
    process.join()


def test_gymnasium_steps_environments_in_processes() -> None:
    arguments: dict[str, Any] = {"preset": "evo/A", "set": {"lifetime.steps": 20}}
    env: Any = gymnasium.make_vec(
        "baldwinlab:baldwinlab/Forager-v0", 2, vectorization_mode="async", **arguments
    )
    single: Any = gymnasium.make("baldwinlab/Forager-v0", **arguments)
    observations, _ = env.reset(seed=[7, 8])
    np.testing.assert_array_equal(observations[1], single.reset(seed=8)[0])
    observations, *_ = env.step(np.array([1, 1]))
    np.testing.assert_array_equal(observations[1], single.step(1)[0])
    env.close()
