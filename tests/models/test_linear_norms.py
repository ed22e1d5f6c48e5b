"""Linear reaction norms: lifetimes agree with plain Python, evolution with the exact recursion."""

from __future__ import annotations

import math

import numpy as np
import pytest

import baldwinlab as bl
from baldwinlab.experiment import assign
from baldwinlab.models.linear_norms import LinearNorms
from baldwinlab.simulation.simulate import simulate_histories
from tests.oracles.theory.reaction_norm import Normal, Setting, breed_normal

SEED = 7


@pytest.mark.parametrize("generation", [0, 1, 5])
@pytest.mark.parametrize(
    "settings", [{}, {"plasticity": 0.0, "plasticity_cost": 1.0}, {"plasticity_cost": 0.3}]
)
def test_every_individual_has_the_fitness_that_plain_python_computes(
    generation: int, settings: dict[str, float]
) -> None:
    model = LinearNorms(**settings)
    genomes = np.random.default_rng(1).normal(0, 1, (2, 30, 1, 2)).astype(np.float32)
    results = model.simulate(SEED, [0, 4], generation, genomes)
    for row, run in enumerate((0, 4)):
        cue, environment = model.environment(SEED, run, generation)
        for agent in range(30):
            weights = [float(weight) for weight in genomes[row, agent, 0]]
            intercept = model.intercept_std * weights[0]
            slope = model.slope_std * weights[1]
            expressed_slope = model.plasticity * slope
            mismatch = intercept + expressed_slope * cue - model.optimum_slope * environment
            log_fitness = -(mismatch**2) / (2 * model.peak_width**2)
            log_fitness -= model.plasticity_cost * expressed_slope**2 / 2
            assert results.energy[row, agent] == pytest.approx(math.exp(log_fitness), rel=1e-12)
            expected = {
                "intercept": intercept,
                "slope": slope,
                "plastic_response": abs(expressed_slope * cue),
                "mismatch": mismatch,
            }
            for name, value in expected.items():
                assert results.records[name][row, agent] == np.float32(value)


def test_the_environment_jumps_once_and_has_the_correlation_of_the_setting() -> None:
    model = LinearNorms(jump=3.0, jump_generation=2000, predictability=0.25, noise_std=0.5)
    values = np.array([model.environment(SEED, 3, generation) for generation in range(4000)])
    before, after = values[:2000], values[2000:]
    error = 0.5 / np.sqrt(2000)
    np.testing.assert_allclose(before.mean(axis=0), 0, atol=4 * error)
    np.testing.assert_allclose(after.mean(axis=0), 3, atol=4 * error)
    for part in (before, after):
        np.testing.assert_allclose(part.std(axis=0), 0.5, rtol=4 / np.sqrt(4000))
        correlation = np.corrcoef(part.T)[0, 1]
        assert correlation == pytest.approx(0.25, abs=4 * (1 - 0.25**2) / np.sqrt(2000))


def test_a_perfect_cue_is_the_later_environment() -> None:
    model = LinearNorms(predictability=1.0)
    for generation in range(5):
        cue, environment = model.environment(SEED, 0, generation)
        assert cue == environment


@pytest.mark.parametrize("condition", ["plastic-norms", "costly-norms", "fixed-norms"])
def test_each_generation_follows_the_exact_recursion_from_the_one_before(condition: str) -> None:
    agents, generations = 20_000, 30
    experiment = assign(
        bl.load(condition),
        [f"population.size={agents}", f"evolution.generations={generations}"],
    )
    model = experiment.model_part
    (history,) = simulate_histories(experiment, SEED, [2])
    # [trait, generation, agent].
    traits = np.stack(
        [history.recorded_values(name).astype(np.float64) for name in ("intercept", "slope")]
    )
    setting = Setting(
        model.optimum_slope, model.peak_width**2, 0, 0, 0, 0, 0, model.plasticity_cost
    )
    stds = np.array([model.intercept_std, model.slope_std])
    segregation = np.diag(stds * experiment.evolution.mutation_size) ** 2
    for generation in range(generations - 1):
        environment = model.environment(SEED, 2, generation)
        parents, children = (traits[:, index] for index in (generation, generation + 1))
        predicted = breed_normal(
            Normal(parents.mean(axis=1), np.cov(parents)),
            segregation,
            model.plasticity * environment.cue,
            model.optimum_slope * environment.selection,
            setting,
        )
        # Errors in standard deviations; both parents and noise are random samples.
        error = (children.mean(axis=1) - predicted.mean) / stds
        assert (np.abs(error) < 5 / np.sqrt(agents)).all()
        covariance_error = (np.cov(children) - predicted.covariance) / np.outer(stds, stds)
        assert (np.abs(covariance_error) < 7 / np.sqrt(agents)).all()


def test_fitness_is_finite_for_large_mismatches() -> None:
    genomes = np.full((1, 3, 1, 2), 1e6, np.float32)
    assert (LinearNorms().simulate(SEED, [0], 1, genomes).energy > 0).all()
