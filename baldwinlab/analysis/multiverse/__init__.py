"""Analysis of a multiverse: the same comparisons under every interpretation of the paper."""
