"""Results: comparisons of quantities, the correction of a family of tests, verdicts and tables."""
