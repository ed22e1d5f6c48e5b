"""The launcher for an NVIDIA GPU: Python arrays in, a batch of lives, Python arrays out."""

from __future__ import annotations

import importlib.util
from collections.abc import Sequence
from typing import Any, Final

import numpy as np
import numpy.typing as npt
from numba import config, cuda

from baldwinlab.core.extras import missing_extra
from baldwinlab.engine.gpu import COMPILING, without_contraction
from baldwinlab.experiment import Experiment
from baldwinlab.models.miniworld.allocation import make_model, make_state
from baldwinlab.models.miniworld.backends.cuda_kernels import (
    make_birth_kernel,
    make_kernel_source,
    make_simulation_kernel,
)
from baldwinlab.models.miniworld.state import State

THREADS: Final = 128  # in a thread block, about: small enough that a barrier waits for few, and whole warps for worlds of 20
PROCESSORS: Final = 132  # of an H200
LARGEST_WORLD: Final = 1024  # agents: the most threads that a batch can have


def unavailable_reason() -> str | None:
    """Why this backend cannot be used here, in a sentence; None if it can."""
    if config.ENABLE_CUDASIM:
        return None
    if importlib.util.find_spec("numba_cuda") is None:
        return str(missing_extra("cuda", "backend cuda"))
    try:
        found = cuda.is_available()
    except Exception as problem:  # a driver may fail in any way
        return f"backend cuda needs an NVIDIA GPU, and asking for one failed: {problem}"
    return None if found else "backend cuda needs an NVIDIA GPU, and none was found"


def worlds_in_thread_block(agents: int, worlds: int) -> int:
    """As many as fill `THREADS`, but no more than leaves a thread block for each of the GPU's processors, or nearly."""
    return max(1, min(THREADS // agents, worlds // PROCESSORS))


def _on_device(value: Any, stream: Any) -> Any:
    """A copy of a `Model` or a `State`, and of the parts in it, whose arrays are on the GPU."""
    if isinstance(value, np.ndarray):
        return cuda.to_device(value, stream)
    if not isinstance(value, tuple):
        return value
    entries = [_on_device(entry, stream) for entry in value]
    return value._make(entries) if hasattr(value, "_make") else tuple(entries)


def _fetch(here: Any, there: Any, stream: Any) -> None:
    """Copy every array of a state on the GPU into its counterpart here."""
    for mine, its in zip(here, there, strict=True):
        if isinstance(mine, np.ndarray):
            its.copy_to_host(mine, stream)
        elif isinstance(mine, tuple):
            _fetch(mine, its, stream)


class Batch:
    """Several runs of one experiment that live side by side, a generation at a time. A run's bits do not depend on the others.

    Worlds are padded to whole thread blocks; those past the last run live, harmlessly, and are not reported.
    Raises ValueError if there is no GPU, or if a world is larger than a thread block.
    """

    def __init__(self, experiment: Experiment, seed: int, runs: Sequence[int]) -> None:
        agents = experiment.population.size
        if problem := unavailable_reason():
            raise ValueError(problem)
        if agents > LARGEST_WORLD:
            raise ValueError(
                f"backend cuda holds at most {LARGEST_WORLD} agents in a world: population.size = {agents}"
            )
        if 2 * agents * experiment.lifetime.steps >= 2**31:
            raise ValueError(
                "backend cuda counts turns in 32 bits: lifetime.steps * population.size must be less than 2**30"
            )
        worlds = worlds_in_thread_block(agents, len(runs))
        padded = -(-len(runs) // worlds) * worlds
        self.model, self._host = make_model(experiment, padded), make_state(experiment, padded)
        self._host.keys[: len(runs)] = [(seed, run) for run in runs]
        self._shape = (len(runs), agents)
        self._stream = cuda.stream()
        self._launch = (padded // worlds, worlds * agents, self._stream)
        self._model, self._state = (
            _on_device(self.model, self._stream),
            _on_device(self._host, self._stream),
        )
        self._genomes = cuda.pinned_array(self._host.genome.shape, np.float32)
        self._genomes[:] = 0
        self._claims = cuda.device_array_like(self._host.touched, self._stream)
        source = make_kernel_source(
            self.model, self._host, experiment.lifetime.update == "sequential"
        )
        threads = LARGEST_WORLD if worlds * agents > LARGEST_WORLD // 2 else LARGEST_WORLD // 2
        with COMPILING:
            self._begin = make_birth_kernel(threads)
            self._live = make_simulation_kernel(threads, source, type(self._host.network).part)

    @property
    def state(self) -> State:
        """The state as it is now, copied from the GPU."""
        _fetch(self._host, self._state, self._stream)
        self._stream.synchronize()
        return self._host

    def begin(self, generation: int, genomes: npt.NDArray[np.float32]) -> None:
        """Let a generation be born. `genomes` is [world, agent, module, weight]."""
        self._stream.synchronize()  # the last genomes may still be on their way
        self._genomes[: len(genomes)] = genomes
        self._state.genome.copy_to_device(self._genomes, self._stream)
        self._state.generation.copy_to_device(np.array([generation], np.uint32), self._stream)
        with without_contraction():
            self._begin[self._launch](self._model, self._state, self._claims)

    def simulate(self, first_step: int, last_step: int) -> None:
        """Live through the steps from `first_step` up to, and without, `last_step`. Returns before they are done."""
        with without_contraction():
            self._live[self._launch](self._model, self._state, self._claims, first_step, last_step)

    def items(self) -> npt.NDArray[np.float32]:
        """Where the items lie, [world, item, (x, y)]."""
        state, worlds = self.state, self._shape[0]
        return np.stack([state.item_x[:worlds], state.item_y[:worlds]], axis=-1)

    def eaten_in_life(self) -> npt.NDArray[np.int32]:
        """Items eaten so far in this life, [world, agent, region]. Waits until it is lived."""
        worlds, agents = self._shape
        self._state.eaten_in_life.copy_to_host(self._host.eaten_in_life, self._stream)
        self._stream.synchronize()
        return self._host.eaten_in_life[:, : worlds * agents].T.reshape(worlds, agents, -1).copy()

    def weights(self) -> npt.NDArray[np.float32]:
        """The action module's weights as they stand, [world, agent, weight]. Waits until they do."""
        worlds, agents = self._shape
        self._state.weights.copy_to_host(self._host.weights, self._stream)
        self._stream.synchronize()
        return self._host.weights[:, : worlds * agents].T.reshape(worlds, agents, -1).copy()
