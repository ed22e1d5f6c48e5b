"""Agent-steps a second through the vector environment, with a policy over arrays: `python -m benchmarks.environments`."""

from __future__ import annotations

import time

import numpy as np

import baldwinlab as bl

WORLDS, STEPS = 50, 2000


def main() -> None:
    worlds = bl.vector_env(bl.load("evo/A").replace(lifetime={"steps": STEPS}), worlds=WORLDS)
    for _ in range(3):
        sensed, _ = worlds.reset(seed=1)
        began = time.perf_counter()
        for _ in range(STEPS):
            action = np.where(
                sensed[:, 1] > 0, 1, np.where(sensed[:, 0] > 0, 0, np.where(sensed[:, 2] > 0, 2, 1))
            )
            sensed, *_ = worlds.step(action)
        print(
            f"{worlds.num_envs * STEPS / (time.perf_counter() - began) / 1e6:.1f} million agent-steps/s"
        )


if __name__ == "__main__":
    main()
