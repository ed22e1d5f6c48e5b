"""The contenders: each offers what `benchmarks.setting.Contender` says; those on our model also `trace`, for the tests."""
