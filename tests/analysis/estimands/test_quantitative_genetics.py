"""Heritability, the breeder's equation and the correlation of distances."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from scipy import stats

from baldwinlab.analysis.estimands.quantitative_genetics import (
    correlate_distances,
    estimate_heritability,
)
from baldwinlab.analysis.estimands.traits import select_innate_trait
from tests.analysis.estimands.conftest import Stored

DIMS = ("run", "generation", "agent")


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
