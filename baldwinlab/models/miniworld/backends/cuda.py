"""Backend for NVIDIA GPUs: a batch of compiled simulations of Python arrays."""

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

# Approximate number of threads in a block: few threads per barrier, and complete warps
# for worlds of 20 agents.
THREADS: Final = 128
# Number of processors of an H200.
PROCESSORS: Final = 132
# Maximum number of agents in a world, which is that of threads in a batch.
LARGEST_WORLD: Final = 1024


def unavailable_reason() -> str | None:
    """Return why the backend is unavailable, or None if it is available."""
    if config.ENABLE_CUDASIM:
        return None
    if importlib.util.find_spec("numba_cuda") is None:
        return str(missing_extra("cuda", "backend cuda"))
    # A driver can raise any exception.
    try:
        is_available = cuda.is_available()
    except Exception as problem:
        return f"backend cuda needs an NVIDIA GPU, and the query failed: {problem}"
    return None if is_available else "backend cuda needs an NVIDIA GPU, and none was found"


def worlds_in_thread_block(agents: int, worlds: int) -> int:
    """Return the number of worlds in a thread block.

    It fills `THREADS`, unless processors of the GPU would then be idle.
    """
    return max(1, min(THREADS // agents, worlds // PROCESSORS))


def _on_device(value: Any, stream: Any) -> Any:
    """Return a copy of a `MiniWorldModel` or `State` with arrays on the GPU."""
    if isinstance(value, np.ndarray):
        return cuda.to_device(value, stream)
    if not isinstance(value, tuple):
        return value
    entries = [_on_device(entry, stream) for entry in value]
    return value._make(entries) if hasattr(value, "_make") else tuple(entries)


def _fetch(host: Any, device: Any, stream: Any) -> None:
    """Copy every array of a state on the GPU to the host."""
    for host_value, device_value in zip(host, device, strict=True):
        if isinstance(host_value, np.ndarray):
            device_value.copy_to_host(host_value, stream)
        elif isinstance(host_value, tuple):
            _fetch(host_value, device_value, stream)


class CudaBatch:
    """Several runs of one experiment, simulated one generation at a time. Runs are independent.

    Worlds are padded to complete thread blocks. Padding worlds are simulated, but not reported.

    Raises
    ------
    ValueError
        If no GPU is available, or a world is larger than a thread block.
    """

    def __init__(self, experiment: Experiment, seed: int, runs: Sequence[int]) -> None:
        agents = experiment.population.size
        if problem := unavailable_reason():
            raise ValueError(problem)
        if agents > LARGEST_WORLD:
            raise ValueError(
                f"backend cuda simulates at most {LARGEST_WORLD} agents in a world: "
                f"population.size = {agents}"
            )
        if 2 * agents * experiment.lifetime.steps >= 2**31:
            raise ValueError(
                "backend cuda counts turns in 32 bits: lifetime.steps * population.size must be "
                "less than 2**30"
            )
        worlds = worlds_in_thread_block(agents, len(runs))
        padded = -(-len(runs) // worlds) * worlds
        self.model = make_model(experiment, padded)
        self._host = make_state(experiment, padded)
        self._host.keys[: len(runs)] = [(seed, run) for run in runs]
        self._shape = (len(runs), agents)
        self._stream = cuda.stream()
        self._launch = (padded // worlds, worlds * agents, self._stream)
        self._model = _on_device(self.model, self._stream)
        self._state = _on_device(self._host, self._stream)
        self._genomes = cuda.pinned_array(self._host.genome.shape, np.float32)
        self._genomes[:] = 0
        self._claims = cuda.device_array_like(self._host.touched, self._stream)
        source = make_kernel_source(
            self.model, self._host, experiment.lifetime.update == "sequential"
        )
        threads = LARGEST_WORLD if worlds * agents > LARGEST_WORLD // 2 else LARGEST_WORLD // 2
        with COMPILING:
            self._begin = make_birth_kernel(threads)
            self._simulate = make_simulation_kernel(threads, source, type(self._host.network).part)

    @property
    def state(self) -> State:
        """Return the current state, copied from the GPU."""
        _fetch(self._host, self._state, self._stream)
        self._stream.synchronize()
        return self._host

    def begin(self, generation: int, genomes: npt.NDArray[np.float32]) -> None:
        """Initialize a generation. `genomes` is [world, agent, module, weight]."""
        # The last genomes can still be in transfer.
        self._stream.synchronize()
        self._genomes[: len(genomes)] = genomes
        self._state.genome.copy_to_device(self._genomes, self._stream)
        self._state.generation.copy_to_device(np.array([generation], np.uint32), self._stream)
        with without_contraction():
            self._begin[self._launch](self._model, self._state, self._claims)

    def simulate(self, first_step: int, last_step: int) -> None:
        """Simulate the steps from `first_step` to `last_step` - 1.

        Return before the steps are done.
        """
        with without_contraction():
            self._simulate[self._launch](
                self._model, self._state, self._claims, first_step, last_step
            )

    def items(self) -> npt.NDArray[np.float32]:
        """Return the positions of the items, [world, item, (x, y)]."""
        state = self.state
        worlds = self._shape[0]
        return np.stack([state.item_x[:worlds], state.item_y[:worlds]], axis=-1)

    def eaten_in_life(self) -> npt.NDArray[np.int32]:
        """Wait, and return the items eaten so far in this lifetime, [world, agent, region]."""
        worlds, agents = self._shape
        self._state.eaten_in_life.copy_to_host(self._host.eaten_in_life, self._stream)
        self._stream.synchronize()
        return self._host.eaten_in_life[:, : worlds * agents].T.reshape(worlds, agents, -1).copy()

    def weights(self) -> npt.NDArray[np.float32]:
        """Wait, and return the current weights of the action module, [world, agent, weight]."""
        worlds, agents = self._shape
        self._state.weights.copy_to_host(self._host.weights, self._stream)
        self._stream.synchronize()
        return self._host.weights[:, : worlds * agents].T.reshape(worlds, agents, -1).copy()
