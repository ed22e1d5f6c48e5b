"""The parents of all selections: their probabilities, extreme draws, and invalid fitness."""

from __future__ import annotations

import re
from types import SimpleNamespace

import numpy as np
import numpy.typing as npt
import pytest
from scipy.stats import rankdata

from baldwinlab.experiment import ExperimentError, registry
from tests.evolution.draws import FITNESS, draw_generations, require_frequencies, use_selection
from tests.evolution.single_runs import select
from tests.oracles.parts import find_oracle

SCHEMES = ["roulette", "tournament", "truncation", "rank", "neutral"]


def selection_probabilities(scheme: str) -> npt.NDArray[np.float64]:
    """Return the probability that each agent is drawn as a parent. FITNESS has no equal values."""
    agents = FITNESS.size
    rank: npt.NDArray[np.float64] = rankdata(FITNESS)
    if scheme == "tournament":
        # The winner has rank r if both ranks are at most r and not both are below r.
        return (rank**2 - (rank - 1) ** 2) / agents**2
    upper_half = (rank > agents / 2).astype(float)
    shares = {
        "roulette": FITNESS,
        "truncation": upper_half,
        "rank": rank,
        "neutral": np.ones(agents),
    }[scheme]
    return np.asarray(shares / shares.sum())


@pytest.mark.parametrize("scheme", SCHEMES)
def test_agents_without_energy_are_parents_with_equal_probability(scheme: str) -> None:
    parents = draw_generations(use_selection(scheme), np.zeros(6), 2500)
    require_frequencies(np.bincount(parents.ravel(), minlength=6), np.ones(6))


@pytest.mark.parametrize("scheme", SCHEMES)
def test_the_two_parents_are_drawn_independently_and_with_replacement(scheme: str) -> None:
    pairs = draw_generations(use_selection(scheme), FITNESS, 2500).reshape(-1, 2)
    joint = np.outer(selection_probabilities(scheme), selection_probabilities(scheme))
    # The record orders the parents by fitness, so the order of the draws is lost.
    joint = np.triu(joint) + np.triu(joint.T, 1)
    counts = np.zeros_like(joint)
    np.add.at(counts, (pairs.min(axis=1), pairs.max(axis=1)), 1)
    require_frequencies(counts, joint)


# The last value is larger than any draw. It rounds as a draw does if there are many slots.
@pytest.mark.parametrize("edge", [2.0**-33, 1 - 2.0**-33, 1 - 2.0**-53])
@pytest.mark.parametrize("scheme", [*SCHEMES, "expected-offspring"])
def test_the_extreme_draws_choose_an_agent_that_ate(scheme: str, edge: float) -> None:
    fitness = np.array([0.0, 0.1, 0.3, 0.0])
    parents = select(use_selection(scheme), fitness, np.full((4, 2, 4), edge))
    assert parents.min() >= 0
    assert parents.max() < 4
    if scheme in ("roulette", "truncation", "expected-offspring"):
        assert (fitness[parents] > 0).all()


@pytest.mark.parametrize(
    ("scheme", "fitness", "message"),
    [
        (
            "roulette",
            [1.0, -2.5],
            "the fitness of agent 1 is -2.5 and must be 0 or more: "
            "choose rank or tournament, or a fitness that is never negative",
        ),
        ("expected-offspring", [1, -1], "the fitness of agent 1 is -1 and must be 0 or more"),
        ("roulette", [np.nan], "the fitness of agent 0 is nan and must be 0 or more"),
        ("rank", [1.0, np.inf], "the fitness of agent 1 is inf and must be a finite number"),
        ("tournament", [np.nan, 0.0], "the fitness of agent 0 is nan and must be a finite"),
    ],
)
def test_invalid_fitness_raises_an_error_of_one_sentence(
    scheme: str, fitness: list[float], message: str
) -> None:
    expected = f"evolution.selection = '{scheme}': {message}"
    with pytest.raises(ValueError, match=re.escape(expected)):
        select(use_selection(scheme), np.array(fitness, float), np.full((len(fitness), 2, 4), 0.5))


def test_a_scheme_that_there_is_not_is_refused() -> None:
    with pytest.raises(
        ExperimentError, match=r"evolution\.selection = 'roulete'.*'roulette', 'tournament'"
    ):
        use_selection("roulete")


@pytest.mark.parametrize("name", ["best-copies", "expected-offspring", "outcrossing"])
def test_parents_equal_the_oracle_for_any_fitness_and_number_of_agents(name: str) -> None:
    is_ordinal = name == "best-copies"
    experiment = use_selection(name, {"two_parent_share": 0.3} if is_ordinal else None)
    values = SimpleNamespace(parent_share=np.float32(0.2), two_parent_share=np.float32(0.3))
    random = np.random.default_rng(4)
    for agents in (1, 2, 3, 7, 40):
        # A scheme that uses ranks accepts negative fitness.
        fitness = np.round(random.uniform(-3 if is_ordinal else 0, 3, agents))
        uniforms = random.random((agents, 2, 4))
        parents = select(experiment, fitness, uniforms)
        generation = SimpleNamespace(fitness=fitness.tolist(), uniforms=uniforms.tolist())
        expected = find_oracle(registry.find_class("selection", name))(values, generation)
        assert np.sort(parents, axis=1).tolist() == np.sort(expected, axis=1).tolist()
