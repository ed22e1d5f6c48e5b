"""Backend for NVIDIA GPUs: a batch of worlds on the GPU, with the code of `cuda_kernels.py`."""

from __future__ import annotations

import importlib.util
import math
from collections.abc import Sequence
from typing import Any, Final

import numpy as np
import numpy.typing as npt
from numba import config, cuda

from baldwinlab.core.errors import RefusedError
from baldwinlab.core.extras import missing_extra_error
from baldwinlab.core.resources import format_bytes
from baldwinlab.engine.gpu import compile_kernel, explain_failure
from baldwinlab.experiment import Experiment
from baldwinlab.models.miniworld.allocation import (
    find_array,
    list_hooks,
    make_model,
    make_state,
    state_bytes,
)
from baldwinlab.models.miniworld.backends.cuda_kernels import (
    AGENT_HOOKS,
    make_birth_kernel,
    make_kernel_source,
    make_simulation_kernel,
)
from baldwinlab.models.miniworld.state import State
from baldwinlab.models.miniworld.world_layout import make_world_layout

# Approximate number of threads in a block. A barrier then waits for few threads, and several worlds
# of 20 agents fill warps (groups of 32 threads) almost completely.
THREADS_PER_BLOCK: Final = 128
# Number of multiprocessors of an H200.
N_MULTIPROCESSORS: Final = 132
# Maximum number of agents in a world, which is the maximum number of threads in a block.
MAX_AGENTS: Final = 1024


def unavailable_reason() -> str | None:
    """Return the reason why the backend is unavailable, or None if the backend is available."""
    if config.ENABLE_CUDASIM:
        return None
    if importlib.util.find_spec("numba_cuda") is None:
        return str(missing_extra_error("cuda", "backend cuda"))
    # A driver can raise any exception.
    try:
        is_available = cuda.is_available()
    except Exception as error:
        return f"backend cuda needs an NVIDIA GPU, and the query failed: {error}"
    return None if is_available else "backend cuda needs an NVIDIA GPU, and none was found"


