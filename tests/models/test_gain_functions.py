"""Models agree with plain Python, and their evolution with the law of the gain function.

The law holds for any distribution of x and for selection in proportion to fitness. Learning moves
the mean of the parents by Cov_f(x, g) / E_f(g). Here g = f_L / f, and both are weighted by innate
fitness f. Its sign is that of the slope of g (Chebyshev).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import baldwinlab as bl
from baldwinlab.engine import rng
from baldwinlab.evolution import GenerationKey
from baldwinlab.experiment import assign
from baldwinlab.models.gain_functions import EggLayers, SlopeClimbers
from baldwinlab.models.hinton_nowlan import HintonNowlan
from baldwinlab.models.kit import exponential
from tests.evolution.single_runs import breed, draw_genomes, select
from tests.models.runs import simulate_runs
from tests.oracles.theory.gain import selection_gain
from tests.oracles.theory.medium_preference import choice_share, predict_preferences

Numbers = npt.NDArray[np.float64]
BENDS = {"convex": 1.0, "exponential": 0.0, "concave": -1.0}
EVEN = assign(bl.load("stepping/convex"), ["evolution.selection=expected-offspring"])
SAMPLED = bl.load("stepping/convex")


def select_mean(
    experiment: Any, x: Numbers, fitness: Numbers, n_parents: float, generation: int = 0
) -> float:
    """Return the mean x of a number of selected parents."""
    uniforms = GenerationKey(5, 0, generation).uniforms(rng.SELECTION, (int(n_parents) // 2, 2))
    return float(x[select(experiment, fitness, uniforms)].mean())


@pytest.mark.nightly
def test_the_law_is_exact_in_ten_thousand_populations() -> None:
    """If expected numbers of offspring are integers, selection has no noise."""
    generator = np.random.default_rng(1)
    for case in range(10_000):
        agents = int(generator.integers(2, 9))
        x = generator.normal(0, 3, agents)
        innate, learned = (generator.integers(low, 9, agents).astype(float) for low in (1, 0))
        learned[0] += learned.sum() == 0
        # In half of the cases, g rises with x.
        if case % 2:
            learned = innate * np.sort(generator.integers(1, 9, agents))[x.argsort().argsort()]
        with_learning, without = (
            select_mean(EVEN, x, fitness, 2 * fitness.sum()) for fitness in (learned, innate)
        )
        moved = with_learning - without
        assert abs(moved - selection_gain(x, innate, learned)) < 1e-12
        assert not case % 2 or moved > -1e-12


def test_random_selection_follows_the_law_on_average() -> None:
    generator = np.random.default_rng(2)
    x = generator.normal(0.8, 0.3, 1000)
    slope = SlopeClimbers(curvature=1)
    innate = slope.fitness(x)
    learned = slope.fitness(x + 0.3)
    moved = [
        select_mean(SAMPLED, x, learned, 2000, 2 * k)
        - select_mean(SAMPLED, x, innate, 2000, 2 * k + 1)
        for k in range(2000)
    ]
    expected = selection_gain(x, innate, learned)
    error = np.std(moved) / np.sqrt(len(moved))
    assert abs(np.mean(moved) - expected) < 4 * error and expected > 20 * error


def test_parents_on_an_exponential_slope_are_equal_with_and_without_learning() -> None:
    values = [
        simulate_runs(bl.load(f"{name}/exponential"), 3)["innate_x"].values
        for name in ("stepping", "not-stepping")
    ]
    assert (values[0] == values[1]).all()


def gaussian_step(
    mean: float, variance: float, slope: SlopeClimbers, mutation: float
) -> tuple[float, float]:
    """Return mean and variance of an infinite normal population after a generation."""
    left = 1 - slope.curvature * variance
    return (
        mean + variance * (slope.slope + slope.curvature * slope.learning_step * slope.learning)
    ) / left, variance / left + mutation**2


@pytest.mark.parametrize("selection", ["roulette", "expected-offspring"])
@pytest.mark.parametrize("condition", ["stepping", "not-stepping"])
@pytest.mark.parametrize("name", BENDS)
def test_the_change_of_a_normal_population_matches_theory(
    condition: str, name: str, selection: str
) -> None:
    agents = 40_000
    changes = [
        f"population.size={agents}",
        f"evolution.selection={selection}",
        "slope_climbers.initial_std=0.3",
    ]
    experiment = assign(bl.load(f"{condition}/{name}"), changes)
    slope = experiment.model_part
    genomes = draw_genomes(experiment, GenerationKey(1, 0, 0))
    energy = slope.simulate(1, [0], 0, genomes[None]).energy[0]
    children, _ = breed(experiment, genomes, energy, GenerationKey(1, 0, 1))
    mean, variance = gaussian_step(
        slope.initial_mean, 0.3**2, slope, experiment.evolution.mutation_size
    )
    # Both the agents and the parents are random samples.
    error = np.sqrt(2 * variance / agents)
    assert abs(children.mean(dtype=np.float64) - mean) < 4 * error
    assert abs(children.var(dtype=np.float64) - variance) < 4 * np.sqrt(4 * variance**2 / agents)


def test_several_generations_follow_the_recursion() -> None:
    """Populations are large, because the variance of small ones is lower."""
    for condition in ("stepping", "not-stepping"):
        experiment = assign(
            bl.load(f"{condition}/convex"), ["population.size=10000", "evolution.generations=11"]
        )
        slope = experiment.model_part
        mean = slope.initial_mean
        variance = slope.initial_std**2
        for _ in range(10):
            mean, variance = gaussian_step(
                mean, variance, slope, experiment.evolution.mutation_size
            )
        innate_x = simulate_runs(experiment, 2, 8)["innate_x"].values[:, -1]
        means = innate_x.mean(axis=1, dtype=np.float64)
        assert abs(means.mean() - mean) < 4 * means.std(ddof=1) / np.sqrt(len(means))


def test_fitness_depends_on_the_learned_x_and_the_genome_does_not_change() -> None:
    genomes = np.random.default_rng(4).normal(0, 1, (2, 30, 1, 1)).astype(np.float32)
    slope = SlopeClimbers(curvature=-0.5, slope=0.7, learning_step=0.25)
    results, control = (
        model.simulate(0, [0, 1], 0, genomes) for model in (slope, slope.without_learning())
    )
    x = genomes[:, :, 0, 0].astype(np.float64)
    assert np.allclose(
        results.energy, np.exp(0.7 * (x + 0.25) - 0.25 * (x + 0.25) ** 2), rtol=1e-6, atol=0
    )
    assert np.allclose(control.energy, np.exp(0.7 * x - 0.25 * x**2), rtol=1e-12, atol=0)
    assert results.learned is not None and np.allclose(results.learned[:, :, 0], x + 0.25)
    assert (
        slope.without_learning().simulate(0, [0, 1], 0, results.learned[:, :, None]).energy
        == results.energy
    ).all(), "once it is innate"
    assert (results.records["innate_x"] == x).all() and (
        results.records["uphill"] == (0.7 - 0.5 * x > 0)
    ).all()


def test_the_exponential_agrees_with_numpy() -> None:
    x = np.random.default_rng(5).uniform(-300, 300, 5000)
    values = np.array([exponential(value) for value in x.tolist()])
    assert np.allclose(values, np.exp(x), rtol=1e-12, atol=0)


def test_fitness_is_finite_for_large_x() -> None:
    fitness = SlopeClimbers(curvature=10).fitness(np.array([0.0, 1e3, -1e30]))
    assert (
        fitness[0] == 1 and np.isfinite(fitness).all() and fitness[1] == fitness[2] == fitness.max()
    )


def test_the_gain_function_of_a_needle_in_a_haystack_increases_and_then_decreases() -> None:
    """Strings without a 0, x of whose 20 alleles are 1: learning speeds every step but the last."""
    fitness = {}
    for guessing in (False, True):
        strings = np.array([[1.0] * x + [0.5] * (20 - x) for x in range(21)], np.float32)
        genomes = np.repeat(strings, 3000, axis=0)[None, :, None]
        energy = HintonNowlan(guessing=guessing).simulate(3, [0], 0, genomes).energy[0]
        fitness[guessing] = energy.reshape(21, 3000).mean(axis=1)
    gain = fitness[True] / fitness[False]
    assert (
        (np.diff(gain[8:20]) > 0).all()
        and gain[19] == pytest.approx(19.962, abs=0.002)
        and gain[20] == 1
    )
    assert fitness[False][20] / fitness[False][19] == pytest.approx(19.981)
    assert fitness[True][20] / fitness[True][19] == pytest.approx(1.00095, abs=1e-4)


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
