"""Test the measures of each species of runs with predators and prey."""

from __future__ import annotations

import numpy as np
import xarray as xr

from baldwinlab.experiment.predation_measures import make_predation_measures


def test_measures_average_the_agents_of_a_species_over_the_last_ten_generations() -> None:
    dims = ("run", "generation", "agent")
    energy = np.zeros((1, 12, 3))
    energy[0, 2:, 0] = 4.0
    energy[0, :2] = 100.0
    energy[0, 2:, 1:] = 1.0
    alive = np.zeros((1, 12, 3))
    alive[0, 7:, 1:] = 1
    species = np.broadcast_to([0, 1, 1], (1, 12, 3))
    runs = xr.Dataset(
        {"energy": (dims, energy), "alive": (dims, alive), "species": (dims, species)}
    )
    measures = make_predation_measures(["predators", "prey"], ["prey"])
    assert set(measures) == {"predators-fitness", "prey-fitness", "prey-survival"}
    assert measures["predators-fitness"].of(runs).item() == 4.0
    assert measures["prey-fitness"].of(runs).item() == 1.0
    assert measures["prey-survival"].of(runs).item() == 0.5
