"""The key of the random numbers of a generation, and the types of the arrays of evolution."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from baldwinlab.engine import rng

Genome = npt.NDArray[np.float32]  # [agent, module, weight]
Fitness = npt.NDArray[np.float64]  # [agent]
Uniforms = npt.NDArray[np.float64]  # [index, draw, 4], in (0, 1)
Parents = npt.NDArray[np.int32]  # [child, 2], the fitter parent first


class GenerationKey(NamedTuple):
    """Seed, run and generation: the key of random numbers. Compiled functions accept it."""

    seed: int
    run: int
    generation: int

    def before(self) -> GenerationKey:
        """Return the generation before, of the same run."""
        return self._replace(generation=self.generation - 1)

    def uniforms(self, purpose: int, shape: tuple[int, int]) -> Uniforms:
        """Return uniform numbers in (0, 1), [index, draw, 4], of a `shape` [index, draw]."""
        return rng.uniforms(*self, purpose, shape)
