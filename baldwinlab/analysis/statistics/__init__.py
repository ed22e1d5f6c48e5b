"""Compare two samples, unpaired or in pairs, and correct p-values for several tests.

The functions need only NumPy and SciPy: samples are sequences of numbers without labels.

References
----------
- Mann-Whitney test: H. B. Mann and D. R. Whitney, Annals of Mathematical Statistics 18 (1947).
- Sign test: W. J. Dixon and A. M. Mood, Journal of the American Statistical Association 41 (1946).
- A12: A. Vargha and H. D. Delaney, Journal of Educational and Behavioral Statistics 25 (2000).
- Percentile interval: B. Efron and R. Tibshirani, Introduction to the Bootstrap (1993), chapter 13.
- Holm's correction: S. Holm, Scandinavian Journal of Statistics 6 (1979).
"""

from baldwinlab.analysis.statistics.bootstrap import (
    Sample,
    Summary,
    check_sample,
    median_interval,
    percentile_interval,
    summarize,
)
from baldwinlab.analysis.statistics.comparisons import (
    Comparison,
    Pairs,
    compare,
    compare_paired,
    compare_pairs,
    log_ratio,
)
from baldwinlab.analysis.statistics.hypothesis_tests import holm, mann_whitney, sign_test

__all__ = [
    "Comparison",
    "Pairs",
    "Sample",
    "Summary",
    "check_sample",
    "compare",
    "compare_paired",
    "compare_pairs",
    "holm",
    "log_ratio",
    "mann_whitney",
    "median_interval",
    "percentile_interval",
    "sign_test",
    "summarize",
]
