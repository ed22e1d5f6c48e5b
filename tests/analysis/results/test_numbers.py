"""Numbers that are read together stay distinct, and a number that is not 0 is never shown as 0."""

from __future__ import annotations

import math

import numpy as np
import pytest

from baldwinlab.analysis.atlas.tables import MeanInterval
from baldwinlab.analysis.results.numbers import (
    format_estimate,
    format_levels,
    format_number,
    format_numbers,
    format_percentage,
)


@pytest.mark.parametrize(
    ("estimate", "text"),
    [
        # Ordinary numbers have about three digits, each its own number of decimals.
        ((198, 171, 224), "198 [171, 224]"),
        ((15.75, 2.88, 44.6), "15.8 [2.88, 44.6]"),
        ((-0.5, -1.25, 0), "−0.50 [−1.25, 0]"),
        # A small scale, for example a food energy of 1e-5.
        ((0.000647, 0.000228, 0.000779), "0.000647 [0.000228, 0.000779]"),
        ((6.47e-7, -2.28e-9, 1), "6.47e-07 [−2.28e-09, 1.00]"),
        # A small interval.
        ((12.34, 12.31, 12.38), "12.34 [12.31, 12.38]"),
        ((1234.56, 1234.51, 1235.2), "1,234.6 [1,234.5, 1,235.2]"),
        # Equal numbers, and numbers that differ by rounding, have equal texts.
        ((5.0, 5.0, 5.0), "5.00 [5.00, 5.00]"),
        ((0.1 + 0.2, 0.3, 0.4), "0.30 [0.30, 0.40]"),
        ((0.25, math.nan, math.nan), "0.25"),
        ((math.nan, 1.0, 2.0), "– [1.00, 2.00]"),
    ],
)
def test_an_estimate_has_as_many_digits_as_its_interval_needs(
    estimate: tuple[float, float, float], text: str
) -> None:
    assert format_estimate(*estimate) == text


def test_no_number_but_0_is_shown_as_0() -> None:
    for exponent in range(-300, 10):
        for value in (10.0**exponent, -4.9 * 10.0**exponent):
            assert any(digit in "123456789" for digit in format_number(value).split("e")[0])
    assert format_number(0) == format_number(-0.0) == "0"


def test_different_numbers_have_different_texts() -> None:
    numbers = [0, 1e-7, 1e-5, 0.004, 0.0041, 1.00001, 1.00002, 99.96, 100, 1e9, 1e9 + 1]
    assert len(set(format_numbers(numbers))) == len(numbers)
    assert len(set(format_numbers([*np.array(numbers, np.float64)]))) == len(numbers)


def test_the_levels_of_a_setting_are_distinct_and_without_zeros() -> None:
    assert format_levels([0.01, 0.1, 1.0]) == ["0.01", "0.1", "1"]
    assert format_levels([0.012341, 0.012342, 0.012343]) == ["0.012341", "0.012342", "0.012343"]
    assert format_levels([1.0, 1.00001, 1.00002]) == ["1", "1.00001", "1.00002"]
    assert format_levels([3, 20000, True, "rank"]) == ["3", "20000", "True", "rank"]


def test_an_estimate_of_the_atlas_has_distinct_digits_too() -> None:
    assert str(MeanInterval(0.5, 0.25, 0.75, 3)) == "0.5 [0.25, 0.75]"
    assert str(MeanInterval(0.12344, 0.12341, 0.12348, 3)) == "0.12344 [0.12341, 0.12348]"
    assert str(MeanInterval(0.5, math.nan, math.nan, 1)) == "0.5"


def test_a_small_percentage_is_not_0() -> None:
    shares = {0: "0 %", 0.34: "34 %", 0.0034: "0.3 %", -1e-5: "-0.001 %", 1: "100 %"}
    shares |= {0.9996: "99.96 %", -0.9999: "-99.99 %", 1.2: "120 %", 0.995: "99.5 %"}
    assert [format_percentage(share) for share in shares] == [*shares.values()]
    assert format_percentage(0.5, "+") == "+50 %"
