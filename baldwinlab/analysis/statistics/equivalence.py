"""Equivalence test: show that an effect is smaller than the smallest effect of interest.

References
----------
Two one-sided tests: D. J. Schuirmann, Journal of Pharmacokinetics and Biopharmaceutics 15 (1987).
Rank-based version: S. Wellek, Testing Statistical Hypotheses of Equivalence (2010), chapter 5.
"""

from __future__ import annotations

import numpy as np

from baldwinlab.analysis.statistics.rank_tests import signed_rank_tails
from baldwinlab.analysis.statistics.samples import Sample


def equivalence_p(samples: Sample, bound: float, *, ignores_ties: bool = False) -> Sample:
    """Compute the p-value of the two one-sided signed-rank tests for samples [sample, pair].

    One test shows that the differences are below `bound`, the other that they are above `-bound`.
    The p-value is the larger of the two. If all differences are 0, both one-sided tests have their
    smallest p-value, `0.5 ** n`, also with a bound of 0. The bound is fixed before the data are
    seen. With 0, no other sample is equivalent. `ignores_ties`: see `signed_rank_tails`.
    """
    below, _ = signed_rank_tails(samples - bound, ignores_ties=ignores_ties)
    _, above = signed_rank_tails(samples + bound, ignores_ties=ignores_ties)
    has_only_zeros = ~samples.any(axis=1)
    return np.where(has_only_zeros, 0.5 ** samples.shape[1], np.maximum(below, above))
