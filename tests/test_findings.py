"""Percentages of the fork, and the formats of the tables of `scripts/findings.py`."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from scripts.findings import compute_percentages, count_signs, format_median

RUNS, AGENTS = 5, 3


def test_effects_are_percentages_of_the_innate_fitness_of_the_better_genomes() -> None:
    """The oracle computes the effects run by run from the means over agents."""
    values = np.random.default_rng(1).uniform(0.2, 0.9, (RUNS, 1, 2, 2, AGENTS))
    dimensions = ("run", "generation", "history", "regime", "agent")
    fork = xr.Dataset(
        {"innate_fitness": (dimensions, values), "fitness": (dimensions, values)},
        {"generation": [150], "history": ["learner", "control"], "regime": ["on", "off"]},
    )
    difference = xr.DataArray(np.linspace(-0.2, 0.1, RUNS), dims="run")
    percentages = compute_percentages(fork, difference)
    means = values.mean(axis=-1)[:, 0]
    scale = max(means[:, history, 1].mean() for history in (0, 1))
    for run, ((learner_on, learner_off), (control_on, control_off)) in enumerate(means):
        regime = (learner_on - learner_off + control_on - control_off) / 2
        assert percentages["regime"][run] == pytest.approx(100 * regime / scale)
        history = learner_off - control_off
        assert percentages["history"][run] == pytest.approx(100 * history / scale)
        assert percentages["now"][run] == pytest.approx(100 * float(difference[run]) / scale)


def test_the_sign_test_ignores_zeros() -> None:
    # Of 2^4 signs, one has no negative one and one has no positive one.
    assert count_signs(np.array([1.0, 2, 0, 3, 4, 0])) == "4, 0, 2; p = 0.12"
    assert count_signs(np.array([0.0, -1, 0])) == "0, 1, 2; p = 1"


def test_an_estimate_has_three_digits() -> None:
    assert format_median(np.array([2.0, 2.0, 2.0])) == "2 [2, 2]"
    assert format_median(np.array([158.7])) == "159 [nan, nan]"