def worlds_in_thread_block(agents: int, worlds: int) -> int:
    """Return the number of worlds in a thread block.

    The worlds have about `THREADS_PER_BLOCK` agents, unless multiprocessors would then be idle.
    """
    return max(1, min(THREADS_PER_BLOCK // agents, worlds // N_MULTIPROCESSORS))


def _on_device(value: Any, stream: Any) -> Any:
    """Return a copy of a `MiniWorldModel` or `State` with arrays on the GPU."""
    if isinstance(value, np.ndarray):
        return cuda.to_device(value, stream)
    if not isinstance(value, tuple):
        return value
    entries = [_on_device(entry, stream) for entry in value]
    return value._make(entries) if hasattr(value, "_make") else tuple(entries)


def _fetch(host: Any, device: Any, stream: Any) -> None:
    """Copy every array of the state `device` on the GPU to the state `host` in CPU memory."""
    for host_value, device_value in zip(host, device, strict=True):
        if isinstance(host_value, np.ndarray):
            device_value.copy_to_host(host_value, stream)
        elif isinstance(host_value, tuple):
            _fetch(host_value, device_value, stream)


class CudaBatch:
    """Several runs of one experiment, simulated one generation at a time. Runs are independent.

    Worlds are padded to complete thread blocks. Padding worlds are simulated, but not reported.
    """

    def __init__(self, experiment: Experiment, seed: int, runs: Sequence[int]) -> None:
        _require_supported(experiment)
        agents = experiment.agents_per_world
        self._layout = make_world_layout(experiment, seed, runs)
        n_worlds = len(self._layout.keys)
        worlds_in_block = worlds_in_thread_block(agents, n_worlds)
        n_blocks = math.ceil(n_worlds / worlds_in_block)
        padded_worlds = n_blocks * worlds_in_block
        _require_memory(experiment, padded_worlds)
        self.model = make_model(experiment, padded_worlds)
        self._host = make_state(experiment, padded_worlds)
        self._host.keys[:n_worlds] = self._layout.keys
        self._shape = self._layout.shape
        threads_in_block = worlds_in_block * agents
        with explain_failure():
            self._stream = cuda.stream()
            self._model = _on_device(self.model, self._stream)
            self._state = _on_device(self._host, self._stream)
            self._claims = cuda.device_array_like(self._host.touched, self._stream)
            # Only pinned memory is transferred while the CPU does other work.
            self._genomes = cuda.pinned_array(self._host.genome.shape, np.float32)
            self._genomes[:] = 0
            self._results: dict[str, npt.NDArray[Any]] = {}
        source = make_kernel_source(
            self.model, self._host, experiment.lifetime.update == "sequential"
        )
        # Kernels are compiled for blocks of at most 512 or at most 1024 threads.
        small_block = MAX_AGENTS // 2
        max_threads = MAX_AGENTS if threads_in_block > small_block else small_block
        birth = make_birth_kernel(max_threads)
        simulation = make_simulation_kernel(max_threads, source, type(self._host.network).part)
        hooks = (*list_hooks(self._host), *AGENT_HOOKS)
        launch = (n_blocks, threads_in_block, self._stream)
        self._arguments = (self._model, self._state, self._claims)
        self._begin = compile_kernel(birth, hooks, launch, self._arguments)
        self._simulate = compile_kernel(simulation, hooks, launch, (*self._arguments, 0, 0))

    @property
    def state(self) -> State:
        """Return the current state, copied from the GPU."""
        with explain_failure():
            _fetch(self._host, self._state, self._stream)
            self._stream.synchronize()
        return self._host

    def begin(self, generation: int, genomes: npt.NDArray[np.float32]) -> None:
        """Initialize a generation. `genomes` is [run, agent, module, weight].

        The call can return before the GPU has started.
        """
        genomes_by_world = self._layout.distribute(genomes)
        with explain_failure():
            # The genomes of the previous generation can still be in transfer.
            self._stream.synchronize()
            self._genomes[: len(genomes_by_world)] = genomes_by_world
            self._state.genome.copy_to_device(self._genomes, self._stream)
            self._state.generation.copy_to_device(np.array([generation], np.uint32), self._stream)
            self._begin(*self._arguments)

    def simulate(self, first_step: int, last_step: int) -> None:
        """Simulate the steps from `first_step` to `last_step` - 1.

        The call can return before the GPU has finished the steps.
        """
        with explain_failure():
            self._simulate(*self._arguments, first_step, last_step)

    def items(self) -> npt.NDArray[np.float32]:
        """Return the positions of the items, [world, item, (x, y)]."""
        return np.stack([self.by_world("item_x"), self.by_world("item_y")], axis=-1)

    def eaten_in_life(self) -> npt.NDArray[np.int32]:
        """Wait for the steps. Return the numbers of eaten items, [population, agent, region]."""
        return self.by_agent("eaten_in_life")

    def weights(self) -> npt.NDArray[np.float32]:
        """Wait for the steps. Return the current weights, [population, agent, weight]."""
        return self.by_agent("weights")

    def positions(self) -> npt.NDArray[np.float32]:
        """Wait for the steps. Return the positions of the agents, [population, agent, (x, y)]."""
        return self.by_agent("positions")

    def by_agent(self, name: str) -> npt.NDArray[Any]:
        """Wait for the steps. Return a copy [population, agent, row] of an array [row, lane]."""
        array = self._fetch_array(name)
        return array[:, : math.prod(self._shape)].T.reshape(*self._shape, -1).copy()

    def by_world(self, name: str) -> npt.NDArray[Any]:
        """Wait for the steps. Return a copy of an array [world, ...]."""
        return self._fetch_array(name)[: len(self._layout.keys)].copy()

    def _fetch_array(self, name: str) -> npt.NDArray[Any]:
        """Return an array of the state by its path, copied from the GPU."""
        host, device = (find_array(state, name) for state in (self._host, self._state))
        with explain_failure():
            # An empty array cannot be pinned.
            if name not in self._results and host.size:
                self._results[name] = cuda.pinned_array(host.shape, host.dtype)
            array = self._results.setdefault(name, host)
            device.copy_to_host(array, self._stream)
            self._stream.synchronize()
        return array


def _require_supported(experiment: Experiment) -> None:
    """Raise ValueError if the machine has no GPU, or if the kernels cannot count the agents."""
    if reason := unavailable_reason():
        raise ValueError(reason)
    agents = experiment.agents_per_world
    if agents > MAX_AGENTS:
        raise ValueError(
            f"backend cuda simulates at most {MAX_AGENTS} agents in a world: "
            f"population.size / population.worlds = {agents}"
        )
    # A claim is twice the number of a turn (`items.contend`).
    max_claim = 2 * agents * experiment.lifetime.steps
    if max_claim >= 2**31:
        raise ValueError(
            "backend cuda counts turns in 32 bits: lifetime.steps * population.size / "
            "population.worlds must be less than 2**30"
        )


def _require_memory(experiment: Experiment, worlds: int) -> None:
    """Raise RefusedError if a batch does not fit into the free memory of the GPU."""
    n_bytes = state_bytes(experiment, worlds)
    with explain_failure():
        free_bytes = cuda.current_context().get_memory_info().free
    if n_bytes > free_bytes:
        raise RefusedError(
            f"the GPU has {format_bytes(free_bytes)} of free memory, but a batch of {worlds:,} "
            f"worlds needs {format_bytes(n_bytes)}: use the backend cpu, or fewer runs"
        )
