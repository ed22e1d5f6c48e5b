"""Choose the backend: CPU or NVIDIA GPU. Results are bit-identical, so only the speed differs.

The rule of "auto" is data: the speeds below, which were measured on one machine with 16 cores and
an NVIDIA H100 (docs/development/benchmarks.md).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Final, NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from baldwinlab.experiment import Experiment
from baldwinlab.models.miniworld.backends import cpu
from baldwinlab.models.miniworld.backends.species import SpeciesBatch
from baldwinlab.models.miniworld.state import MiniWorldModel, State

# Agent-steps per second of one core, with evolution and storage: six conditions of the paper, 64
# runs each, 10 generations (3.84e8 agent-steps in 10.5 s).
CPU_RATE: Final = 3.7e7
# Number of agents of all worlds -> agent-steps per second of the GPU: lifetimes of
# evo+self-taught/A, worlds of 20 agents. Few agents leave most of the GPU idle.
GPU_RATES: Final = {
    0: 0.0,
    30 * 20: 5.7e7,
    180 * 20: 3.3e8,
    2_640 * 20: 2.1e9,
    21_120 * 20: 2.7e9,
}
# Seconds in which a process starts the driver and loads stored kernels. The first start of a
# kernel also compiles it, which is not counted because it happens once per user.
GPU_START_SECONDS: Final = 3.0

# Best number of worlds in a batch on the GPU.
GPU_WORLDS: Final = 16384
# Number of tasks into which the runs of a condition are divided, each with a stream. While the GPU
# simulates some of them, threads create the next generation of the others or store runs.
GPU_TASKS: Final = 4


class SimulatedAgents(Protocol):
    """The agents of several runs, and the simulation of steps."""

    model: MiniWorldModel

    @property
    def state(self) -> State: ...

    def simulate(self, first_step: int, last_step: int) -> None: ...

    def items(self) -> npt.NDArray[np.float32]: ...

    def eaten_in_life(self) -> npt.NDArray[np.int32]: ...

    def weights(self) -> npt.NDArray[np.float32]: ...

    def positions(self) -> npt.NDArray[np.float32]: ...

    def by_agent(self, name: str) -> npt.NDArray[Any]: ...

    def by_world(self, name: str) -> npt.NDArray[Any]: ...


class Batch(SimulatedAgents, Protocol):
    """Several runs of one experiment, simulated one generation at a time."""

    def begin(self, generation: int, genomes: npt.NDArray[np.float32]) -> None: ...


SpeciesBatchClass = Callable[[Experiment, int, Sequence[int], Sequence[int]], SpeciesBatch]
"""Class of a batch of several species: (experiment, seed, runs, numbers of agents of species)."""


class Backend(NamedTuple):
    """A backend, and the best size of a batch."""

    # Name of the backend: cpu or cuda.
    name: str
    # Class of a batch, with the arguments experiment, seed and runs.
    batch: Callable[[Experiment, int, Sequence[int]], Batch]
    # Best number of worlds in a batch.
    worlds: int
    # None if the backend cannot simulate species.
    species_batch: SpeciesBatchClass | None = None
    # Number of tasks that keep the backend busy. None if every worker needs a task.
    tasks: int | None = None


CPU: Final = Backend(name="cpu", batch=cpu.make_batch, worlds=64, species_batch=SpeciesBatch)


class Workload(NamedTuple):
    """The lifetimes of a study, and the number of cores that could simulate them."""

    worlds: int = 1  # Number of worlds that are simulated side by side.
    agents: int = 1  # Number of agents in each world.
    steps: int = 1  # Number of steps of all generations.
    cores: int = 1


ONE_WORLD: Final = Workload()


def is_gpu_faster(workload: Workload) -> bool:
    """Return whether a GPU saves more time in the lifetimes than its start takes."""
    agents = workload.worlds * workload.agents
    gpu_rate = np.interp(agents, list(GPU_RATES), list(GPU_RATES.values()))
    cpu_rate = CPU_RATE * workload.cores
    seconds_per_agent_step = 1 / cpu_rate - 1 / gpu_rate
    return bool(seconds_per_agent_step * agents * workload.steps > GPU_START_SECONDS)


def choose_backend(name: str = "auto", workload: Workload = ONE_WORLD) -> Backend:
    """Return a backend by name. With "auto", return the faster available backend."""
    if name not in ("auto", "cpu", "cuda"):
        raise ValueError(f"backend = {name!r} must be one of auto, cpu, cuda")
    if name == "cpu" or (name == "auto" and not is_gpu_faster(workload)):
        return CPU
    # Imported on demand, because the import is slow.
    from baldwinlab.models.miniworld.backends import cuda

    reason = cuda.unavailable_reason()
    if reason and name == "cuda":
        raise ValueError(reason)
    too_large = name == "auto" and workload.agents > cuda.MAX_AGENTS
    if reason or too_large:
        return CPU
    return Backend(name="cuda", batch=cuda.CudaBatch, worlds=GPU_WORLDS, tasks=GPU_TASKS)


def require_species_batch(backend: Backend) -> SpeciesBatchClass:
    """Return the class of a batch with species. Raise ValueError if the backend has none."""
    if backend.species_batch is None:
        raise ValueError(
            f"backend = {backend.name!r} must be cpu or auto: an experiment with "
            "population.species runs on the CPU only"
        )
    return backend.species_batch
