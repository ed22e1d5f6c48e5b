"""Expected numbers of offspring, compared with many draws of the selection schemes."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import xarray as xr

from baldwinlab.analysis.estimands.expected_offspring import (
    MUTANT_FIXATION,
    SCHEMES,
    expect_offspring,
)
from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.parts.breeding import ITSELF
from tests.oracles.parts import find_oracle

FITNESS = np.array([3.0, 0.0, 3.0, 7.5, 1.0, 0.0, 12.0, 3.0])
N_DRAWS = 4000
# Standard errors of the mean of a number of offspring are below 0.02.
TOLERANCE = 0.08


def make_experiment(**evolution: Any) -> Experiment:
    return Experiment(population={"size": FITNESS.size}, evolution=evolution)


def count_by_drawing(experiment: BaseExperiment, fitness: np.ndarray) -> np.ndarray:
    """Return the mean numbers of offspring in many generations of the scheme's oracle."""
    rng = np.random.default_rng(8)
    scheme = experiment.part("evolution.selection")
    elite = experiment.evolution.elite
    slots = np.zeros(fitness.size)
    for _ in range(N_DRAWS):
        uniforms = rng.random((fitness.size, 2, 4))
        generation = SimpleNamespace(fitness=fitness.tolist(), uniforms=uniforms.tolist())
        pairs = find_oracle(scheme)(scheme, generation)
        survivors = sorted(range(fitness.size), key=lambda a: (-fitness[a], uniforms[a, 1, 3]))
        pairs[:elite] = [[survivor, ITSELF] for survivor in survivors[:elite]]
        for first, second in pairs:
            slots[first] += 0.5
            slots[first if second == ITSELF else second] += 0.5
    return slots / N_DRAWS


# A scheme that breeds pairs of agents separately refuses an elite.
@pytest.mark.parametrize(
    ("scheme", "elite"),
    [
        (scheme, elite)
        for scheme in SCHEMES
        for elite in (0, 3)
        if scheme != MUTANT_FIXATION or elite == 0
    ],
)
def test_expected_offspring_are_those_of_many_draws(scheme: str, elite: int) -> None:
    experiment = make_experiment(selection=scheme, elite=elite)
    expected = expect_offspring(xr.DataArray(FITNESS, dims="agent"), experiment)
    assert float(expected.mean()) == pytest.approx(1)
    drawn = count_by_drawing(experiment, FITNESS)
    np.testing.assert_allclose(expected.values, drawn, atol=TOLERANCE)


def test_a_share_of_the_children_of_the_best_has_a_second_parent() -> None:
    settings = {"parent_share": 0.4, "two_parent_share": 0.5}
    experiment = make_experiment(selection="best-copies", best_copies=settings)
    expected = expect_offspring(xr.DataArray(FITNESS, dims="agent"), experiment)
    drawn = count_by_drawing(experiment, FITNESS)
    np.testing.assert_allclose(expected.values, drawn, atol=TOLERANCE)


@pytest.mark.parametrize("scheme", ["roulette", "outcrossing"])
@pytest.mark.parametrize("fitness", [np.zeros(4), np.array([0.0, 5.0, 0.0, 0.0])])
def test_without_fitness_all_agents_are_alike(scheme: str, fitness: np.ndarray) -> None:
    experiment = Experiment(population={"size": 4}, evolution={"selection": scheme})
    expected = expect_offspring(xr.DataArray(fitness, dims="agent"), experiment)
    drawn = count_by_drawing(experiment, fitness)
    np.testing.assert_allclose(expected.values, drawn, atol=TOLERANCE)


@pytest.mark.parametrize("scheme", SCHEMES)
def test_a_population_with_an_unknown_fitness_has_no_expectation(scheme: str) -> None:
    fitness = np.stack([FITNESS, np.where(FITNESS == 1, np.nan, FITNESS)])
    experiment = make_experiment(selection=scheme)
    expected = expect_offspring(xr.DataArray(fitness, dims=("run", "agent")), experiment)
    assert expected.notnull().all("agent").values.tolist() == [True, False]
