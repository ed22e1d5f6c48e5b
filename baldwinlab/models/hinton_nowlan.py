"""Hinton and Nowlan's model: strings of 0, 1 and ? that guess the value of each ? during life.

    baldwinlab reproduce hinton-nowlan-1987

The correct allele is 1 at every locus. This is no restriction: the model does not depend on which
allele is correct. In each trial of its life, an agent sets each ? to 0 or 1 at random. A failed
trial leaves no trace. The agent stops at the first trial in which all loci are correct. The
remaining trials add up to 19 to its fitness. In a genome, the number 0.5 represents ?.

References
----------
G. E. Hinton and S. J. Nowlan, "How learning can guide evolution", Complex Systems 1 (1987).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, ClassVar, Final, Literal

import numpy as np
import numpy.typing as npt
import xarray as xr

from baldwinlab.engine import poison
from baldwinlab.evolution.variation import Draws, OneGenome
from baldwinlab.evolution.variation_operators import (
    cross_at_point,
    draw_cut,
    flatten,
    is_from_fitter,
    split_modules,
)
from baldwinlab.parts import (
    FOUNDER,
    LIFE,
    OF_AGENT,
    Field,
    LifeResults,
    Measure,
    Model,
    Variable,
    Variation,
    uniforms,
)

# The allele ?.
UNSET_ALLELE: Final = 0.5
# Largest gain in fitness above the baseline of 1.
MAX_GAIN: Final = 19.0


def _last_mean(allele: str) -> Callable[[xr.Dataset], xr.DataArray]:
    """Return the mean of a record in the last generation."""
    return lambda runs: runs[allele].isel(generation=-1).mean("agent")


def _take_off(runs: xr.Dataset) -> xr.DataArray:
    """Return the first generation in which half of the agents succeed."""
    succeeds = runs["succeeded"].mean("agent") >= 0.5
    return succeeds.argmax("generation").where(succeeds.any("generation"))


def _unset_at_take_off(runs: xr.Dataset) -> xr.DataArray:
    generation = _take_off(runs)
    shares = runs["unset"].mean("agent").isel(generation=generation.fillna(0).astype(int))
    return shares.where(generation.notnull())


class HintonNowlan(Model, name="hinton-nowlan"):
    """Bit strings that learn by guessing undefined loci.

    The correct allele is 1 at every locus.
    In each trial of its life, an agent sets each `?` to 0 or 1 at random.
    A failed trial leaves no trace.
    Fitness is higher, the earlier a trial is correct at all loci.
    """

    loci: int = Field(20, ge=1, le=60, description="Number of loci.")
    trials: int = Field(1000, ge=1, le=100_000, description="Number of trials in a lifetime.")
    guessing: bool = Field(
        True, description="Whether agents guess each ?. Otherwise ? is never correct."
    )
    initial_unset_share: float = Field(
        0.5,
        ge=0,
        le=1,
        description=(
            "Share of ? among the alleles of the founders. The others are 0 and 1 in equal shares."
        ),
    )
    counts_success: bool = Field(True, description="Whether the successful trial counts as used.")

    defaults: ClassVar[Mapping[str, Mapping[str, Any]]] = {
        "population": {"size": 1000},
        "evolution": {"generations": 51, "variation": "one-point-alleles", "mutation_rate": 0.0},
    }
    records: ClassVar[Mapping[str, Variable]] = {
        "ones": Variable(
            OF_AGENT, np.float32, "1", "share of alleles that are 1, the correct allele"
        ),
        "unset": Variable(OF_AGENT, np.float32, "1", "share of alleles that are ?"),
        "zeros": Variable(OF_AGENT, np.float32, "1", "share of alleles that are 0"),
        "succeeded": Variable(
            OF_AGENT, np.int32, "1", "1 if all alleles were correct in a trial, else 0"
        ),
        "used": Variable(OF_AGENT, np.int32, "trials", "number of trials in the lifetime"),
    }
    alleles: ClassVar[Mapping[str, float]] = {"0": 0.0, "?": UNSET_ALLELE, "1": 1.0}
    clock: ClassVar[str] = "used"
    measures: ClassVar[Mapping[str, Measure]] = {
        "ones": Measure("share of 1 in the last generation", _last_mean("ones")),
        "unset": Measure("share of ? in the last generation", _last_mean("unset")),
        "zeros": Measure("share of 0 in the last generation", _last_mean("zeros")),
        "take-off": Measure("generation in which half of the agents succeed", _take_off),
        "unset-at-take-off": Measure(
            "share of ? when half of the agents succeed", _unset_at_take_off
        ),
        "fall": Measure(
            "share of ? at that time minus that in the last generation",
            lambda runs: _unset_at_take_off(runs) - _last_mean("unset")(runs),
        ),
        "taken-off": Measure(
            "1 if half of the agents ever succeed, else 0",
            lambda runs: _take_off(runs).notnull() * 1.0,
        ),
        "hit": Measure(
            "1 if any agent ever succeeds, else 0",
            lambda runs: runs["succeeded"].max(("generation", "agent")).astype(float),
        ),
    }

    @property
    def learns(self) -> bool:
        return self.guessing

    @property
    def steps(self) -> int:
        return self.trials

    def without_learning(self) -> HintonNowlan:
        return self.model_copy(update={"guessing": False})

    def weights(self) -> int:
        return self.loci

    def founders(self, agents: int, key: Any) -> npt.NDArray[np.float32]:
        draws = key.uniforms(FOUNDER, (agents, self.loci))[:, :, 0]
        half = (1 - self.initial_unset_share) / 2
        return np.select([draws < half, draws < 2 * half], [0.0, 1.0], UNSET_ALLELE)[
            :, None
        ].astype(np.float32)

    def simulate(
        self, seed: int, runs: Sequence[int], generation: int, genomes: npt.NDArray[np.float32]
    ) -> LifeResults:
        genomes = genomes[:, :, 0]
        luck = np.stack(
            [uniforms(seed, run, generation, LIFE, (genomes.shape[1], 1))[:, 0, 0] for run in runs]
        )
        unset = (genomes == UNSET_ALLELE).sum(axis=-1)
        able = (genomes != 0).all(axis=-1) & (self.guessing | (unset == 0))
        first = self._first_success(unset, luck)
        succeeded = able & (first <= self.trials)
        remaining = np.clip(self.trials - first + (0 if self.counts_success else 1), 0, None)
        energy = np.where(succeeded, 1 + MAX_GAIN * remaining / self.trials, 1.0)
        records = {
            "ones": (genomes == 1).mean(axis=-1, dtype=np.float32),
            "unset": (unset / self.loci).astype(np.float32),
            "zeros": (genomes == 0).mean(axis=-1, dtype=np.float32),
            "succeeded": succeeded.astype(np.int32),
            "used": np.where(succeeded, first, self.trials if self.guessing else 1).astype(
                np.int32
            ),
        }
        learned = np.where(succeeded[:, :, None], np.float32(1), genomes)
        return LifeResults(energy, np.zeros_like(energy), learned, records)

    def _first_success(
        self, unset: npt.NDArray[np.int64], luck: npt.NDArray[np.float64]
    ) -> npt.NDArray[np.int64]:
        """Return the number of the first successful trial [run, agent].

        A trial fails with probability 1 - 2^-unset, so the first t trials all fail with the t-th
        power of this probability. The first success is the first trial at which that power is not
        above `luck`. The result is trials + 1 if no trial of the lifetime succeeds.
        """
        # Products instead of logarithms give the same bits on all machines.
        first = poison.empty(unset.shape, np.int64)
        for count in np.unique(unset):
            fail = np.cumprod(np.full(self.trials, 1 - 0.5 ** int(count)))
            first[unset == count] = 1 + np.searchsorted(-fail, -luck[unset == count])
        return first

    def oracle(self, genome: Sequence[float], luck: float) -> float:
        """Return the fitness of one string, trial by trial; `luck` is uniform in (0, 1)."""
        unset = sum(allele == UNSET_ALLELE for allele in genome)
        fail = 1.0
        for trial in range(1, self.trials + 1):
            fail *= 1 - 1 / 2**unset
            if 0 not in genome and fail <= luck and (self.guessing or not unset):
                return (
                    1 + MAX_GAIN * (self.trials - trial + (not self.counts_success)) / self.trials
                )
        return 1.0


class OnePointOfAlleles(Variation, name="one-point-alleles"):
    """One-point crossover of the alleles 0, 1 and ?; then mutation to one of these.

    References
    ----------
    Hinton and Nowlan 1987.
    """

    mutation_law: Literal["uniform", "founders"] = Field(
        "uniform",
        description=(
            "Distribution of mutated alleles. uniform: 0, 1 and ? alike; founders: as"
            " among the founders."
        ),
    )
    settings: ClassVar[tuple[str, ...]] = ("mutation_rate",)
    derived: ClassVar[Mapping[str, Any]] = {
        "rate": lambda part, experiment: float(experiment.evolution.mutation_rate),
        "zero": lambda part, experiment: 3 * part.share_of_zero(experiment),
    }

    def share_of_zero(self, experiment: Any) -> float:
        """Return the share of 0 among mutated alleles, which is also the share of 1."""
        return (
            (1 - experiment.of_model.initial_unset_share) / 2
            if self.mutation_law == "founders"
            else 1 / 3
        )

    def check(self, experiment: Any) -> None:
        has_shares = experiment.model != "miniworld" and hasattr(
            experiment.of_model, "initial_unset_share"
        )
        if self.mutation_law == "founders" and not has_shares:
            raise ValueError(
                "evolution.one_point_alleles.mutation_law = 'founders' needs a model with a share "
                "of ? among the founders: "
                f"hinton-nowlan or moving-needle, and not {experiment.model!r}"
            )

    @staticmethod
    def vary(
        part: Any, fitter: OneGenome, second: OneGenome, draws: Draws, gate: float, child: OneGenome
    ) -> None:
        # The cut is in the row of the genes of all modules.
        cut = draw_cut(gate, child.size)
        for module in range(child.shape[0]):
            for locus in range(child.shape[1]):
                gene = module * child.shape[1] + locus
                of_fitter = is_from_fitter(gene, cut, draws[0, 0])
                child[module, locus] = fitter[module, locus] if of_fitter else second[module, locus]
                if draws[gene, 1] < part.rate:
                    draw = 3.0 * draws[gene, 2]
                    steps = int(draw >= part.zero) + int(draw >= 3.0 - part.zero)
                    child[module, locus] = np.float32(steps) * np.float32(0.5)

    @staticmethod
    def oracle(part: Any, fitter: Any, second: Any, draws: Any, gate: float) -> Any:
        def mutant(draw: float) -> float:
            zero = part.zero / 3
            if draw < zero:
                return 0.0
            return 1.0 if draw >= 1 - zero else 0.5

        inherited = cross_at_point(flatten(fitter), flatten(second), gate, draws[0][0])
        child = [
            mutant(draw[2]) if draw[1] < part.rate else old
            for old, draw in zip(inherited, draws, strict=True)
        ]
        return split_modules(child, len(fitter[0]))
