"""Selection differentials, Price's partition, heritability and distances, against plain loops."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import xarray as xr
from scipy import stats

from baldwinlab.analysis.estimands.quantitative_genetics import (
    PARTS,
    average_difference,
    compute_differentials,
    correlate_distances,
    count_offspring,
    covariance,
    estimate_heritability,
    is_sign_informative,
    partition_change,
    relative_difference,
    standardize,
)
from baldwinlab.analysis.estimands.traits import INNATE_FITNESS, select_innate_trait
from baldwinlab.experiment import Experiment
from tests.analysis.estimands.conftest import Stored

# Paenke, Sendhoff and Kawecki: the sign of the curvature of the logarithm of fitness.
SIGNS = {"convex": 1, "exponential": 0, "concave": -1}
DIMS = ("run", "generation", "agent")


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


def label(values: np.ndarray, dims: tuple[str, ...] = DIMS) -> xr.DataArray:
    return xr.DataArray(values, dims=dims).assign_coords(generation=np.arange(values.shape[1]))


def random_generations() -> dict[str, Any]:
    """Two runs of five generations of six agents with random parents, trait and fitness."""
    rng = np.random.default_rng(3)
    parents = rng.integers(0, 6, (2, 5, 6, 2))
    parents[:, 0] = -1
    return {
        "trait": label(rng.normal(size=(2, 5, 6))),
        "parents": label(parents, (*DIMS, "parent")),
        "offspring_off": label(rng.random((2, 5, 6))),
        "offspring_on": label(rng.random((2, 5, 6))),
    }


def relative_covariance(weights: np.ndarray, trait: np.ndarray) -> float:
    mean_weight, mean_trait = weights.mean(), trait.mean()
    pairs = zip(weights.tolist(), trait.tolist(), strict=True)
    return float(sum((w / mean_weight - 1) * (z - mean_trait) for w, z in pairs) / trait.size)


def test_each_part_is_that_of_a_plain_loop() -> None:
    data = random_generations()
    partition = partition_change(**data)
    trait, parents = data["trait"].values, data["parents"].values
    for run in range(2):
        for generation in range(4):
            row = partition.isel(run=run, generation=generation)
            z = trait[run, generation]
            off, on = (
                relative_covariance(data[name].values[run, generation], z)
                for name in ("offspring_off", "offspring_on")
            )
            realized = np.zeros(6)
            gains = []
            for child, pair in enumerate(parents[run, generation + 1]):
                for parent in pair:
                    realized[parent] += 0.5
                    gains.append(trait[run, generation + 1, child] - z[parent])
            expected = [off, on - off, relative_covariance(realized, z) - on, np.mean(gains)]
            assert [float(row[name]) for name in PARTS] == pytest.approx(expected, abs=1e-12)


def test_numbers_of_offspring_have_the_mean_1() -> None:
    parents = random_generations()["parents"].isel(generation=slice(1, None))
    assert (count_offspring(parents).sum("agent") == 6).all()


def test_only_generations_with_an_expectation_and_a_next_generation_are_included() -> None:
    data = random_generations()
    thinned = {
        name: data[name].isel(generation=[0, 2, 4]) for name in ("offspring_off", "offspring_on")
    }
    partition = partition_change(**{**data, **thinned})
    assert partition["generation"].values.tolist() == [0, 2]
    complete = partition_change(**data).isel(generation=[0, 2])
    xr.testing.assert_allclose(partition, complete)


def inherit(heritability: float) -> xr.Dataset:
    """Two generations of 20,000 agents whose trait has a known heritability."""
    rng = np.random.default_rng(4)
    n_agents = 20_000
    breeding_values = rng.normal(size=n_agents) * heritability**0.5
    noise = (1 - heritability) ** 0.5
    parents = rng.integers(0, n_agents, (n_agents, 2))
    # Half of the additive variance is among the children of the same parents.
    segregation = rng.normal(size=n_agents) * (heritability / 2) ** 0.5
    children = breeding_values[parents].mean(axis=1) + segregation
    generations = [
        values + noise * rng.normal(size=n_agents) for values in (breeding_values, children)
    ]
    stored_parents = np.stack([np.full_like(parents, -1), parents])
    return xr.Dataset(
        {
            "trait": (DIMS, np.stack(generations)[None]),
            "parents": ((*DIMS, "parent"), stored_parents[None]),
        },
        {"generation": [0, 1]},
    )


@pytest.mark.parametrize("heritability", [0.2, 0.6, 1.0])
def test_the_regression_on_parents_recovers_the_heritability(heritability: float) -> None:
    data = inherit(heritability)
    result = estimate_heritability(data["trait"], data["parents"]).squeeze()
    assert float(result["heritability"]) == pytest.approx(heritability, abs=0.03)
    assert float(result["additive variance"]) == pytest.approx(heritability, abs=0.03)


def test_the_slope_is_that_of_a_linear_regression() -> None:
    data = inherit(0.5)
    result = estimate_heritability(data["trait"], data["parents"])
    slope = result["heritability"].item()
    trait, parents = data["trait"].values[0], data["parents"].values[0, 1]
    regression = stats.linregress(trait[0][parents].mean(axis=1), trait[1])
    assert slope == pytest.approx(regression.slope)


def test_the_breeders_equation_holds_for_a_trait_with_little_mutation(
    stored: dict[str, Stored],
) -> None:
    data = stored["stepping/convex"]
    trait = select_innate_trait(data.runs, data.innate, data.experiment).values
    result = estimate_heritability(trait, data.runs["parents"])
    assert float(result["heritability"].median()) == pytest.approx(1, abs=0.05)
    np.testing.assert_allclose(
        result["predicted response"].mean(("run", "generation")),
        result["response"].mean(("run", "generation")),
        rtol=0.1,
    )


def test_the_correlation_of_distances_is_that_of_all_pairs() -> None:
    rng = np.random.default_rng(5)
    genotypes, phenotypes = rng.random((7, 4)), rng.random((7, 2))
    pairs = [(i, j) for i in range(7) for j in range(i)]
    genetic = [float(np.sqrt(((genotypes[i] - genotypes[j]) ** 2).sum())) for i, j in pairs]
    learned = [float(np.sqrt(((phenotypes[i] - phenotypes[j]) ** 2).sum())) for i, j in pairs]
    measured = correlate_distances(
        xr.DataArray(genotypes, dims=("agent", "gene")),
        xr.DataArray(phenotypes, dims=("agent", "feature")),
    )
    assert float(measured) == pytest.approx(float(np.corrcoef(genetic, learned)[0, 1]))
    # Equal phenotypes have no correlation.
    different = xr.DataArray(np.eye(4), dims=("agent", "gene"))
    equal = xr.DataArray(np.ones((4, 1)), dims=("agent", "feature"))
    assert np.isnan(correlate_distances(different, equal))
