"""Reaction norms and numbers that follow an optimum agree with quantitative genetics."""

from __future__ import annotations

import math
from math import exp
from typing import Any

import numpy as np
import pytest

import baldwinlab as bl
from baldwinlab.analysis.theory.moving_optimum import (
    selection_variance,
    steady_mismatch,
    variance_of_mutations,
    variance_of_segregation,
)
from baldwinlab.evolution import GenerationKey
from baldwinlab.experiment import assign
from baldwinlab.models.quantitative_traits import LinearNorms, MovingOptimum
from baldwinlab.simulation.simulate import simulate_histories
from tests.evolution.single_runs import breed, draw_genomes
from tests.models.runs import measure_runs
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


REGIMES: dict[str, list[str]] = {
    "fixed": ["evolution.variation=infinitesimal", "evolution.mutation_size=0.3"],
    "each birth": ["evolution.mutation_size=0.1"],
}


def make_experiment(*changes: str, regime: str = "each birth") -> Any:
    return assign(bl.load("moving-optimum"), [*REGIMES[regime], *changes])


def measure(experiment: Any, seed: int, n_runs: int = 1) -> dict[str, float]:
    """Return the measures of an experiment, as means over runs."""
    measures = measure_runs(experiment, seed, n_runs)
    return {name: float(np.mean(values)) for name, values in measures.items()}


@pytest.mark.parametrize("share", [0.0, 0.3, 1.0])
def test_a_lifetime_agrees_with_plain_python(share: float) -> None:
    model = MovingOptimum(speed=0.5, jump=2, width=1.5, learned_share=share, cost=0.4)
    genomes = np.random.default_rng(1).normal(8, 3, (2, 50, 1, 1)).astype(np.float32)
    results = model.simulate(0, [3, 4], 10, genomes)
    assert results.learned is not None
    for run in range(2):
        for agent in range(50):
            x = float(genomes[run, agent, 0, 0])
            distance = 2 + 0.5 * 10 - x
            remaining = distance - share * distance
            cost = 0.4 * (share * distance) ** 2
            fitness = exp(-(remaining**2 + cost) / (2 * 1.5**2))
            energy = results.energy[run, agent]
            assert energy == pytest.approx(exp(-(remaining**2) / (2 * 1.5**2)), rel=1e-12)
            assert energy - results.cost[run, agent] == pytest.approx(fitness, abs=1e-15)
            values = {name: record[run, agent] for name, record in results.records.items()}
            assert values["innate_x"] == x
            assert values["mismatch_at_birth"] == np.float32(distance)
            assert values["mismatch_at_death"] == pytest.approx(remaining, abs=1e-6)
            assert values["learned_distance"] == pytest.approx(share * abs(distance), abs=1e-6)
            assert results.learned[run, agent, 0] == pytest.approx(x + share * distance, abs=1e-5)


def test_without_a_cost_of_learning_the_cost_is_exactly_0() -> None:
    genomes = np.random.default_rng(1).normal(0, 9, (1, 500, 1, 1)).astype(np.float32)
    assert (MovingOptimum(jump=3).simulate(0, [0], 7, genomes).cost == 0).all()


def test_an_agent_that_learns_no_share_does_not_learn() -> None:
    model = MovingOptimum(cost=1.0, learned_share=0.7)
    genomes = np.random.default_rng(1).normal(0, 1, (1, 50, 1, 1)).astype(np.float32)
    controls = (model.without_learning(), MovingOptimum(cost=1.0, learned_share=0))
    off, without_share = (control.simulate(0, [0], 5, genomes) for control in controls)
    assert (off.energy == without_share.energy).all()
    assert not controls[1].learns


