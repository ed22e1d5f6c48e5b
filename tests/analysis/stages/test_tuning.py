"""The chosen value of a setting has the largest median over runs."""

from __future__ import annotations

from baldwinlab.api.stages import choose_values, measure_medians
from tests.analysis.results.studies import study


def test_each_condition_has_the_value_with_its_largest_median() -> None:
    medians = {
        0.1: measure_medians(study({"evo/A": [1, 9, 2], "evo/B": [5, 5, 5]})),
        0.01: measure_medians(study({"evo/A": [3, 3, 3], "evo/B": [4, 4, 99]})),
    }
    assert choose_values(medians) == {"evo/A": 0.01, "evo/B": 0.1}
    # The smallest of equally good values is chosen.
    assert choose_values({0.3: {"a": 2.0}, 0.03: {"a": 2.0}, 0.1: {"a": 1.0}}) == {"a": 0.03}
