"""Models of strings of 0, 1 and ?, in which agents guess each ? during life.

    baldwinlab reproduce hinton-nowlan-1987
    baldwinlab reproduce le-2018

The correct allele is 1 at every locus. Another target would give equivalent results. In each trial
of its life, an agent sets each ? to 0 or 1 at random. A failed trial has no effect on later trials.
The agent stops at the first trial in which all loci are correct. If n of its N trials remain then,
the fitness is 1 + 19 n / N. If no trial succeeds, the fitness is 1. In a genome, 0.5 is the allele
?. In the paper, each used trial costs a fitness of 19 / N. `cost_of_trials` is a factor of this
cost.

The model `moving-needle` has a target that changes over the generations. The target is the correct
allele of each locus. In generation 0, it is 1 at every locus. Every `period` generations,
`redrawn_loci` random loci get a new random target. If the target never changes, a run is
bit-identical to a run of `hinton-nowlan`. The idea follows Le et al. 2018. Their parameters are not
known, so the parameters here are our choice.

References
----------
G. E. Hinton and S. J. Nowlan, "How learning can guide evolution", Complex Systems 1 (1987).
N. Le, A. Brabazon and M. O'Neill, "How the Baldwin effect can guide evolution in dynamic
environments", TPNC 2018.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from baldwinlab.core.deferred import xr
from baldwinlab.engine import poison
from baldwinlab.experiment.measures import first_generation
from baldwinlab.models import kit
from baldwinlab.parts import LIFE, Field, LifeResults, Measure, Model, Variable, uniforms

# Upper limit of the gain in fitness above the baseline of 1.
MAX_GAIN: Final = 19.0
# Number of successive changes of the target in a block. One cache entry has the targets of a block.
CHANGES_PER_BLOCK: Final = 100
# Maximum depth of the recursion over blocks.
MAX_DEPTH: Final = 200
# New names of two records of `HintonNowlan`: the correct allele is not always 1 here.
RECORD_NAMES: Final = {"ones": "right", "zeros": "wrong"}


def _take_off(runs: xr.Dataset) -> xr.DataArray:
    """Return the first generation in which half of the agents succeed, or NaN."""
    return first_generation(runs["succeeded"].mean("agent") >= 0.5)


def _unset_at_take_off(runs: xr.Dataset) -> xr.DataArray:
    """Return the fraction of ? in the generation of `_take_off`, or NaN."""
    take_off = _take_off(runs)
    # An index must be an integer, so runs without a take-off read generation 0 before `where`.
    generation = take_off.fillna(0).astype(int)
    shares = runs["unset"].mean("agent").isel(generation=generation)
    return shares.where(take_off.notnull())


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
    initial_unset_share: kit.Share = Field(
        0.5,
        description=(
            "Share of ? among the alleles of the founders. The others are 0 and 1 in equal shares."
        ),
    )
    counts_success: bool = Field(True, description="Whether the successful trial counts as used.")
    cost_of_trials: float = Field(
        1.0,
        ge=0,
        le=1000,
        description="Factor of the fitness that each used trial costs. 1: the paper; 0: no cost.",
    )

    defaults = {
        "population": {"size": 1000},
        "evolution": {"generations": 51, "variation": "one-point-alleles", "mutation_rate": 0.0},
    }
    records = {
        "ones": Variable.share("share of alleles that are 1, the correct allele"),
        "unset": Variable.share("share of alleles that are ?"),
        "zeros": Variable.share("share of alleles that are 0"),
        "succeeded": Variable.flag("1 if all alleles were correct in a trial, else 0"),
        "used": Variable.integer("trials", "number of trials in the lifetime"),
    }
    alleles = kit.BITS_AND_UNSET
    clock = "used"
    innate_trait = "ones"
    learned_distance = "unset"
    learning_time = "used"
    learning_amount = "trials"
    lifetime_steps = "trials"
    settings_without_learning = {"guessing": False}
    measures = {
        **kit.measure_last_means(
            {"ones": "share of 1", "unset": "share of ?", "zeros": "share of 0"}
        ),
        "take-off": Measure("generation in which half of the agents succeed", _take_off),
        "unset-at-take-off": Measure(
            "share of ? when half of the agents succeed", _unset_at_take_off
        ),
        "fall": Measure(
            "share of ? when half of the agents succeed, minus share of ? in the last generation",
            lambda runs: _unset_at_take_off(runs) - kit.mean_of_last_generation("unset")(runs),
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

    def n_weights(self) -> int:
        return self.loci

    def founders(self, agents: int, key: Any) -> kit.Genomes:
        return kit.draw_alleles(key, agents, self.loci, self.initial_unset_share)

    def simulate(
        self, seed: int, runs: Sequence[int], generation: int, genomes: kit.Genomes
    ) -> LifeResults:
        genomes = genomes[:, :, 0]
        luck = kit.draw_lifetimes(seed, runs, generation, (genomes.shape[1], 1))[:, :, 0]
        n_unset = (genomes == kit.UNSET_ALLELE).sum(axis=-1)
        can_succeed = (genomes != 0).all(axis=-1) & (self.guessing | (n_unset == 0))
        first_success = self._find_first_success(n_unset, luck)
        succeeded = can_succeed & (first_success <= self.trials)
        # 1 if the successful trial does not count as used, so that one more trial remains.
        n_uncounted = 0 if self.counts_success else 1
        cost_in_trials = self.cost_of_trials * (first_success - n_uncounted)
        n_remaining = np.clip(self.trials - cost_in_trials, 0, None)
        fitness = np.where(succeeded, 1 + MAX_GAIN * n_remaining / self.trials, 1.0)
        # Without guesses, all trials are equal, so an agent uses a single trial.
        n_used_by_failures = self.trials if self.guessing else 1
        n_used = np.where(succeeded, first_success, n_used_by_failures)
        records = {
            "ones": (genomes == 1).mean(axis=-1, dtype=np.float32),
            "unset": n_unset / self.loci,
            "zeros": (genomes == 0).mean(axis=-1, dtype=np.float32),
            "succeeded": succeeded,
            "used": n_used,
        }
        # A success sets all loci of the agent to the correct allele, 1.
        learned = np.where(succeeded[:, :, None], np.float32(1), genomes)
        return self.make_results(fitness, records, learned=learned)

    def _find_first_success(self, n_unset: kit.Integers, luck: kit.Numbers) -> kit.Integers:
        """Return the first successful trial [run, agent], from 1, or trials + 1 if all trials fail.

        A trial fails with the probability q = 1 - 2^-n_unset, so the trials 1 to t all fail with
        the probability q^t. The first success is the first trial t with q^t <= `luck`, a uniform
        random number [run, agent].
        """
        first_success = poison.empty(n_unset.shape, np.int64)
        for count in np.unique(n_unset):
            has_count = n_unset == count
            # Powers are computed as products, because logarithms differ between machines.
            failure_probabilities = np.cumprod(np.full(self.trials, 1 - 0.5 ** int(count)))
            # `searchsorted` needs ascending numbers, so both arguments are negated.
            n_failures = np.searchsorted(-failure_probabilities, -luck[has_count])
            first_success[has_count] = 1 + n_failures
        return first_success


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

    defaults = {
        "population": {"size": 1000},
        "evolution": {"generations": 201, "variation": "one-point-alleles", "mutation_rate": 0.01},
        "record": {"genome_every": 10},
    }
    records = {
        **{name: HintonNowlan.records[name] for name in ("unset", "succeeded", "used")},
        "right": Variable.share("share of correct alleles in this generation"),
        "wrong": Variable.share("share of wrong alleles in this generation"),
    }
    innate_trait = "right"
    measures = {
        "fitness": Measure(
            "fitness in the second half of the run", kit.mean_of_second_half("energy")
        ),
        **kit.measure_second_halves(
            {
                "right": "share of correct alleles",
                "unset": "share of ?",
                "succeeded": "share of agents that succeed",
            }
        ),
    }

    def simulate(
        self, seed: int, runs: Sequence[int], generation: int, genomes: kit.Genomes
    ) -> LifeResults:
        """Simulate lifetimes of `HintonNowlan`, with 0 and 1 swapped where the target is 0.

        The swap x -> 1 - x does not change the allele ?, which is 0.5.
        """
        # [run, locus].
        targets = np.stack([self.target(seed, run, generation) for run in runs])
        # [run, 1, 1, locus], because all agents and modules of a run have the same target.
        is_swapped = (targets == 0)[:, None, None]
        swapped_genomes = np.where(is_swapped, 1 - genomes, genomes)
        results = super().simulate(seed, runs, generation, swapped_genomes)
        learned: Any = results.learned
        return results._replace(learned=np.where(is_swapped[:, :, 0], 1 - learned, learned))

    def make_results(
        self, energy: kit.Numbers, records: Mapping[str, Any], **arrays: Any
    ) -> LifeResults:
        named = {RECORD_NAMES.get(name, name): values for name, values in records.items()}
        return super().make_results(energy, named, **arrays)

    def target(self, seed: int, run: int, generation: int) -> kit.Integers:
        """Return the target of a generation: the correct allele [locus], 0 or 1."""
        n_changes = generation // self.period if self.period else 0
        if n_changes == 0:
            return np.ones(self.loci, np.int64)
        block, change = divmod(n_changes - 1, CHANGES_PER_BLOCK)
        law = (self.loci, self.redrawn_loci, self.period)
        # A block needs the previous block, which the cached function computes by recursion. These
        # calls fill the cache at intervals, so that no recursion is deeper than `MAX_DEPTH`.
        for stored_block in range(0, block, MAX_DEPTH):
            _draw_targets(law, seed, run, stored_block)
        return np.asarray(_draw_targets(law, seed, run, block)[change], np.int64)


@lru_cache(maxsize=1024)
def _draw_targets(
    law: tuple[int, int, int], seed: int, run: int, block: int
) -> npt.NDArray[np.int8]:
    """Return the target [change, locus] after each change of a block.

    `law`: number of loci, `redrawn_loci`, and `period`. The changes begin with the last target of
    the previous block, or with 1 at every locus for block 0.
    """
    loci, redrawn_loci, period = law
    target = _draw_targets(law, seed, run, block - 1)[-1] if block else np.ones(loci, np.int8)
    targets = np.tile(target, (CHANGES_PER_BLOCK, 1))
    for change in range(CHANGES_PER_BLOCK):
        generation = (block * CHANGES_PER_BLOCK + change + 1) * period
        # [redrawn locus, 4]. Draw 0 is left out, because `HintonNowlan` uses it for agent 0.
        draws = uniforms(seed, run, generation, LIFE, (1, 1 + redrawn_loci))[0, 1:]
        # Only two of the four random numbers of a draw are needed.
        for locus_draw, allele_draw in draws[:, :2]:
            targets[change:, int(locus_draw * loci)] = allele_draw < 0.5
    return targets
