"""Selection differentials on slopes agree with their definition and with the closed form.

Fitness without learning is exp(s x + c x^2 / 2). A learned step d multiplies it by exp(c d x), up
to a constant. Therefore, the population with learning is the population that is selected without
learning, tilted by h = c d. For a normal distribution with the standard deviation sd, its mean
differs by h sd^2 / (1 - c sd^2).
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import xarray as xr

import baldwinlab as bl
from baldwinlab.analysis.estimands.quantitative_genetics import compute_differentials
from baldwinlab.analysis.statistics import median_interval
from baldwinlab.evolution import GenerationKey
from tests.analysis.estimands.conftest import SLOPES, Stored


def difference_of(innate: xr.Dataset, x: xr.DataArray, experiment: Any) -> xr.DataArray:
    return compute_differentials(innate, x.astype(np.float64), experiment)["difference"]


def differential(x: np.ndarray, log_fitness: np.ndarray) -> Any:
    """Return Cov(w / mean w, x) / SD(x) over the last dimension, from the definition."""
    w = np.exp(log_fitness - log_fitness.max(axis=-1, keepdims=True))
    w /= w.sum(axis=-1, keepdims=True)
    return ((w * x).sum(axis=-1) - x.mean(axis=-1)) / x.std(axis=-1)


def log_fitness_on(model: Any, x: Any) -> Any:
    return model.slope * x + model.curvature * x**2 / 2


@pytest.mark.parametrize("condition", SLOPES)
def test_every_generation_has_the_differential_of_its_own_distribution(
    stored: dict[str, Stored], condition: str
) -> None:
    runs, innate, _, experiment = stored[condition]
    model = experiment.model_part
    # Genomes have single precision, and so has the sum of x and the step.
    newborns = runs["innate_x"].values
    learned = newborns + np.float32(model.learning_step)
    x, x_learned = newborns.astype(np.float64), learned.astype(np.float64)
    on, off = (differential(x, log_fitness_on(model, z)) for z in (x_learned, x))
    measured = difference_of(innate, runs["innate_x"], experiment)
    np.testing.assert_allclose(measured, on - off, rtol=0, atol=1e-9)


@pytest.mark.parametrize("condition", SLOPES)
def test_a_large_normal_population_meets_the_closed_form_within_its_interval(
    condition: str,
) -> None:
    experiment = bl.load(f"paenke-2007:{condition}")
    model = experiment.model_part
    n_runs, n_agents, generation = 20, 20_000, 0
    keys = [GenerationKey(5, run, generation) for run in range(n_runs)]
    genomes = np.stack([model.founders(n_agents, key) for key in keys])
    energy = {
        life: variant.simulate(5, range(n_runs), generation, genomes).energy
        for life, variant in (("on", model), ("off", model.without_learning()))
    }
    innate = xr.Dataset(
        {"energy": (("life", "run", "agent"), np.stack(list(energy.values())))},
        {"life": list(energy)},
    )
    x = xr.DataArray(genomes[:, :, 0, 0], dims=("run", "agent"))
    low, high = median_interval(difference_of(innate, x, experiment).values)
    sd = model.initial_std
    closed_form = model.curvature * model.learning_step * sd / (1 - model.curvature * sd**2)
    assert low - 1e-9 <= closed_form <= high + 1e-9
    assert high - low < 1e-3
