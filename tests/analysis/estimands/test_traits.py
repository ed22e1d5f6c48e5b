"""Traits of runs, of which some stop early."""

from __future__ import annotations

import numpy as np
import xarray as xr

from baldwinlab.analysis.estimands.traits import select_innate_trait, select_learned_distance
from baldwinlab.papers.presets import load

DIMS = ("run", "generation", "agent")


def test_a_stopped_run_has_the_trait_of_its_last_generation_as_in_the_assay() -> None:
    values = 10.0 * np.arange(2)[:, None, None] + np.arange(5)[:, None] + np.zeros(3)
    coordinates = {"run": [0, 1], "generation": range(5), "n_generations": ("run", [5, 3])}
    data = xr.Dataset({"ones": (DIMS, values), "unset": (DIMS, -values)}, coordinates)
    data = data.where(data["generation"] < data["n_generations"])
    innate = xr.Dataset(coords={"run": [0, 1], "generation": [0, 2, 4]})
    experiment = load("hinton-nowlan-1987:guessing")

    trait = select_innate_trait(data, innate, experiment).values
    assert trait.dims == DIMS and trait["generation"].values.tolist() == [0, 2, 4]
    assert trait.isel(agent=0).values.tolist() == [[0, 2, 4], [10, 12, 12]]
    distance = select_learned_distance(data, innate, experiment)
    assert distance is not None
    assert distance.values.values.tolist() == [[0, -2, -4], [-10, -12, -12]]
