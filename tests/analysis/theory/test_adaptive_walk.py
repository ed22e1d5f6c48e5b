"""Adaptive walks against a linear system, a double sum and limits, and the mutation supply."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest

from baldwinlab.analysis.theory.adaptive_walk import compute_fixation_probabilities, mutation_supply
from baldwinlab.models.nk_climbers import NKClimbers, landscape
from tests.oracles.theory.adaptive_walk import compute_step_probabilities, expect_walk_time

Floats = npt.NDArray[np.float64]


def solve_absorbing_chain(right: Floats, left: Floats, target: int) -> float:
    """Solve (I - Q) t = 1, where Q has the probabilities among the positions before `target`."""
    stay = 1 - right[:target] - left[:target]
    stay[0] += left[0]
    transient = np.diag(stay) + np.diag(right[: target - 1], 1) + np.diag(left[1:target], -1)
    return float(np.linalg.solve(np.eye(target) - transient, np.ones(target))[0])


def sum_over_pairs(right: Floats, left: Floats, target: int) -> float:
    """Sum (1 / right_j) prod_{k = j + 1 .. i} left_k / right_k over all j <= i < target."""
    return float(
        sum(
            np.prod(left[j + 1 : i + 1] / right[j + 1 : i + 1]) / right[j]
            for i in range(target)
            for j in range(i + 1)
        )
    )


@pytest.mark.parametrize("target", [1, 2, 7, 15])
def test_the_time_equals_a_linear_system_and_the_double_sum(target: int) -> None:
    generator = np.random.default_rng(target)
    for _ in range(50):
        right, left = generator.uniform(0.05, 0.5, (2, target + 1))
        time = expect_walk_time(right, left, target)
        assert time == pytest.approx(solve_absorbing_chain(right, left, target), rel=1e-9)
        assert time == pytest.approx(sum_over_pairs(right, left, target), rel=1e-12)


def test_a_walk_with_equal_probabilities_takes_the_square_of_the_distance() -> None:
    # With probability p of each move, the time is n (n + 1) / (2 p) from a reflecting start.
    p = np.full(11, 0.05)
    assert expect_walk_time(p, p, 10) == pytest.approx(10 * 11 / (2 * 0.05))
    assert expect_walk_time(p, p, 0) == 0
    # A walk without a way takes infinite time.
    right, left = compute_step_probabilities(np.array([1.0, 0.0, 2.0]), 5)
    assert expect_walk_time(right, left, 2) == np.inf


@pytest.mark.parametrize("members", [1, 2, 10, 40])
def test_the_probability_of_fixation_equals_the_chain_of_moran(members: int) -> None:
    """A linear system over the number of mutants, from birth and death of single members."""
    for mutant, resident in ((1.2, 1.0), (1.0, 1.0), (0.9, 1.0)):
        numbers = np.arange(1, members)
        births = mutant * numbers / (mutant * numbers + resident * (members - numbers))
        up = births * (members - numbers) / members
        down = (1 - births) * numbers / members
        chain = np.diag(up + down) - np.diag(up[:-1], 1) - np.diag(down[1:], -1)
        at_end = np.zeros(members - 1)
        at_end[-1:] = up[-1:]
        expected = np.linalg.solve(chain, at_end)[0] if members > 1 else 1.0
        result = compute_fixation_probabilities(np.array(mutant), np.array(resident), members)
        assert result == pytest.approx(expected, rel=1e-9)


def test_mutants_have_the_limits_of_fixation() -> None:
    fitness = np.array([0.0, 1e-300, 1.0, 1e300])
    result = compute_fixation_probabilities(fitness, np.array(1.0), 10)
    assert result == pytest.approx([0, 0, 0.1, 1], abs=1e-12)


def test_the_logarithm_of_the_time_through_a_deep_valley_grows_with_its_depth() -> None:
    """The slope is the number of members minus 1: moves in both directions are in balance."""
    times = []
    for depth in (2.0, 3.0):
        fitness = np.exp([0.0, -depth / 2, -depth, -depth / 2, 0.5])
        times.append(expect_walk_time(*compute_step_probabilities(fitness, 10), 4))
    assert np.log(times[1] / times[0]) == pytest.approx(9, abs=0.6)


def test_learning_restores_the_mutations_of_one_generation() -> None:
    model = NKClimbers(trials=12)
    peak = int(landscape(7, 0, 16, 0).argmax())
    peak_bits = (peak >> np.arange(16)) & 1
    flips = np.random.default_rng(1).random((20_000, 16)) < 1 / 32
    genomes = (peak_bits ^ flips).astype(np.float32)
    changed = model.simulate(7, [0], 3, genomes[None, :, None]).records["changed"]
    expected = mutation_supply(16, 1 / 32, 12)
    assert abs(changed.mean() - expected) < 4 * changed.std() / np.sqrt(changed.size)
    assert expected < 0.6 * mutation_supply(16, 1 / 32)


def test_the_supply_has_its_limits() -> None:
    assert mutation_supply(16, 1 / 32) == 0.5
    assert mutation_supply(16, 1 / 32, 10_000) == pytest.approx(0.5)
    assert mutation_supply(16, 1 / 32, 0) == mutation_supply(16, 0.0, 30) == 0
    assert mutation_supply(16, 1 / 32, 1) == pytest.approx(1 / 32)
