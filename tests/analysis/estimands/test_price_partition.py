"""The partition of the change of a mean: an identity, and a plain loop."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import xarray as xr

from baldwinlab.analysis.estimands.expected_offspring import expect_offspring
from baldwinlab.analysis.estimands.quantitative_genetics import (
    PARTS,
    count_offspring,
    partition_change,
)
from baldwinlab.analysis.estimands.traits import select_innate_trait
from tests.analysis.estimands.conftest import CONDITIONS, Stored

DIMS = ("run", "generation", "agent")


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


@pytest.mark.parametrize("condition", CONDITIONS)
def test_the_parts_add_up_to_the_observed_change(stored: dict[str, Stored], condition: str) -> None:
    data = stored[condition]
    trait = select_innate_trait(data.runs, data.innate, data.experiment).values
    offspring = {
        life: expect_offspring(data.innate["energy"].sel(life=life, drop=True), data.experiment)
        for life in ("off", "on")
    }
    partition = partition_change(trait, data.runs["parents"], offspring["off"], offspring["on"])
    means = trait.astype(np.float64).mean("agent")
    assert partition.sizes["generation"] == trait.sizes["generation"] - 1
    np.testing.assert_allclose(partition["change"], means.diff("generation"), atol=1e-12)
    total = sum(partition[name] for name in PARTS)
    np.testing.assert_allclose(total, partition["change"], rtol=0, atol=1e-9)
    assert abs(partition["change"]).max() > 1e-3


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
