"""Selection differentials, compared with plain loops and with systems whose sign is known."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from baldwinlab.analysis.estimands.quantitative_genetics import (
    average_difference,
    compute_differentials,
    covariance,
    is_sign_informative,
    relative_difference,
    standardize,
)
from baldwinlab.analysis.estimands.traits import INNATE_FITNESS, select_innate_trait
from baldwinlab.experiment import Experiment
from tests.analysis.estimands.conftest import Stored

# Paenke, Sendhoff and Kawecki: the sign of the curvature of the logarithm of fitness.
SIGNS = {"convex": 1, "exponential": 0, "concave": -1}


def differentials_of(data: Stored) -> xr.Dataset:
    trait = select_innate_trait(data.runs, data.innate, data.experiment)
    return compute_differentials(data.innate, trait.values, data.experiment)


def test_a_differential_is_the_covariance_of_relative_fitness_and_trait() -> None:
    rng = np.random.default_rng(1)
    weights, trait = rng.random((2, 3, 9))
    arrays = [xr.DataArray(values, dims=("run", "agent")) for values in (weights, trait)]
    measured = standardize(covariance(*arrays), arrays[1])
    for run in range(3):
        w, z = weights[run].tolist(), trait[run].tolist()
        mean_w, mean_z = sum(w) / 9, sum(z) / 9
        products = [(a / mean_w - 1) * (b - mean_z) for a, b in zip(w, z, strict=True)]
        sd = (sum((b - mean_z) ** 2 for b in z) / 9) ** 0.5
        assert float(measured[run]) == pytest.approx(sum(products) / 9 / sd, abs=1e-12)
    # A constant trait has no differential although means are rounded.
    constant = xr.DataArray(np.full(7, 0.1), dims="agent")
    assert np.isnan(standardize(covariance(constant * np.arange(7.0), constant), constant))


@pytest.mark.parametrize("shape", SIGNS)
def test_learning_guides_on_convex_and_hides_on_concave_slopes(
    stored: dict[str, Stored], shape: str
) -> None:
    difference = average_difference(differentials_of(stored[f"stepping/{shape}"]))
    if SIGNS[shape] == 0:
        assert abs(difference).max() < 0.0005
    else:
        assert (difference * SIGNS[shape] > 0.02).all()


def test_the_differential_on_an_exponential_slope_is_that_of_a_normal_distribution(
    stored: dict[str, Stored],
) -> None:
    # For fitness exp(x) and a normal trait, Cov(w, x) / mean w is the variance of x.
    data = stored["stepping/exponential"]
    trait = select_innate_trait(data.runs, data.innate, data.experiment).values
    founders = differentials_of(data).isel(generation=0)
    sd = trait.isel(generation=0).std("agent")
    np.testing.assert_allclose(founders["off"], sd, rtol=0.15)


def test_without_guesses_no_selection_acts_on_the_founders_of_hinton_and_nowlan(
    stored: dict[str, Stored],
) -> None:
    data = stored["guessing"]
    trait = select_innate_trait(data.runs, data.innate, data.experiment)
    assert trait.name == "share of alleles that are 1, the correct allele"
    differentials = differentials_of(data).isel(generation=slice(3))
    # No founder has all alleles set, so that all have the same fitness without learning.
    assert abs(differentials["off"]).max() < 1e-9
    assert average_difference(differentials_of(data)).max() > 0.1


def test_selection_by_ranks_gives_innate_fitness_the_largest_differential(
    stored: dict[str, Stored],
) -> None:
    data = stored["costly-climbing/rugged"]
    assert select_innate_trait(data.runs, data.innate, data.experiment).name == INNATE_FITNESS
    differentials = differentials_of(data)
    assert (differentials["difference"].fillna(0) <= 1e-12).all()
    ratio = relative_difference(differentials)
    assert ((ratio > -1) & (ratio < 0)).all()


@pytest.mark.parametrize(
    ("scheme", "is_innate_fitness", "expected"),
    [
        ("roulette", True, True),
        ("truncation", True, False),
        ("truncation", False, True),
    ],
)
def test_the_sign_is_informative_unless_selection_ranks_the_trait_itself(
    scheme: str, is_innate_fitness: bool, expected: bool
) -> None:
    experiment = Experiment(evolution={"selection": scheme})
    assert is_sign_informative(experiment, is_innate_fitness) is expected


def test_differentials_do_not_change_with_the_unit_of_the_trait(
    stored: dict[str, Stored],
) -> None:
    data = stored["stepping/convex"]
    trait = select_innate_trait(data.runs, data.innate, data.experiment).values
    scaled = compute_differentials(data.innate, 100 * trait - 3, data.experiment)
    xr.testing.assert_allclose(scaled, differentials_of(data), rtol=1e-6, atol=1e-9)
