"""Test T-mazes against plain Python, exact expected returns and a controller built by hand."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from scipy.stats import mannwhitneyu

import baldwinlab as bl
from baldwinlab.experiment import assign
from baldwinlab.models.t_mazes.model import TMazes
from baldwinlab.models.t_mazes.trips import END, N_INPUTS, N_RULE_GENES, REWARD, TURNING
from baldwinlab.simulation.simulate import simulate_histories
from tests.models.t_mazes.plain import KINDS, PlainLifetime, draw_plastic_genomes


@pytest.mark.parametrize("kind", KINDS)
def test_a_lifetime_agrees_with_plain_python(kind: str) -> None:
    model = TMazes(**{"trips": 12} | KINDS[kind])
    newborns = draw_plastic_genomes(model)
    results = model.simulate(7, [5], 3, newborns)
    assert (newborns == draw_plastic_genomes(model)).all(), "genomes do not change"
    lives = [PlainLifetime(model, genome[0], model.maze(7, 5, 3)) for genome in newborns[0]]
    assert results.energy[0] == pytest.approx([life.total_reward() for life in lives])
    assert len(set(results.energy[0].round(6))) > 2
    assert results.learned is not None
    weights = results.learned[0, :, :-N_RULE_GENES].reshape(len(lives), model.neurons, -1) * 10
    differences = np.abs(weights - [life.weights for life in lives]).max(axis=(1, 2))
    assert np.quantile(differences, 0.9) < 1e-3, (
        "rounding errors grow in some agents, whose weights saturate"
    )


def hand_built_controller() -> tuple[TMazes, npt.NDArray[np.float32]]:
    """Return a network that reverses its direction after a low reward.

    It has a modulatory neuron and the output. With A = 1 and C = -1, a synapse moves toward the
    opposite of its output's activation, unless its input is 1.
    """
    model = TMazes(standard_neurons=0, modulatory_neurons=1)
    weights = np.zeros((model.neurons, N_INPUTS + model.neurons), np.float32)
    modulatory, output = weights
    modulatory[END] = 1
    modulatory[REWARD] = -1
    output[TURNING] = 1
    # Links from the modulatory neuron and from the output itself.
    output[N_INPUTS] = output[N_INPUTS + 1] = 1
    return model, np.concatenate([weights.ravel(), np.array([1, 0, -1, 0, 1], np.float32)])


def test_a_controller_built_by_hand_gains_the_best_expected_return() -> None:
    model, genome = hand_built_controller()
    newborns = np.broadcast_to(genome, (1000, 1, 1, genome.size))
    rewards = model.simulate(0, range(1000), 0, newborns).energy
    assert rewards.mean() == pytest.approx(98.8, abs=4 * 0.4 / np.sqrt(1000)), (
        "100 - 0.4 of the first trip - 0.8 of the move"
    )
    assert set(rewards.ravel().round(6)) == {98.4, 99.2}
    control = model.without_learning().simulate(0, range(1000), 0, newborns).energy
    assert control.mean() == pytest.approx(60, abs=4 * control.std() / np.sqrt(1000)), (
        "without memory"
    )


@pytest.mark.parametrize(("turns", "mean"), [(1, 60.0), (2, 40.0)])
def test_an_agent_that_always_goes_to_one_end_gains_its_share_of_trips(
    turns: Any, mean: float
) -> None:
    model = TMazes(turning_points=turns)
    mazes = np.array([model.maze(0, run, 0) for run in range(4000)])
    trips = np.where(mazes[:, 0] == 0, mazes[:, 1], 0) + np.where(
        mazes[:, 2] == 0, 100 - mazes[:, 1], 0
    )
    rewards = 20 + 0.8 * trips
    assert abs(rewards.mean() - mean) < 4 * rewards.std() / np.sqrt(4000)
    assert (mazes[:, 1].min(), mazes[:, 1].max()) == (35, 65) and (mazes[:, 0] != mazes[:, 2]).all()


def test_without_plasticity_trips_are_equal_unless_activations_last_for_a_lifetime() -> None:
    """The agent has no memory of the last trip, so all trips have the same end, or all crash."""
    for memory, is_alike in (("step", True), ("trip", True), ("life", False)):
        model = TMazes(modulatory_neurons=0, plasticity=False, memory=memory, trips=20)
        results = model.simulate(0, [0], 0, draw_plastic_genomes(model))
        _, moves, _ = model.maze(0, 0, 0)
        possible = {-8.0, moves + 0.2 * (20 - moves), 0.2 * moves + (20 - moves)}
        assert (
            {round(float(reward), 6) for reward in results.energy[0]}
            <= {round(reward, 6) for reward in possible}
        ) is is_alike


# The simulation takes minutes.
@pytest.mark.nightly
def test_plasticity_evolves_beyond_what_is_possible_without_memory() -> None:
    means = {}
    for name in ("modulated-plasticity", "plain-plasticity", "no-plasticity"):
        means[name] = [
            history.energy[-10:].mean()
            for history in simulate_histories(bl.load(f"{name}/single"), 0, range(5))
        ]
    assert np.mean(means["modulated-plasticity"]) > 75 and np.mean(means["plain-plasticity"]) > 75
    fixed = means["no-plasticity"]
    assert np.mean(fixed) <= 60 + 4 * np.std(fixed, ddof=1) / np.sqrt(5)


# The simulation takes a minute.
@pytest.mark.nightly
def test_in_the_double_maze_the_published_order_is_reversed() -> None:
    """In the paper, modulated networks are better. The README of the paper reports this result."""
    modulated, plain = (
        [
            history.energy[-10:].mean()
            for history in simulate_histories(bl.load(f"{name}-plasticity/double"), 0, range(10))
        ]
        for name in ("modulated", "plain")
    )
    assert mannwhitneyu(modulated, plain).pvalue < 0.05 and np.median(modulated) < np.median(plain)


def test_the_double_maze_and_homing_are_maps() -> None:
    assert bl.load("modulated-plasticity/double").model_part.turning_points == 2
    assert bl.load("modulated-plasticity/homing").model_part.homing
    assert assign(bl.load("plain-plasticity/single"), ["t_mazes.trips=10"]).steps == 40
