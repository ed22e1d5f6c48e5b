"""Where in a study random numbers are drawn, and the arrays that evolution works on."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from baldwinlab.engine import rng

Genome = npt.NDArray[np.float32]  # [agent, module, weight]
Fitness = npt.NDArray[np.float64]  # [agent]
Uniforms = npt.NDArray[np.float64]  # [index, draw, 4], in (0, 1)
Parents = npt.NDArray[np.int32]  # [child, 2], the fitter one first


class GenerationKey(NamedTuple):
    """A generation of a run of a study; compiled functions take it as it is."""

    seed: int
    run: int
    generation: int

    def before(self) -> GenerationKey:
        """Return the generation before, of the same run."""
        return self._replace(generation=self.generation - 1)

    def uniforms(self, purpose: int, shape: tuple[int, int]) -> Uniforms:
        return rng.uniforms(*self, purpose, shape)