@pytest.mark.parametrize("regime", REGIMES)
@pytest.mark.parametrize("share", [0.0, 0.5])
def test_the_change_of_a_normal_population_matches_theory(regime: str, share: float) -> None:
    agents, std = 40_000, 0.8
    experiment = make_experiment(
        f"population.size={agents}",
        "moving_optimum.jump=1",
        "moving_optimum.cost=0.3",
        f"moving_optimum.learned_share={share}",
        f"moving_optimum.initial_std={std}",
        regime=regime,
    )
    model = experiment.model_part
    genomes = draw_genomes(experiment, GenerationKey(1, 0, 0))
    results = model.simulate(1, [0], 0, genomes[None])
    fitness = (results.energy - results.cost)[0]
    children, _ = breed(experiment, genomes, fitness, GenerationKey(1, 0, 1))
    width_squared = selection_variance(model.width, share, model.cost)
    # The share of the distance of 1 that selection removes.
    mean = std**2 / (std**2 + width_squared)
    selected = std**2 * width_squared / (std**2 + width_squared)
    variance = selected / 2 + 0.3**2 if regime == "fixed" else selected + 0.1**2
    error = np.sqrt(2 * variance / agents)
    assert abs(children.mean(dtype=np.float64) - mean) < 4 * error
    assert abs(children.var(dtype=np.float64) - variance) < 4 * np.sqrt(4 * variance**2 / agents)


@pytest.mark.parametrize("share", [0.0, 0.5])
def test_with_a_fixed_variance_the_mismatch_matches_theory(share: float) -> None:
    """The run begins in the steady state, which it approaches only slowly with learning."""
    variance = variance_of_segregation(0.3**2, selection_variance(2.0, share))
    mismatch = steady_mismatch(0.02, share, 2.0, variance)
    changes = [
        f"moving_optimum.learned_share={share}",
        f"moving_optimum.jump={mismatch / (1 - share)}",
        "evolution.generations=201",
        "population.size=2000",
    ]
    measured = measure(make_experiment(*changes, regime="fixed"), seed=1, n_runs=2)
    assert measured["variance"] == pytest.approx(variance, rel=0.03)
    assert measured["mismatch"] == pytest.approx(mismatch, rel=0.1)
    assert measured["mismatch-at-birth"] == pytest.approx(measured["mismatch"] / (1 - share))


def test_with_mutation_in_each_birth_learning_hardly_changes_the_mismatch() -> None:
    """The variance of a finite population is below that of theory, by up to a tenth here."""
    mismatches = []
    for share in (0.0, 0.5):
        variance = variance_of_mutations(0.1**2, selection_variance(2.0, share))
        expected = steady_mismatch(0.02, share, 2.0, variance)
        changes = [
            f"moving_optimum.learned_share={share}",
            f"moving_optimum.jump={expected / (1 - share)}",
            "evolution.generations=301",
            "population.size=2000",
        ]
        mismatches.append(measure(make_experiment(*changes), seed=1, n_runs=2)["mismatch"])
        assert mismatches[-1] == pytest.approx(expected, rel=0.15)
    assert mismatches[1] == pytest.approx(mismatches[0], rel=0.15)


def test_the_half_time_after_a_jump_matches_theory() -> None:
    variance = variance_of_segregation(0.3**2, selection_variance(2.0, 0.5))
    changes = [
        "moving_optimum.speed=0",
        "moving_optimum.jump=3",
        f"moving_optimum.initial_std={np.sqrt(variance)}",
        "evolution.generations=101",
        "population.size=4000",
    ]
    measured = measure(make_experiment(*changes, regime="fixed"), seed=1, n_runs=2)
    # In each generation, selection multiplies the distance by V_L / (v + V_L).
    expected = np.log(2) / np.log(1 + variance / selection_variance(2.0, 0.5))
    assert measured["half-time"] == pytest.approx(np.ceil(expected), abs=4)


def test_a_run_that_never_halves_its_distance_has_no_half_time() -> None:
    experiment = make_experiment("evolution.generations=3", "moving_optimum.jump=50")
    assert np.isnan(measure(experiment, seed=1)["half-time"])
