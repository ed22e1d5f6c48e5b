"""Test the laws of the needle against limits, plain recursions and earlier measurements."""

from __future__ import annotations

from math import inf
from pathlib import Path

import numpy as np
import pytest
from scipy.special import hyp1f1
from scipy.stats import binom

from baldwinlab.analysis.theory.needle import (
    balance_of_unset,
    expected_fitness,
    mean_share,
    selection_against_unset,
)
from tests.oracles.theory.needle_recursion import recur_share_of_unset, select_parents

DOCS = Path(__file__).parents[3] / "docs"


def play(n_unset: int, trials: int, cost: float, generator: np.random.Generator) -> float:
    """Return the fitness of one lifetime, guess by guess."""
    for trial in range(1, trials + 1):
        if generator.integers(0, 2, n_unset).all():
            return max(1.0, 20 - cost * 19 * trial / trials)
    return 1.0


@pytest.mark.parametrize(("n_unset", "cost"), [(0, 1.0), (2, 0.0), (3, 1.0), (4, 3.0)])
def test_expected_fitness_is_the_mean_of_lifetimes_of_single_guesses(
    n_unset: int, cost: float
) -> None:
    generator = np.random.default_rng(1)
    values = np.array([play(n_unset, 12, cost, generator) for _ in range(6000)])
    error = values.std() / np.sqrt(values.size)
    assert abs(values.mean() - expected_fitness(n_unset, 12, cost)) <= 4 * error + 1e-12


def test_expected_fitness_has_the_closed_form_of_a_geometric_series() -> None:
    for n_unset in range(1, 21):
        chance = 0.5**n_unset
        mean_share_used = (1 - (1 - chance) ** 1000) / (chance * 1000)
        assert expected_fitness(n_unset) == pytest.approx(1 + 19 * (1 - mean_share_used))
    # Selection against the last unset alleles doubles with each.
    coefficients = [selection_against_unset(q) for q in (1, 2, 3, 4)]
    assert coefficients == pytest.approx([0.00095 * 2**k for k in range(4)], rel=0.03)
    # Free trials leave no selection against few unset alleles.
    assert selection_against_unset(2, cost_of_trials=0) == pytest.approx(0, abs=1e-12)


def test_the_errors_of_the_balance_are_those_of_the_page() -> None:
    """The page prints the balance and the recursion with the settings of `le-2018`."""
    page = (DOCS / "explanation" / "laws.md").read_text("utf-8")
    errors = []
    for name, period in (("2", 2), ("10", 10), ("100", 100), ("never", inf)):
        balance, recursion = balance_of_unset(period=period), recur_share_of_unset(period=period)
        errors.append(balance - recursion)
        assert f"| {name} | {balance:.3f} | {recursion:.3f} | {errors[-1]:+.3f} |" in page
    # The balance is too low if the target changes often, and too high if it changes rarely.
    assert errors[0] < 0 < errors[1] < errors[2] < errors[3]


def test_the_recursion_has_the_fitness_of_a_population_of_strings() -> None:
    """The mean of 200,000 strings with independent alleles replaces the sums over the loci."""
    generator = np.random.default_rng(3)
    unset, wrong = np.full(20, 0.15), np.linspace(0.001, 0.02, 20)
    fitness_of_count = np.array([expected_fitness(q) for q in range(21)])
    draws = generator.random((200_000, 20))
    is_unset, is_wrong = draws < unset, draws > 1 - wrong
    fitness = np.where(is_wrong.any(axis=1), 1, fitness_of_count[is_unset.sum(axis=1)])
    expected = [fitness @ alleles / fitness.sum() for alleles in (is_unset, is_wrong)]
    parents = select_parents(unset, wrong, fitness_of_count)
    assert np.allclose(parents, expected, rtol=0, atol=0.003)


def test_the_balance_has_its_limits() -> None:
    never = balance_of_unset()
    assert balance_of_unset(period=1e9) == pytest.approx(never, abs=1e-6)
    shares = [balance_of_unset(period=tau) for tau in (1, 3, 10, 30, 100)]
    assert (np.diff([*shares, never]) < 0).all()
    # Without mutation and change no unset allele remains.
    assert balance_of_unset(mutation_rate=0) == 0
    assert balance_of_unset(mutation_rate=1e-9) < 1e-4
    # The balance is the fixed point of a plain iteration.
    unset = 10.0
    for _ in range(1000):
        fitness, better = expected_fitness(unset), expected_fitness(unset - 1)
        gain = (20 - unset) * 0.01 / 3 + (1 - unset / 20) / 10
        unset += gain - unset * (better / fitness - 1) - unset * 0.01 / 3
    assert unset / 20 == pytest.approx(balance_of_unset(period=10), abs=1e-9)
    # Drift hides the last unset alleles from selection.
    shares = [
        balance_of_unset(mutation_rate=1e-5, population=population)
        for population in (100, 1000, 10_000, 100_000)
    ]
    assert (np.diff(shares) < 0).all()
    assert shares[0] > 3 * shares[-1]
    # The balance of a large population has selection x of 1 minus x.
    share = balance_of_unset(population=10**5, period=2)
    selection = selection_against_unset(20 * share)
    loss = share * (0.01 / 3 + selection * (1 - share))
    assert (1 - share) * (0.01 / 3 + 1 / 40) == pytest.approx(loss, rel=1e-3)
    assert balance_of_unset(period=2) < share < 0.36


@pytest.mark.parametrize("population", [30, 300, 3000])
@pytest.mark.parametrize("selection", [0.0, 1e-3, 0.01])
@pytest.mark.parametrize("rates", [(1e-3, 2e-3), (0.02, 0.005)])
def test_the_mean_share_is_a_ratio_of_functions_of_kummer(
    population: int, selection: float, rates: tuple[float, float]
) -> None:
    a = 2 * population * rates[0]
    b = a + 2 * population * rates[1]
    z = 2 * population * selection
    # M(a, b, -z) = exp(-z) M(b - a, b, z), without terms of opposite signs.
    expected = a / b * hyp1f1(b - a, b + 1, z) / hyp1f1(b - a, b, z)
    assert mean_share(*rates, selection, population) == pytest.approx(expected, rel=1e-8)


def test_the_mean_share_agrees_with_an_exact_matrix_of_wright_and_fisher() -> None:
    """The diffusion is the limit of the matrix, so the rates are small."""
    agents, gain, loss, selection = 200, 2e-3, 3e-3, 0.005
    share = np.arange(agents + 1) / agents
    survivors = share * (1 - selection) / (1 - share * selection)
    chance = survivors * (1 - loss) + (1 - survivors) * gain
    matrix = binom.pmf(np.arange(agents + 1)[None], agents, chance[:, None])
    stationary = np.linalg.matrix_power(matrix, 2**20)[0]
    mean = mean_share(gain, loss, selection, agents)
    assert stationary @ share == pytest.approx(mean, abs=0.003)


def test_invalid_numbers_are_refused() -> None:
    with pytest.raises(ValueError, match="n_unset = -1 must be at least 0"):
        expected_fitness(-1)
    with pytest.raises(ValueError, match="mutation_rate = 0 must be above 0"):
        balance_of_unset(mutation_rate=0, population=100)
