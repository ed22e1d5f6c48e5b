"""Use the environments with Stable-Baselines3, SuperSuit and moviepy, installed by `make nightly`.

A test calls `run_client`. The Python of that environment runs this file as a script, which prints
the result as JSON.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

PYTHON = Path(sys.prefix, "nightly", "bin", "python")
SOURCE = Path(__file__).parents[3]
# "MODULE:ID": Gymnasium imports the module, also in new processes.
ENVIRONMENT = "baldwinlab:baldwinlab/Forager-v0"
SETTINGS: dict[str, Any] = {"preset": "evo/A", "set": {"lifetime.steps": 100}}


def run_client(name: str, *arguments: object) -> Any:
    """Run a function of this file in the environment of the clients."""
    # The environment of the clients has no pytest.
    import pytest

    if not PYTHON.exists():
        message = f"make nightly installs the clients into {PYTHON.parents[1]}"
        if os.environ.get("CI"):
            pytest.fail(message)
        pytest.skip(message)
    command = [str(PYTHON), __file__, name, *map(str, arguments)]
    # No window and no sound.
    variables = os.environ | {
        "PYTHONPATH": str(SOURCE),
        "SDL_VIDEODRIVER": "dummy",
        "SDL_AUDIODRIVER": "dummy",
    }
    # An error of a library can leave processes that wait for each other.
    done = subprocess.run(
        command, capture_output=True, text=True, check=False, env=variables, timeout=1_200
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


def train_in_processes(start_method: str) -> int:
    """Train PPO in two processes, and return the number of steps of both environments."""
    from stable_baselines3 import PPO
    from stable_baselines3.common.env_util import make_vec_env
    from stable_baselines3.common.vec_env import SubprocVecEnv

    env = make_vec_env(
        ENVIRONMENT,
        n_envs=2,
        seed=3,
        env_kwargs=SETTINGS,
        vec_env_cls=SubprocVecEnv,
        vec_env_kwargs={"start_method": start_method},
    )
    model = PPO("MlpPolicy", env, n_steps=250, batch_size=50, n_epochs=2, seed=1, device="cpu")
    model.learn(2_000)
    env.close()
    return int(model.num_timesteps)


def step_with_supersuit() -> dict[str, Any]:
    """Simulate two worlds in two processes. Return the shape of inputs and the number of ends."""
    import numpy as np
    import supersuit

    import baldwinlab as bl

    experiment = bl.load("evo/A").replace(population={"size": 4}, lifetime={"steps": 50})
    stacked = supersuit.frame_stack_v1(bl.parallel_env(experiment), 3)
    vector = supersuit.pettingzoo_env_to_vec_env_v1(stacked)
    env = supersuit.concat_vec_envs_v1(vector, 2, num_cpus=2, base_class="stable_baselines3")
    observations = [env.reset()]
    ends = 0
    for _ in range(60):
        observation, _, is_over, _ = env.step(np.ones(env.num_envs, int))
        observations.append(observation)
        ends += int(is_over.sum())
    env.close()
    return {"shape": list(observations[0].shape), "ends": ends}


def record_video(folder: str) -> list[str]:
    """Record a video of a lifetime and show it in a window; return the names of the files."""
    import gymnasium
    from gymnasium.utils.env_checker import check_env
    from gymnasium.wrappers import RecordVideo

    check_env(gymnasium.make(ENVIRONMENT, **SETTINGS).unwrapped)
    modes: list[str | None] = ["human", "rgb_array"]
    for mode in modes:
        env = gymnasium.make(ENVIRONMENT, render_mode=mode, **SETTINGS)
        if mode == "rgb_array":
            env = RecordVideo(env, folder, episode_trigger=lambda episode: True)
        env.reset(seed=1)
        is_over = False
        while not is_over:
            *_, is_over, _ = env.step(1)
        env.close()
    return sorted(path.name for path in Path(folder).iterdir())


if __name__ == "__main__":
    functions: dict[str, Callable[..., object]]
    functions = {
        "train": train_in_processes,
        "supersuit": step_with_supersuit,
        "video": record_video,
    }
    print(json.dumps(functions[sys.argv[1]](*sys.argv[2:])))
