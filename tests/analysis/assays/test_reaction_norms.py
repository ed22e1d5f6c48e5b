"""Intercepts and slopes of reaction norms have known values for artificial norms."""

from __future__ import annotations

import numpy as np
import pytest

from baldwinlab.analysis.assays.analysis import evaluate_assays
from baldwinlab.analysis.assays.reaction_norms import LAST_MINUS_FIRST, TABLE, compute_parameters
from baldwinlab.analysis.assays.section import tabulate_effects
from tests.analysis.assays.artificial_assays import RUNS, reaction_norms

A = "evo+self-taught/A"
INTERCEPTS = (1.0, 4.0, 7.0, 10.0)
SLOPES = (8.0, 6.0, 4.0, 2.0)


def test_the_slope_is_from_0_to_1_and_does_not_assume_a_linear_norm() -> None:
    parameters = compute_parameters(reaction_norms(A, INTERCEPTS, SLOPES))
    run_factors = 1 + 0.01 * np.arange(RUNS)
    for name, expected in (("intercept", INTERCEPTS), ("slope", SLOPES)):
        assert parameters[name].dims == ("run", "generation")
        np.testing.assert_allclose(parameters[name], np.outer(run_factors, expected))
    # The slope does not assume that the norm is linear.
    data = reaction_norms(A, INTERCEPTS, SLOPES)
    changed = data.copy(deep=True)
    changed["energy"].loc[{"factor": [0.25, 0.5, 2, 4]}] = 99.0
    for name, values in compute_parameters(data).items():
        assert values.equals(compute_parameters(changed)[name])


def test_changes_of_both_parameters_are_invariant_to_a_constant() -> None:
    data = reaction_norms(A, INTERCEPTS, SLOPES)
    for shifted in (data, data.assign(energy=data["energy"] + 100)):
        analysis = evaluate_assays({"reaction-norms": {A: shifted}})
        for name, change in (("intercept", 9), ("slope", -6)):
            number = analysis.find_number(A, f"reaction norm: {name}", LAST_MINUS_FIRST)
            # The median of 12 runs is 1.055 times the value of the first.
            assert number is not None and number.median == pytest.approx(1.055 * change)
            assert number.low < number.median < number.high


def test_the_table_has_a_row_per_generation_and_one_of_changes() -> None:
    data = reaction_norms(A, INTERCEPTS, SLOPES)
    rows = tabulate_effects(evaluate_assays({"reaction-norms": {A: data}}), TABLE)
    assert [row["start"] for row in rows] == [
        *(f"generation {generation}" for generation in (0, 13, 26, 39)),
        LAST_MINUS_FIRST,
    ]
    assert [number.median for number in rows[0]["numbers"]] == pytest.approx([1.055, 8 * 1.055])
    # Every point of the norm is a number.
    analysis = evaluate_assays({"reaction-norms": {A: reaction_norms(A, INTERCEPTS, SLOPES)}})
    name = "reaction norm: fitness with 0.25 times the learning"
    number = analysis.find_number(A, name, "generation 13")
    assert number is not None and number.median == pytest.approx(1.055 * (4 + 0.25 * 6))
