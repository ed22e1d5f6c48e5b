"""Test foragers with two states, against plain Python and the threshold of the cost of learning."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import baldwinlab as bl
from baldwinlab.analysis.theory.choices import (
    cost_threshold,
    learner_payoff,
    tracker_payoff,
)
from baldwinlab.experiment import assign
from baldwinlab.models.kit import draw_environment
from baldwinlab.models.two_state_forager import TwoStateForager
from baldwinlab.parts import LIFE, uniforms
from tests.models.runs import simulate_runs

GENOTYPES = [(0.0, 0.0), (0.0, 1.0), (1.0, 0.0), (1.0, 1.0)]


def make_genomes(agents: int, genotypes: Any = GENOTYPES) -> npt.NDArray[np.float32]:
    """Return genomes [run, agent, module, allele], which alternate between genotypes."""
    alleles = np.resize(np.array(genotypes, np.float32), (agents, 2))
    return alleles[None, :, None]


def simulate_in_python(
    model: TwoStateForager, genotype: Any, draws: Any, first_state: int
) -> tuple[float, int, int]:
    """Return the payoff, the number of innate errors and the last choice of one life."""
    learns, preference = (int(allele) for allele in genotype)
    state, choice, n_correct, n_errors = first_state, preference, 0, 0
    for step in range(model.life_steps):
        if step > 0 and draws[step] >= model.within_persistence:
            state = 1 - state
        n_correct += choice == state
        n_errors += preference != state
        if learns and model.learning:
            choice = state
    return n_correct / model.life_steps, n_errors, choice


@pytest.mark.parametrize("shared", [False, True])
@pytest.mark.parametrize("learning", [False, True])
def test_a_lifetime_agrees_with_plain_python(shared: bool, learning: bool) -> None:
    model = TwoStateForager(
        between_persistence=0.4,
        within_persistence=0.7,
        life_steps=6,
        learning=learning,
        cost=0.2,
        shared=shared,
    )
    genomes = make_genomes(40)
    results = model.simulate(7, [3], 5, genomes)
    assert results.learned is not None
    draws = uniforms(7, 3, 5, LIFE, (40, 6))[:, :, 0]
    state = 1
    for draw in draw_environment(7, 3, (1, 6))[0, 1:, 0]:
        state = state if draw < 0.4 else 1 - state
    for agent in range(40):
        agent_draws = draws[0 if shared else agent]
        first_state = state if shared else int(agent_draws[0] < 0.4)
        genotype = genomes[0, agent, 0]
        payoff, n_errors, choice = simulate_in_python(model, genotype, agent_draws, first_state)
        learns = bool(genotype[0]) and learning
        assert results.energy[0, agent] == pytest.approx(1 + payoff, abs=1e-12)
        assert results.cost[0, agent] == (0.2 if learns else 0)
        assert results.records["learns"][0, agent] == learns
        assert results.records["innate_match"][0, agent] == (genotype[1] == first_state)
        assert results.records["innate_error"][0, agent] == pytest.approx(n_errors / 6, abs=1e-6)
        assert results.learned[0, agent].tolist() == [genotype[0], choice]


@pytest.mark.parametrize(("between", "within"), [(0.9, 0.95), (0.5, 0.8), (0.7, 1.0)])
def test_mean_payoffs_of_trackers_and_learners_match_theory(between: float, within: float) -> None:
    model = TwoStateForager(between_persistence=between, within_persistence=within, cost=0.1)
    genomes = make_genomes(40_000, [(0, 1), (1, 1)])
    results = model.simulate(1, [0], 2, genomes)
    payoffs = (results.energy - results.cost)[0] - 1
    for first, expected in (
        (0, tracker_payoff(between, within, 10)),
        (1, learner_payoff(between, within, 10, 0.1)),
    ):
        sample = payoffs[first::2]
        assert abs(sample.mean() - expected) < 4 * sample.std() / np.sqrt(sample.size)


def test_shared_states_persist_between_generations_with_their_probability() -> None:
    model = TwoStateForager(between_persistence=0.8, shared=True)
    first = [model.first_state(1, run, 0) for run in range(50)]
    states = np.array([[model.first_state(1, run, g) for g in range(60)] for run in range(50)])
    assert first == [1] * 50
    stays = states[:, 1:] == states[:, :-1]
    assert abs(stays.mean() - 0.8) < 4 * np.sqrt(0.16 / stays.size)
    assert (states[0] != states[1]).any()


def test_all_agents_of_a_generation_meet_shared_states() -> None:
    model = TwoStateForager(within_persistence=0.5, shared=True)
    results = model.simulate(1, [0, 4], 9, np.repeat(make_genomes(40), 2, axis=0))
    for run in range(2):
        for first in range(4):
            assert len(set(results.energy[run, first::4])) == 1
    single = model.simulate(1, [4], 9, make_genomes(40))
    assert (single.energy[0] == results.energy[1]).all()


def evolve_learners(between: float, within: float, excess: float) -> float:
    """Return the last share of learners, at a cost above the threshold by `excess`."""
    cost = cost_threshold(between, within, 10) + excess
    settings = {
        "between_persistence": between,
        "within_persistence": within,
        "cost": cost,
    }
    changes = [f"two_state_forager.{name}={value}" for name, value in settings.items()]
    experiment = assign(bl.load("two-state-forager"), [*changes, "evolution.generations=201"])
    return float(simulate_runs(experiment, 2, 2)["learns"].values[:, -1].mean())


@pytest.mark.parametrize(("between", "within"), [(0.9, 0.95), (0.5, 0.8)])
def test_learning_evolves_below_the_threshold_of_its_cost_and_not_above(
    between: float, within: float
) -> None:
    assert evolve_learners(between, within, -0.03) > 0.8
    assert evolve_learners(between, within, 0.03) < 0.2


def test_only_an_unpredictable_first_state_makes_assimilation_impossible() -> None:
    assert TwoStateForager(between_persistence=0.5).assimilation_obstacle
    assert not TwoStateForager(between_persistence=0.6).assimilation_obstacle
