"""Random numbers of per-world and per-agent hooks of MiniWorld."""

from __future__ import annotations

from typing import Any

import numpy as np

from baldwinlab.engine.jit import compiled
from baldwinlab.engine.rng import philox, unit


@compiled
def draw_unit(state: Any, world: int, purpose: int, index: int, draw: int) -> np.float32:
    """Return a random number in [0, 1) from a lifetime, for a per-world hook.

    Equal arguments give the same number in every step of a generation of a run.

    Parameters
    ----------
    state : State
        Arrays of the step. They contain the seed, the run and the generation.
    world : int
        Index of the world.
    purpose : int
        Purpose of the number, from `purpose("my-part: name")`.
    index : int
        Index of the agent or item.
    draw : int
        Number of the draw, for example the step.

    Returns
    -------
    float32
        A multiple of 2**-24.
    """
    seed = state.keys[world, 0]
    run = state.keys[world, 1]
    return unit(philox(draw, index, state.generation[0], purpose, seed, run)[0])
