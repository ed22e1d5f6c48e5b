"""Conditions compared with the first on their map, on studies made by hand."""

from __future__ import annotations

import pytest

from baldwinlab.report.words import higher
from baldwinlab.statistics.contrasts import contrasts
from tests.statistics.studies import study

HIGH, LOW, MIXED = range(100, 108), range(10, 18), [5, 6, 7, 8, 104, 105, 106, 107]


def test_each_condition_is_compared_with_the_first_on_its_map() -> None:
    found = contrasts(study({"evo/A": LOW, "evo/B": LOW, "evo+drift/A": HIGH, "evo+lamarckian/B": LOW}))
    pairs = {(contrast.condition, contrast.reference) for contrast in found}
    assert pairs == {("evo+drift/A", "evo/A"), ("evo+lamarckian/B", "evo/B")}
    assert len(found) == 4  # best and mean


def test_the_higher_one_is_named_only_where_it_is_significant() -> None:
    found = contrasts(study({"a/A": LOW, "b/A": HIGH, "c/A": LOW, "d/A": MIXED}))
    assert [higher(contrast) for contrast in found if contrast.measure == "mean"] == ["b/A", "undecided", "undecided"]
    (turned,) = (contrast for contrast in contrasts(study({"b/A": HIGH, "a/A": LOW})) if contrast.measure == "best")
    assert higher(turned) == "b/A"
    assert turned.numbers.effect == -90
    assert turned.p_holm == pytest.approx(2 * 2 / 12870)  # exact, and one of two tests


def test_conditions_without_runs_and_single_ones_have_nothing_to_be_compared_with() -> None:
    assert contrasts(study({"evo/A": LOW, "evo/B": LOW})) == []
    nothing = float("nan")
    assert contrasts(study({"evo/A": [nothing] * 8, "evo+drift/A": LOW, "alone": LOW})) == []
