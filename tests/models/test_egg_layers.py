"""Flies that choose a medium agree with plain Python, and their evolution with the gain law."""

from __future__ import annotations

import math

import numpy as np
import pytest

import baldwinlab as bl
from baldwinlab.evolution import GenerationKey
from baldwinlab.experiment import assign
from baldwinlab.models.egg_layers import EggLayers
from tests.evolution.single_runs import breed, draw_genomes
from tests.models.runs import simulate_runs
from tests.oracles.theory.gain import selection_gain
from tests.oracles.theory.medium_preference import choice_share, predict_preferences

EXPERIENCES = ("both-media", "wrong-medium", "constant")
CONDITIONS = tuple(
    f"{flies}/{medium}"
    for flies in ("innate-flies", "learning-flies")
    for medium in ("orange", "pineapple")
)


def lay_eggs(preference: float) -> float:
    return 1 / (1 + math.exp(-preference))


def learn(preference: float, shift: float, experience: str) -> float:
    right = lay_eggs(preference)
    visits = {
        # Two visits go to different media with the probability 2 p (1 - p), which is 1/2 at most.
        "both-media": 2 * right * (1 - right) / (1 / 2),
        "wrong-medium": 1 - right,
        "constant": 1.0,
    }
    return shift * visits[experience]


@pytest.mark.parametrize("experience", EXPERIENCES)
def test_every_fly_lays_the_eggs_that_plain_python_computes(experience: str) -> None:
    genomes = np.random.default_rng(1).normal(0, 3, (2, 40, 1, 1)).astype(np.float32)
    model = EggLayers(learning_shift=1.3, experience=experience)
    results = model.simulate(0, [0, 1], 0, genomes)
    for index in np.ndindex(2, 40):
        preference = float(genomes[index][0, 0])
        shift = learn(preference, 1.3, experience)
        assert results.energy[index] == pytest.approx(lay_eggs(preference + shift), rel=1e-12)
        assert results.records["learned_shift"][index] == np.float32(shift)
        assert results.records["innate_share"][index] == pytest.approx(
            lay_eggs(preference), rel=1e-7
        )
    assert results.learned is not None
    expected = genomes[:, :, 0, 0] + results.records["learned_shift"]
    np.testing.assert_allclose(results.learned[:, :, 0], expected, atol=1e-6)


@pytest.mark.parametrize("experience", EXPERIENCES)
def test_the_recorded_slope_of_the_gain_is_its_numerical_derivative(experience: str) -> None:
    def log_gain(preference: float) -> float:
        learned = preference + learn(preference, 1.5, experience)
        return math.log(lay_eggs(learned) / lay_eggs(preference))

    x = np.linspace(-4, 4, 33, dtype=np.float32)
    model = EggLayers(experience=experience)
    slopes = model.simulate(0, [0], 0, x[None, :, None, None]).records["gain_slope"][0]
    derivative = [(log_gain(v + 1e-5) - log_gain(v - 1e-5)) / 2e-5 for v in x.tolist()]
    np.testing.assert_allclose(slopes, derivative, atol=1e-7)


def test_without_learning_a_fly_chooses_by_its_innate_preference() -> None:
    genomes = np.linspace(-400, 400, 81, dtype=np.float32)[None, :, None, None]
    results = EggLayers().without_learning().simulate(0, [0], 0, genomes)
    assert (results.energy.astype(np.float32) == results.records["innate_share"]).all()
    assert (results.records["learned_shift"] == 0).all()
    assert (results.records["gain_slope"] == 0).all()
    assert np.isfinite(results.energy).all()
    assert results.energy[0, 40] == 0.5
    assert (np.diff(results.energy[0]) >= 0).all()


@pytest.mark.parametrize("condition", CONDITIONS)
def test_evolution_follows_the_recursion_of_an_infinite_population(condition: str) -> None:
    """The mean of 8 runs of 5,000 flies is within four standard errors in each generation."""
    experiment = assign(bl.load(condition), ["population.size=5000"])
    model = experiment.model_part
    predicted = predict_preferences(
        model.initial_preference,
        model.initial_std,
        experiment.evolution.mutation_size,
        experiment.evolution.generations,
        lambda x: model.learn(choice_share(x))[0],
    )
    runs = simulate_runs(experiment, 3, 8)
    preferences = runs["preference"].values.astype(np.float64)
    means = preferences.mean(axis=2)
    error = means.std(axis=0, ddof=1) / np.sqrt(8)
    assert (np.abs(means.mean(axis=0) - predicted.mean) < 4.5 * error).all()
    # The standard deviation of a sample of 40,000 flies has a relative error of 0.4 %.
    stds = preferences.std(axis=2).mean(axis=0)
    np.testing.assert_allclose(stds, predicted.std, rtol=0.016)


def test_one_generation_of_a_large_population_has_the_response_of_the_law() -> None:
    """Learning moves the parents by Cov(x, g) / E(g), both weighted by innate fitness."""
    differences = []
    for condition in ("learning-flies/pineapple", "innate-flies/pineapple"):
        experiment = assign(
            bl.load(condition),
            ["population.size=40000", "evolution.selection=expected-offspring"],
        )
        genomes = draw_genomes(experiment, GenerationKey(1, 0, 0))
        results = experiment.model_part.simulate(1, [0], 0, genomes[None])
        children, _ = breed(experiment, genomes, results.energy[0], GenerationKey(1, 0, 1))
        differences.append((genomes, results, children.mean(dtype=np.float64)))
    (genomes, learned, with_learning), (_, innate, without) = differences
    x = genomes[:, 0, 0].astype(np.float64)
    expected = selection_gain(x, innate.energy[0], learned.energy[0])
    # The segregation draws are the same; only the rounding of offspring numbers differs.
    assert with_learning - without == pytest.approx(expected, abs=4e-4)
    assert expected > 0.005
