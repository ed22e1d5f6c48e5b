"""Measure the speed of the vector environment: `python -m benchmarks.environments`.

The command prints agent-steps per second, with a policy over arrays.
"""

from __future__ import annotations

import time

import numpy as np

import baldwinlab as bl

N_WORLDS = 50
N_STEPS = 2000


def main() -> None:
    worlds = bl.vector_env(bl.load("evo/A").replace(lifetime={"steps": N_STEPS}), worlds=N_WORLDS)
    for _ in range(3):
        sensed, _ = worlds.reset(seed=1)
        began = time.perf_counter()
        for _ in range(N_STEPS):
            left, front, right = (sensed[:, number] > 0 for number in range(3))
            action = np.select([front, left, right], [1, 0, 2], default=1)
            sensed, *_ = worlds.step(action)
        rate = worlds.num_envs * N_STEPS / (time.perf_counter() - began)
        print(f"{rate / 1e6:.1f} million agent-steps/s")


if __name__ == "__main__":
    main()
