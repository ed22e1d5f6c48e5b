"""The key of the random numbers of a generation, and the types of arrays in evolution."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from baldwinlab.engine import rng

# Genomes of a population, [agent, module, weight].
Genome = npt.NDArray[np.float32]
# Fitness of a population, [agent].
Fitness = npt.NDArray[np.float64]
# Random numbers in (0, 1), [index, draw, 4]. The index is usually a child.
Uniforms = npt.NDArray[np.float64]
# Indices of the parents, [child, 2], the fitter parent first.
Parents = npt.NDArray[np.int32]


class GenerationKey(NamedTuple):
    """Seed, run and generation, which determine the random numbers of a generation."""

    seed: int
    run: int
    generation: int

    def previous(self) -> GenerationKey:
        """Return the key of the previous generation of the same run."""
        return self._replace(generation=self.generation - 1)

    def uniforms(self, purpose: int, shape: tuple[int, int]) -> Uniforms:
        """Return uniform numbers in (0, 1), of shape (*shape, 4): [index, draw, 4]."""
        return rng.uniforms(*self, purpose, shape)
