"""Outcomes of a cell, on cells whose values are known."""

from typing import Any

import numpy as np
import pytest
import xarray as xr

from baldwinlab.analysis.atlas.outcomes import compute_outcomes
from baldwinlab.analysis.atlas.tables import estimate_mean

GENERATIONS = np.arange(0, 101, 10)


def make_cell(**changes: Any) -> xr.Dataset:
    """Return a cell of two runs: the distance falls from 8 to 2, and selection is halved."""
    n_runs, n_generations = 2, GENERATIONS.size
    full = np.ones((n_runs, n_generations))
    distance = np.where(GENERATIONS < 40, 8.0, 2.0) * full
    branches = np.array([[5.0, 7.0], [4.0, 3.0]])
    arrays = {
        "distance": (("run", "generation"), distance),
        "control_distance": (("run", "generation"), np.where(GENERATIONS < 40, 8.0, 4.0) * full),
        "neutral_distance": (("run", "generation"), 8 * full),
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


def test_outcomes_of_a_cell_have_known_values() -> None:
    outcomes = compute_outcomes(make_cell())
    # The distance of learners falls to a quarter, that of the control to a half.
    assert outcomes["learner_fall"].values == pytest.approx(np.log([4, 4]))
    assert outcomes["control_fall"].values == pytest.approx(np.log([2, 2]))
    assert outcomes["neutral_fall"].values == pytest.approx([0, 0])
    assert outcomes["assimilation"].values == pytest.approx(np.log([2, 2]))
    # The response is in standard deviations of all founders.
    # Clonal founders of the runs have the traits 1 and 3, so their standard deviation is 1.
    assert outcomes["innate_response"].values == pytest.approx([1.0, 1.0])
    # The selection ratio is on divided by off.
    assert outcomes["selection_ratio"].values == pytest.approx([0.5, 0.5])
    # T90 is the first measured generation with most of the fall.
    assert outcomes["t90"].values.tolist() == [40, 40]
    # The fork compares histories without learning and regimes over histories.
    assert outcomes["fork_history"].values == pytest.approx([4.0, 4.0])
    assert outcomes["fork_regime"].values == pytest.approx([-0.5, -0.5])


def test_undefined_outcomes_are_null() -> None:
    equal = {"founder_mean": ("run", [2.0, 2.0]), "founder_square": ("run", [4.0, 4.0])}
    assert compute_outcomes(make_cell(**equal))["innate_response"].isnull().all()
    # The selection ratio is undefined without selection.
    off = {"selection_off": (("run", "generation"), np.full((2, GENERATIONS.size), 1e-12))}
    assert compute_outcomes(make_cell(**off))["selection_ratio"].isnull().all()
    # A growing distance has no t90 and a negative assimilation.
    growing = {"distance": (("run", "generation"), np.tile(GENERATIONS + 1.0, (2, 1)))}
    outcomes = compute_outcomes(make_cell(**growing))
    assert outcomes["t90"].isnull().all()
    assert (outcomes["learner_fall"] < 0).all()
    # A model without a distance has no assimilation.
    outcomes = compute_outcomes(make_cell().drop_vars("distance"))
    assert outcomes["assimilation"].isnull().all()
    assert outcomes["innate_response"].notnull().all()


def test_one_generation_has_no_fall() -> None:
    outcomes = compute_outcomes(make_cell().isel(generation=[0]))
    for name in ("assimilation", "learner_fall", "t90"):
        assert outcomes[name].isnull().all() and outcomes[name].sizes == {"run": 2}
    assert str(estimate_mean(outcomes["assimilation"])) == "not defined"
    assert outcomes["innate_response"].values == pytest.approx([1.0, 1.0])
