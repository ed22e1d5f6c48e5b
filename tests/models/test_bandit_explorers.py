"""Test bandit explorers against plain Python, single pulls, and the closed form."""

from __future__ import annotations

from statistics import NormalDist
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import xarray as xr

import baldwinlab as bl
from baldwinlab.analysis.theory.choices import Bandit, compute_payoff
from baldwinlab.experiment import assign
from baldwinlab.models.bandit_explorers import BanditExplorers
from baldwinlab.parts import LIFE, uniforms
from tests.models.runs import simulate_runs

CONDITIONS = ["uncertain", "certain", "noisy", "short-lives", "in-between"]


def as_bandit(model: BanditExplorers) -> Bandit:
    return Bandit(model.lifetime_pulls, model.uncertainty, model.noise)


def make_genomes(pulls: list[float]) -> npt.NDArray[np.float32]:
    """Return genomes [run, agent, module, weight] of one run."""
    return np.array(pulls, np.float32)[None, :, None, None]


def pull_in_plain_python(model: BanditExplorers, n: int, draws: Any) -> tuple[float, bool]:
    """Return the payoff of one bandit, and whether arm 2 is accepted."""
    quantile = NormalDist().inv_cdf
    mean = -1 + model.uncertainty * quantile(draws[0])
    evidence = n * mean + n**0.5 * model.noise * quantile(draws[1])
    if n == 0 or not model.learning:
        return evidence, False
    posterior_weight = 1 / model.uncertainty**2 + n / model.noise**2
    posterior_mean = (-1 / model.uncertainty**2 + evidence / model.noise**2) / posterior_weight
    if posterior_mean <= 0:
        return evidence, False
    n_left = model.lifetime_pulls - n
    return evidence + n_left * mean + n_left**0.5 * model.noise * quantile(draws[2]), True


@pytest.mark.parametrize("learning", [True, False])
def test_a_lifetime_agrees_with_plain_python(learning: bool) -> None:
    model = BanditExplorers(lifetime_pulls=12, bandits=30, learning=learning)
    pulls = [-3.5, 0.0, 0.99, 1.0, 2.7, 6.0, 12.0, 40.0]
    results = model.simulate(5, [2], 4, make_genomes(pulls))
    draws = uniforms(5, 2, 4, LIFE, (len(pulls), 30))
    for agent, gene in enumerate(pulls):
        n = min(12, max(0, int(gene)))
        lifetimes = [pull_in_plain_python(model, n, draws[agent, k]) for k in range(30)]
        payoff = sum(payoff for payoff, _ in lifetimes) / 30
        assert results.energy[0, agent] == pytest.approx(1 + payoff / 12, abs=1e-9)
        records = {name: values[0, agent] for name, values in results.records.items()}
        assert (records["explored"], records["explores"]) == (n, n > 0)
        accepted = sum(is_accepted for _, is_accepted in lifetimes) / 30
        assert records["accepted"] == pytest.approx(accepted, abs=1e-7)


@pytest.mark.parametrize("name", CONDITIONS)
def test_expected_payoffs_agree_with_the_law(name: str) -> None:
    model = bl.load(name).model_part
    law = compute_payoff(np.arange(model.lifetime_pulls + 1), as_bandit(model))
    assert np.allclose(model.expected_payoffs, law, rtol=0, atol=1e-11)


@pytest.mark.parametrize("explored", [1, 6, 20])
def test_mean_fitness_agrees_with_the_closed_form(explored: int) -> None:
    model = BanditExplorers(bandits=500)
    energy = model.simulate(1, [0], 0, make_genomes([explored] * 200)).energy[0]
    expected = 1 + model.expected_payoffs[explored] / model.lifetime_pulls
    assert abs(energy.mean() - expected) < 4 * energy.std() / np.sqrt(200)


def test_single_pulls_have_the_mean_payoff_of_the_closed_form() -> None:
    """The sum of several payoffs is one draw in the model, and a sum of pulls here."""
    model = BanditExplorers(lifetime_pulls=20, uncertainty=2.0, noise=1.5)
    generator = np.random.default_rng(3)
    means = generator.normal(-1, 2.0, 200_000)
    pulls = generator.normal(means[:, None], 1.5, (200_000, 20))
    evidence = pulls[:, :3].sum(axis=1)
    payoffs = evidence + np.where(evidence > 1.5**2 / 2.0**2, pulls[:, 3:].sum(axis=1), 0)
    error = payoffs.std() / np.sqrt(200_000)
    assert abs(payoffs.mean() - model.expected_payoffs[3]) < 4 * error


def make_runs(explored: list[list[int]]) -> xr.Dataset:
    """Return runs with two generations: the last has the given numbers of pulls [run, agent]."""
    last = np.array(explored, np.int32)
    pulls = np.stack([np.zeros_like(last), last], axis=1)
    dims = ("run", "generation", "agent")
    return xr.Dataset({"explored": (dims, pulls), "explores": (dims, (pulls > 0).astype(int))})


def test_measures_compare_the_last_generation_with_the_best_choice() -> None:
    learner = BanditExplorers()
    runs = make_runs([[6, 6, 6], [0, 0, 6], [100, 100, 100]])
    measures = learner.all_measures()
    assert measures["best-choice"].of(runs).values.tolist() == [1, 0, 1]
    best = learner.expected_payoffs.max()
    expected = [0, best / 100 * 2 / 3, (best + 100) / 100]
    assert measures["loss"].of(runs).values.tolist() == pytest.approx(expected, abs=1e-12)
    hard_coded = BanditExplorers(uncertainty=0.5).all_measures()["best-choice"]
    assert hard_coded.of(runs).values.tolist() == [0, 1, 0]


def test_evolution_learns_or_hard_codes() -> None:
    for name, low, high in (("uncertain", 0.9, 1.0), ("certain", 0.0, 0.1)):
        experiment = assign(bl.load(name), ["evolution.generations=21"])
        shares = simulate_runs(experiment, 1, 2)["explores"].values[:, -1].mean(axis=1)
        assert (low <= shares).all() and (shares <= high).all()
