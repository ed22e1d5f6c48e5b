"""The contenders, with the functions of `benchmarks.setting.Contender`.

Those with the same model also have a function `trace`, for the tests.
"""
