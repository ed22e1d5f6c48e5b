"""NK landscapes: bit strings on rugged ground, which climb in life; how learning guides evolution there, and hides it.

    baldwinlab reproduce mayley-1996

The fitness of a string of N bits is the mean of N tables, each asked by its own bit and K others,
drawn at random, scaled so that the worst string has 0 and the best 1. In each trial of a life one
bit, drawn at random, is flipped, and stays so if that is better. What is learned is not inherited,
and each bit in which an agent at death differs from its genome may cost it something. Each run has
a landscape of its own, the same in all conditions, and begins with one random string for all.

Sources: S. A. Kauffman, The Origins of Order (1993), for the landscape; G. Mayley, "Landscapes,
learning costs, and genetic assimilation", Evolutionary Computation 4 (1996), and "Guiding or
hiding", ECAL 97, for learning on it and its costs. His constants were not recovered: those here are
readings.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from typing import Any, ClassVar, Final

import numpy as np
import numpy.typing as npt
import xarray as xr

from baldwinlab.engine import poison
from baldwinlab.engine.jit import jit_entry_point
from baldwinlab.evolution.variation import Draws, OneGenome
from baldwinlab.parts import (
    LIFE,
    OF_AGENT,
    Field,
    LifeResults,
    Measure,
    Model,
    PathView,
    Variable,
    Variation,
    View,
    uniforms,
)

BEFORE_LIFE: Final = (
    2**32 - 1
)  # the generation whose random numbers are the landscape's and the first string's
LONGEST: Final = 16  # bits, as all strings are looked at, to scale the landscape


@lru_cache(maxsize=64)
def landscape(seed: int, run: int, bits: int, others: int) -> npt.NDArray[np.float64]:
    """The fitness of every string of so many bits, [string as a number], from 0 of the worst to 1 of the best."""
    draws = uniforms(seed, run, BEFORE_LIFE, LIFE, (bits, max(bits, 2 ** (others + 1))))
    strings = np.arange(2**bits)
    total = np.zeros(2**bits)
    for bit in range(bits):
        order = np.argsort(draws[bit, :bits, 1])
        asked = [bit, *[int(other) for other in order if other != bit][:others]]
        place = sum(((strings >> other) & 1) << power for power, other in enumerate(asked))
        total += draws[bit, : 2 ** (others + 1), 0][place]
    scaled: npt.NDArray[np.float64] = (total - total.min()) / (total.max() - total.min())
    scaled.flags.writeable = False  # as it is kept
    return scaled


def _mean(name: str, generation: int) -> Callable[[xr.Dataset], xr.DataArray]:
    """Of a generation, or of the last where there are not so many."""
    return lambda runs: (
        runs[name].isel(generation=min(generation, runs.sizes["generation"] - 1)).mean("agent")
    )


def _climb(model: NKClimbers, key: Any, genomes: npt.NDArray[np.float32], agent: int) -> PathView:
    """The height of everybody's string after each trial, as `live` has it."""
    height = landscape(key.seed, key.run, model.bits, model.k)
    chosen = key.uniforms(LIFE, (len(genomes), model.trials))[:, :, 0]
    strings = model.numbers(genomes)
    heights = [height[strings]]
    for trial in range(model.trials):
        climb(height, model.bits, chosen[:, trial : trial + 1], strings)
        heights.append(height[strings])
    all_agents = np.stack(heights)
    lines = {
        f"agent {agent}": all_agents[:, agent],
        "average of all": all_agents.mean(axis=1),
        "best of all": all_agents.max(axis=1),
    }
    return PathView(lines, "trial", "fitness of the string, without its cost")


