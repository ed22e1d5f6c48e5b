"""What a population achieved, on studies small enough to work out by hand."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from baldwinlab.statistics import fitness
from baldwinlab.statistics.summary import by_condition
from tests.statistics.studies import study

NAN = float("nan")


def by_hand(food: list[list[list[list[float]]]]) -> xr.Dataset:
    """A study [condition, run, generation, agent] in which an item gives 2 energy."""
    array = np.array(food, np.float64)
    dims = ("condition", "run", "generation", "agent")
    coords = {dim: range(size) for dim, size in zip(dims, array.shape, strict=True)}
    return xr.Dataset({"food_eaten": (dims, array), "energy": (dims, 2 * array)}, coords)


def test_best_and_mean_are_of_energy_and_share_is_of_agents() -> None:
    one = by_hand([[[[0, 1, 5], [0, 0, 0]]]])
    assert fitness.best(one).values.tolist() == [[[10, 0]]]
    assert fitness.mean(one).values.tolist() == [[[4, 0]]]
    np.testing.assert_allclose(fitness.share(one).values, [[[2 / 3, 0]]])
    assert fitness.most(one).values.tolist() == [[5]]


def test_integers_do_as_well() -> None:
    one = by_hand([[[[0, 1, 5], [0, 0, 0]]]])
    one["food_eaten"] = one["food_eaten"].astype(np.int32)
    np.testing.assert_allclose(fitness.share(one).values, [[[2 / 3, 0]]])


def test_final_and_initial_average_over_their_window() -> None:
    one = by_hand([[[[1], [2], [3], [4]]]])
    assert fitness.final(one, "mean", last=2).values.tolist() == [[7]]
    assert fitness.initial(one, "mean", first=2).values.tolist() == [[3]]
    assert fitness.final(one, "mean", last=99).values.tolist() == fitness.initial(one, "mean", 99).values.tolist() == [[5]]


def test_a_condition_with_fewer_generations_ends_with_its_own_last() -> None:
    two = by_hand([[[[1], [2], [3], [4]]], [[[5], [6], [NAN], [NAN]]]])
    assert fitness.final(two, "mean", last=1).values.tolist() == [[8], [12]]


def test_missing_runs_and_agents_stay_missing() -> None:
    two = by_hand([[[[1, NAN]], [[NAN, NAN]]]])
    for measure in fitness.MEASURES:
        found = fitness.final(two, measure).values[0]
        assert np.isfinite(found[0]) and np.isnan(found[1])


@pytest.mark.parametrize("window", [fitness.final, fitness.initial])
def test_a_window_has_at_least_one_generation(window: object) -> None:
    assert callable(window)
    with pytest.raises(ValueError, match="at least 1"):
        window(by_hand([[[[1]]]]), "mean", 0)


def test_the_summary_has_a_row_for_each_condition_and_measure_that_there_is() -> None:
    rows = by_condition(study({"one": [1, 2, 3, 4], "two": [NAN]}))
    assert [(row["condition"], row["measure"]) for row in rows] == [("one", "best"), ("one", "mean"), ("one", "share")]
    best = rows[0]
    assert (best["n"], best["median"], best["mean"], best["lower_quartile"], best["min"], best["max"]) == (
        4,
        2.5,
        2.5,
        1.75,
        1,
        4,
    )
