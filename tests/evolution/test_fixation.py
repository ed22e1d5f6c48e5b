"""Neutral species follow the model of Wright and Fisher, whose results are known in closed form."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from scipy import stats

import baldwinlab as bl
from baldwinlab.evolution import GenerationKey
from baldwinlab.evolution.species import list_initial_species
from baldwinlab.parts.lifetimes import make_lifetimes
from tests.evolution.single_runs import make_founders, make_offspring

N_AGENTS = 6
N_INVADERS = 2
N_RUNS = 400
# Generations of the tests that do not wait for a fixation.
N_GENERATIONS = 9
# Probability that a correct program fails a test with these bounds.
ERROR_RATE = 1e-3


def make_experiment(**changes: Any) -> Any:
    species = [
        {"name": "invader", "size": N_INVADERS},
        {"name": "resident", "size": N_AGENTS - N_INVADERS},
    ]
    return bl.load("hinton-nowlan-1987:guessing").replace(
        population={"size": N_AGENTS, "species": species},
        hinton_nowlan={"loci": 2},
        evolution={"compete": "across"} | changes,
    )


@cache
def simulate_shares(selection: str, generations: int) -> npt.NDArray[np.float64]:
    """Return the share of the first species, [run, generation]. Fitness is the number of 1s."""
    experiment = make_experiment(selection=selection)
    shares = np.zeros((N_RUNS, generations))
    for run in range(N_RUNS):
        key = GenerationKey(seed=1, run=run, generation=0)
        genome = make_founders(experiment, key)
        species = list_initial_species(experiment)
        for generation in range(generations):
            shares[run, generation] = (species == 0).mean()
            fitness = 1.0 + (genome == 1).sum(axis=(1, 2))
            child_key = key._replace(generation=generation + 1)
            lifetimes = make_lifetimes(genome, species=species)
            genome, _, species = make_offspring(experiment, child_key, genome, fitness, lifetimes)
    return shares


def require_fixation_probability(shares: npt.NDArray[np.float64], expected: float) -> None:
    """Require that the number of fixations is within the exact binomial bounds."""
    assert np.isin(shares[:, -1], (0, 1)).all()
    n_fixed = int(shares[:, -1].sum())
    low, high = stats.binom.interval(1 - ERROR_RATE, len(shares), expected)
    assert low <= n_fixed <= high


@pytest.mark.nightly
def test_the_fixation_probability_of_neutral_agents_is_their_share() -> None:
    require_fixation_probability(simulate_shares("neutral", 60), N_INVADERS / N_AGENTS)


@pytest.mark.nightly
def test_selection_does_not_change_the_fixation_probability_of_identical_species() -> None:
    require_fixation_probability(simulate_shares("roulette", 60), N_INVADERS / N_AGENTS)


def test_the_diversity_of_neutral_species_decays_by_a_factor_of_1_minus_1_over_n() -> None:
    shares = simulate_shares("neutral", N_GENERATIONS)
    diversity = shares * (1 - shares)
    expected = diversity[0, 0] * (1 - 1 / N_AGENTS) ** np.arange(N_GENERATIONS)
    error = diversity.std(axis=0) / math.sqrt(N_RUNS)
    bound = stats.norm.isf(ERROR_RATE / (2 * N_GENERATIONS))
    assert (np.abs(diversity.mean(axis=0) - expected) <= bound * error + 1e-12).all()


def test_the_number_of_neutral_children_of_a_species_is_binomial() -> None:
    next_counts = np.rint(simulate_shares("neutral", N_GENERATIONS)[:, 1] * N_AGENTS).astype(int)
    observed = np.bincount(next_counts, minlength=N_AGENTS + 1)
    expected = N_RUNS * stats.binom.pmf(np.arange(N_AGENTS + 1), N_AGENTS, N_INVADERS / N_AGENTS)
    assert stats.chisquare(observed, expected).pvalue > ERROR_RATE