class NKClimbers(Model, name="nk-climbers"):
    """Bit strings that climb an NK landscape during life."""

    bits: int = Field(16, ge=2, le=LONGEST, description="Number of bits, N.")
    k: int = Field(
        0,
        ge=0,
        le=LONGEST - 1,
        description="Number of further bits on which the fitness of a bit depends, K.",
    )
    trials: int = Field(
        30,
        ge=0,
        le=10_000,
        description=(
            "Number of learning trials in a lifetime, each with one flipped bit. 0: no learning."
        ),
    )
    cost_per_bit: float = Field(
        0.0,
        ge=0,
        le=1,
        description="Cost per bit that differs between birth and death, in fitness.",
    )

    defaults: ClassVar[Mapping[str, Mapping[str, Any]]] = {
        "population": {"size": 100},
        "evolution": {
            "generations": 151,
            "selection": "larger-tournament",
            "variation": "bit-flips",
            "mutation_rate": 1 / 32,
        },
        "record": {"genome_every": 5},
    }
    records: ClassVar[Mapping[str, Variable]] = {
        "innate": Variable(OF_AGENT, np.float32, "1", "fitness of the string at birth, 0 to 1"),
        "learned": Variable(
            OF_AGENT, np.float32, "1", "fitness of the string at death, without the cost, 0 to 1"
        ),
        "changed": Variable(
            OF_AGENT, np.int32, "bits", "number of bits that differ between birth and death"
        ),
    }
    alleles: ClassVar[Mapping[str, float]] = {"0": 0.0, "1": 1.0}
    views: ClassVar[Mapping[str, View]] = {
        "climb": View(
            (
                "Fitness of a string after each trial of its lifetime, compared with the "
                "average and the best of its generation."
            ),
            _climb,
        )
    }
    measures: ClassVar[Mapping[str, Measure]] = {
        "innate": Measure("innate fitness in generation 150", _mean("innate", 150)),
        "changed": Measure("bits changed by learning in generation 150", _mean("changed", 150)),
        "changed-at-first": Measure(
            "bits changed by learning in generation 2", _mean("changed", 2)
        ),
        "changed-falls": Measure(
            "bits changed by learning in generation 2 minus those in generation 150",
            lambda runs: _mean("changed", 2)(runs) - _mean("changed", 150)(runs),
        ),
    }

    @property
    def learns(self) -> bool:
        return self.trials > 0

    @property
    def steps(self) -> int:
        return max(1, self.trials)

    def check(self, experiment: Any) -> None:
        if self.k >= self.bits:
            raise ValueError(
                f"nk_climbers.k = {self.k} must be less than nk_climbers.bits = {self.bits}"
            )

    def without_learning(self) -> NKClimbers:
        return self.model_copy(
            update={"trials": 0, "cost_per_bit": 0.0}
        )  # who changes no bit pays for none

    def weights(self) -> int:
        return self.bits

    def founders(self, agents: int, key: Any) -> npt.NDArray[np.float32]:
        first = uniforms(key.seed, key.run, BEFORE_LIFE - 1, LIFE, (1, self.bits))[0, :, 0]
        return np.broadcast_to((first < 0.5).astype(np.float32), (agents, 1, self.bits)).copy()

    def numbers(self, genomes: npt.NDArray[np.float32]) -> npt.NDArray[np.int64]:
        """The strings [..., agent] of genomes [..., agent, module, bit], each as a number."""
        strings: npt.NDArray[np.int64] = (genomes[..., 0, :] > 0.5).astype(np.int64) @ (
            1 << np.arange(self.bits)
        )
        return strings

    def simulate(
        self, seed: int, runs: Sequence[int], generation: int, genomes: npt.NDArray[np.float32]
    ) -> LifeResults:
        powers = 1 << np.arange(self.bits)
        born = self.numbers(genomes)
        died, innate, learned = born.copy(), poison.empty(born.shape), poison.empty(born.shape)
        for place, run in enumerate(runs):
            height = landscape(seed, run, self.bits, self.k)
            chosen = uniforms(seed, run, generation, LIFE, (born.shape[1], self.trials))[:, :, 0]
            innate[place] = height[born[place]]
            climb(height, self.bits, chosen, died[place])
            learned[place] = height[died[place]]
        changed = ((born ^ died)[..., None] & powers > 0).sum(axis=-1)
        at_death = ((died[..., None] & powers) > 0).astype(np.float32)
        records = {
            "innate": innate.astype(np.float32),
            "learned": learned.astype(np.float32),
            "changed": changed.astype(np.int32),
        }
        return LifeResults(learned, self.cost_per_bit * changed, at_death, records)


@jit_entry_point
def climb(height: Any, bits: int, chosen: Any, strings: Any) -> None:
    """Let every string [agent] flip a bit in each trial, where that is better; `chosen` [agent, trial] are uniform numbers."""
    for agent in range(strings.size):
        for trial in range(chosen.shape[1]):
            flipped = strings[agent] ^ (1 << int(chosen[agent, trial] * bits))
            if height[flipped] > height[strings[agent]]:
                strings[agent] = flipped


class BitFlips(Variation, name="bit-flips"):
    """Copy of one parent, chosen at random; each bit can flip.

    References
    ----------
    Mayley 1996.
    """

    settings: ClassVar[tuple[str, ...]] = ("mutation_rate",)
    derived: ClassVar[Mapping[str, Any]] = {
        "rate": lambda part, experiment: float(experiment.evolution.mutation_rate)
    }

    @staticmethod
    def vary(
        part: Any, fitter: OneGenome, other: OneGenome, draws: Draws, gate: float, child: OneGenome
    ) -> None:
        for module in range(child.shape[0]):
            for bit in range(child.shape[1]):
                inherited = fitter[module, bit] if gate < 0.5 else other[module, bit]
                flips = draws[module * child.shape[1] + bit, 1] < part.rate
                child[module, bit] = np.float32(1) - inherited if flips else inherited

    @staticmethod
    def oracle(part: Any, fitter: Any, other: Any, draws: Any, gate: float) -> Any:
        parent, rest = fitter if gate < 0.5 else other, iter(draws)
        return [
            [1 - bit if next(rest)[1] < part.rate else bit for bit in module] for module in parent
        ]
