"""Choose the backend: CPU or NVIDIA GPU. Results are bit-identical, so only the speed differs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Final, NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from baldwinlab.experiment import Experiment
from baldwinlab.models.miniworld.backends import cpu
from baldwinlab.models.miniworld.backends.species import SpeciesBatch
from baldwinlab.models.miniworld.state import MiniWorldModel, State

# Estimate of the minimum number of worlds for the GPU. With fewer worlds, most of the GPU is idle.
MIN_GPU_WORLDS: Final = 128

# Best number of worlds in a batch on the GPU.
GPU_WORLDS: Final = 16384


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


CPU: Final = Backend(name="cpu", batch=cpu.make_batch, worlds=64, species_batch=SpeciesBatch)


def choose_backend(name: str = "auto", worlds: int = 1, agents: int = 1) -> Backend:
    """Return a backend by name.

    With "auto", return the faster available backend for `worlds` worlds of `agents` agents each.
    """
    if name not in ("auto", "cpu", "cuda"):
        raise ValueError(f"backend = {name!r} must be one of auto, cpu, cuda")
    if name == "cpu" or (name == "auto" and worlds < MIN_GPU_WORLDS):
        return CPU
    # Imported on demand, because the import is slow.
    from baldwinlab.models.miniworld.backends import cuda

    reason = cuda.unavailable_reason()
    if reason and name == "cuda":
        raise ValueError(reason)
    too_large = name == "auto" and agents > cuda.MAX_AGENTS
    if reason or too_large:
        return CPU
    return Backend(name="cuda", batch=cuda.CudaBatch, worlds=GPU_WORLDS)


def require_species_batch(backend: Backend) -> SpeciesBatchClass:
    """Return the class of a batch with species. Raise ValueError if the backend has none."""
    if backend.species_batch is None:
        raise ValueError(
            f"backend = {backend.name!r} must be cpu or auto: an experiment with "
            "population.species runs on the CPU only"
        )
    return backend.species_batch
