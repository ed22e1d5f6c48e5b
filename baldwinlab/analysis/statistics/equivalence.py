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


def equivalence_p(samples: Sample, bound: float) -> Sample:
    """Compute the p-value of the two one-sided signed-rank tests for samples [sample, pair].

    One test shows that the differences are below `bound`, the other that they are above `-bound`.
    The p-value is the larger of the two, and 0 if all differences of a sample of two or more are 0.
    The bound is fixed before the data are seen. With 0, no sample is equivalent, except for exact
    ties.
    """
    below, _ = signed_rank_tails(samples - bound)
    _, above = signed_rank_tails(samples + bound)
    has_only_ties = (samples.shape[1] > 1) & ~samples.any(axis=1)
    return np.where(has_only_ties, 0.0, np.maximum(below, above))
