"""Where lives are lived: on the CPU, or on an NVIDIA GPU. To the same bits, so the choice is one of speed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final, NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from baldwinlab.experiment import Experiment
from baldwinlab.models.miniworld.backends import cpu
from baldwinlab.models.miniworld.state import Model, State

MIN_GPU_WORLDS: Final = 128  # worlds: with fewer, most of a GPU idles. Reasoned, not measured.


class Batch(Protocol):
    """Several runs of one experiment that live side by side, a generation at a time."""

    model: Model

    @property
    def state(self) -> State: ...

    def begin(self, generation: int, genomes: npt.NDArray[np.float32]) -> None: ...

    def simulate(self, first_step: int, last_step: int) -> None: ...

    def items(self) -> npt.NDArray[np.float32]: ...

    def eaten_in_life(self) -> npt.NDArray[np.int32]: ...

    def weights(self) -> npt.NDArray[np.float32]: ...


class Backend(NamedTuple):
    name: str  # "cpu" or "cuda"
    batch: Callable[
        [Experiment, int, Sequence[int]], Batch
    ]  # of an experiment, a seed, and the runs of a study
    worlds: int  # that best live side by side in a batch, if there are so many


CPU: Final = Backend("cpu", cpu.Batch, 4)  # 80 lanes, whose weights stay in the first-level cache


def choose_backend(name: str = "auto", worlds: int = 1, agents: int = 1) -> Backend:
    """The backend of that name; for "auto", the faster one that can be used here for so many worlds, with so many agents in each.

    Raises ValueError, with a sentence for the user, if the backend asked for cannot be used.
    """
    if name not in ("auto", "cpu", "cuda"):
        raise ValueError(f"backend = {name!r} must be one of auto, cpu, cuda")
    if name == "cpu" or (name == "auto" and worlds < MIN_GPU_WORLDS):
        return CPU
    from baldwinlab.models.miniworld.backends import cuda  # here, because to load it takes a while

    problem = cuda.unavailable_reason()
    if problem and name == "cuda":
        raise ValueError(problem)
    too_large = name == "auto" and agents > cuda.LARGEST_WORLD
    return CPU if problem or too_large else Backend("cuda", cuda.Batch, 16384)
