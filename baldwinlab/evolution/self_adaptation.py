"""The variation `self-adaptive`: mutations whose size is a gene.

Each agent has the gene `step_size`. A child inherits it from one of its parents. The gene then
mutates log-normally, before the weights. All weights mutate with the new step size, so selection
acts on step sizes by the weights that they produce.

Interpretation: weights and the step size are recombined discretely. Evolution strategies often use
the mean of the step sizes instead.

References
----------
.. [1] H.-P. Schwefel, Numerical Optimization of Computer Models (1981): inherited step sizes.
.. [2] H.-G. Beyer, "Evolution strategies", Scholarpedia 2 (2007): one step size for n weights, with
   the learning rate 1 / sqrt(2 n). Eiben and Smith (2015) state 1 / sqrt(n), up to a factor.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from baldwinlab.engine.arithmetic import normal_quantile
from baldwinlab.parts import Field, Gene, Mating, Variation

MIN_STEP_SIZE = 1e-4
MAX_STEP_SIZE = 10.0


class SelfAdaptive(Variation, name="self-adaptive"):
    """Each weight from either parent; then normal mutation with an inherited step size.

    References
    ----------
    Schwefel 1981; Beyer 2007.
    """

    initial_step_size: float = Field(
        0.1,
        ge=MIN_STEP_SIZE,
        le=MAX_STEP_SIZE,
        description="Standard deviation of the mutations of the founders.",
    )
    genes: ClassVar[Mapping[str, Gene]] = {
        "step_size": Gene(
            initial="initial_step_size",
            low=MIN_STEP_SIZE,
            high=MAX_STEP_SIZE,
            help="standard deviation of mutations",
        )
    }

    @staticmethod
    def vary(part: Any, mating: Mating) -> None:
        fitter = mating.fitter
        second = mating.second
        child = mating.child
        step_size = np.float64(child[0, part.step_size])
        for module in range(child.shape[0]):
            for weight in range(child.shape[1]):
                draw = module * child.shape[1] + weight
                takes_fitter = mating.draws[draw, 0] < 0.5
                inherited = fitter[module, weight] if takes_fitter else second[module, weight]
                mutation = np.float32(step_size * normal_quantile(mating.draws[draw, 1]))
                child[module, weight] = inherited + mutation
