"""Model of strings that guess during life, with a target that changes over the generations.

    baldwinlab reproduce le-2018

The target is the correct allele of each locus. In generation 0, it is 1 at every locus, as in
`hinton_nowlan.py`. Every `period` generations, `redrawn_loci` random loci get a new random target.
If the target never changes, a run is bit-identical to a run of `hinton_nowlan.py`.

The idea follows Le et al. 2018, and the strings follow Hinton and Nowlan 1987. The parameters of Le
et al. are not known, so the parameters here are our choice.

References
----------
N. Le, A. Brabazon and M. O'Neill, "How the Baldwin effect can guide evolution in dynamic
environments", TPNC 2018.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from baldwinlab.models import kit
from baldwinlab.models.hinton_nowlan import HintonNowlan
from baldwinlab.parts import LIFE, Field, LifeResults, Measure, Variable, uniforms

# Number of successive changes of the target in a block. One cache entry has the targets of a block.
CHANGES_PER_BLOCK: Final = 100
# Maximum depth of the recursion over blocks.
MAX_DEPTH: Final = 200
# New names of two records of `hinton_nowlan.py`: the correct allele is not always 1 here.
RECORD_NAMES: Final = {"ones": "right", "zeros": "wrong"}


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
        """Simulate lifetimes of `hinton_nowlan.py`, with 0 and 1 swapped where the target is 0.

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
        # [redrawn locus, 4]. Draw 0 is left out, because `hinton_nowlan.py` uses it for agent 0.
        draws = uniforms(seed, run, generation, LIFE, (1, 1 + redrawn_loci))[0, 1:]
        # Only two of the four random numbers of a draw are needed.
        for locus_draw, allele_draw in draws[:, :2]:
            targets[change:, int(locus_draw * loci)] = allele_draw < 0.5
    return targets
