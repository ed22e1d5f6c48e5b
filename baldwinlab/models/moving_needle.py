"""A needle in a haystack that moves: strings that guess in life, where what is right changes from generation to generation.

    baldwinlab reproduce le-2018

At first right is 1 at every locus, as in `needle.py`; then, every so many generations, some loci are drawn, and for each a coin
says anew which allele is right there. Where nothing is ever drawn anew, a run is that of `needle.py`, to the bit.

Source: N. Le, A. Brabazon and M. O'Neill, "How the Baldwin effect can guide evolution in dynamic environments", TPNC 2018, for
the idea; its parameters were not recovered, and those here are ours. The strings are those of Hinton and Nowlan 1987.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt
import xarray as xr

from baldwinlab.models.hinton_nowlan import HintonNowlan
from baldwinlab.parts import LIFE, OF_AGENT, Field, LifeResults, Measure, Variable, uniforms

_NAMES = {
    "ones": "right",
    "zeros": "wrong",
    "unset": "unset",
    "succeeded": "succeeded",
    "used": "used",
}  # as records are called


def _in_second_half(record: str) -> Callable[[xr.Dataset], xr.DataArray]:
    """The mean of a run's second half, in which the needle moves many times."""
    return lambda runs: (
        runs[record]
        .isel(generation=slice(runs.sizes["generation"] // 2, None))
        .mean(("generation", "agent"))
    )


class MovingNeedle(HintonNowlan, name="moving-needle"):
    """Bit strings that learn by guessing, with a target that changes over the generations."""

    period: int = Field(
        10,
        ge=0,
        le=1_000_000,
        description="Number of generations between changes of the target. 0: never.",
    )
    redrawn_loci: int = Field(
        2,
        ge=1,
        le=60,
        description=(
            "Number of loci drawn at a change, with replacement. The new target of each is random."
        ),
    )

    defaults: ClassVar[Mapping[str, Mapping[str, Any]]] = {
        "population": {"size": 1000},
        "evolution": {"generations": 201, "variation": "one-point-alleles", "mutation_rate": 0.01},
        "record": {"genome_every": 10},
    }
    records: ClassVar[Mapping[str, Variable]] = {
        _NAMES[name]: of
        for name, of in HintonNowlan.records.items()
        if name not in ("ones", "zeros")
    } | {
        "right": Variable(OF_AGENT, np.float32, "1", "share of correct alleles in this generation"),
        "wrong": Variable(OF_AGENT, np.float32, "1", "share of wrong alleles in this generation"),
    }
    measures: ClassVar[Mapping[str, Measure]] = {
        "fitness": Measure("fitness in the second half of the run", _in_second_half("energy")),
        "right": Measure(
            "share of correct alleles in the second half of the run", _in_second_half("right")
        ),
        "unset": Measure("share of ? in the second half of the run", _in_second_half("unset")),
        "succeeded": Measure(
            "share of agents that succeed in the second half of the run",
            _in_second_half("succeeded"),
        ),
    }

    def simulate(
        self, seed: int, runs: Sequence[int], generation: int, genomes: npt.NDArray[np.float32]
    ) -> LifeResults:
        """Where 0 is right, 0 and 1 change places for a life of `needle.py`; a ?, which is 0.5, is what it was."""
        zero = np.stack([self.right(seed, run, generation) == 0 for run in runs])[:, None, None]
        lives = super().simulate(seed, runs, generation, np.where(zero, 1 - genomes, genomes))
        learned = (
            np.where(zero[:, :, 0], 1 - lives.learned, lives.learned)
            if lives.learned is not None
            else None
        )
        return LifeResults(
            lives.energy,
            lives.cost,
            learned,
            {_NAMES[name]: record for name, record in lives.records.items()},
        )

    def right(self, seed: int, run: int, generation: int) -> npt.NDArray[np.int64]:
        """The alleles [locus] that are right in a generation, 0 or 1."""
        found = np.ones(self.loci, np.int64)
        for moved in range(self.period, generation + 1, self.period) if self.period else ():
            draws = uniforms(seed, run, moved, LIFE, (1, 1 + self.redrawn_loci))[
                0, 1:
            ]  # the first is somebody's luck
            for place, coin in draws[:, :2]:
                found[int(place * self.loci)] = coin < 0.5
        return found
