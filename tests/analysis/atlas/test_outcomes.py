"""Outcomes of a cell, on cells whose values are known."""

from typing import Any

import numpy as np
import pytest
import xarray as xr

from baldwinlab.analysis.atlas.outcomes import compute_outcomes

GENERATIONS = np.arange(0, 101, 10)


def make_cell(**changes: Any) -> xr.Dataset:
    """Return a cell of two runs: the distance falls from 8 to 2, and selection is halved."""
    n_runs, n_generations = 2, GENERATIONS.size
    full = np.ones((n_runs, n_generations))
    distance = np.where(GENERATIONS < 40, 8.0, 2.0) * full
    branches = np.array([[5.0, 7.0], [4.0, 3.0]])
    arrays = {
        "distance": (("run", "generation"), distance),
        "innate_trait": (("run", "generation"), 6 * full),
        "control_innate_trait": (("run", "generation"), 5 * full),
        "selection_on": (("run", "generation"), 0.2 * full),
        "selection_off": (("run", "generation"), 0.4 * full),
        "founder_mean": (("run",), np.array([1.0, 3.0])),
        "founder_square": (("run",), np.array([1.0, 9.0])),
        "branch_innate_fitness": (
            ("run", "history", "regime"),
            np.broadcast_to(branches, (n_runs, 2, 2)).copy(),
        ),
    } | changes
    coordinates = {
        "run": [5, 6],
        "generation": GENERATIONS,
        "history": ["learner", "control"],
        "regime": ["on", "off"],
    }
    return xr.Dataset(arrays, coordinates)


def test_assimilation_is_the_share_of_the_distance_that_is_gone() -> None:
    assert compute_outcomes(make_cell())["assimilation"].values == pytest.approx([0.75, 0.75])


def test_the_response_is_in_standard_deviations_of_all_founders() -> None:
    # Clonal founders of the runs have the traits 1 and 3, so their standard deviation is 1.
    assert compute_outcomes(make_cell())["innate_response"].values == pytest.approx([1.0, 1.0])


def test_the_response_is_undefined_if_all_founders_are_equal() -> None:
    equal = {"founder_mean": ("run", [2.0, 2.0]), "founder_square": ("run", [4.0, 4.0])}
    assert compute_outcomes(make_cell(**equal))["innate_response"].isnull().all()


def test_the_selection_ratio_is_on_divided_by_off() -> None:
    assert compute_outcomes(make_cell())["selection_ratio"].values == pytest.approx([0.5, 0.5])


def test_the_selection_ratio_is_undefined_without_selection() -> None:
    off = {"selection_off": (("run", "generation"), np.full((2, GENERATIONS.size), 1e-12))}
    assert compute_outcomes(make_cell(**off))["selection_ratio"].isnull().all()


def test_t90_is_the_first_measured_generation_with_most_of_the_fall() -> None:
    assert compute_outcomes(make_cell())["t90"].values.tolist() == [40, 40]


def test_a_growing_distance_has_no_t90_and_a_negative_assimilation() -> None:
    growing = {"distance": (("run", "generation"), np.tile(GENERATIONS + 1.0, (2, 1)))}
    outcomes = compute_outcomes(make_cell(**growing))
    assert outcomes["t90"].isnull().all()
    assert (outcomes["assimilation"] < 0).all()


def test_the_fork_compares_histories_without_learning_and_regimes_over_histories() -> None:
    outcomes = compute_outcomes(make_cell())
    assert outcomes["fork_history"].values == pytest.approx([4.0, 4.0])
    assert outcomes["fork_regime"].values == pytest.approx([-0.5, -0.5])


def test_a_model_without_a_distance_has_no_assimilation() -> None:
    outcomes = compute_outcomes(make_cell().drop_vars("distance"))
    assert outcomes["assimilation"].isnull().all()
    assert outcomes["innate_response"].notnull().all()
