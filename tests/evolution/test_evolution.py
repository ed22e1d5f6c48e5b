"""Selection, crossover and mutation against theory."""

from __future__ import annotations

import re
from functools import cache
from types import SimpleNamespace

import numpy as np
import numpy.typing as npt
import pytest
from scipy.stats import chisquare, kstest, rankdata

from baldwinlab.engine import rng
from baldwinlab.evolution import (
    GenerationKey,
    Genome,
    Parents,
    Uniforms,
    breed,
    draw_genomes,
    select,
)
from baldwinlab.evolution.variation import Crossover, OneGenome
from baldwinlab.experiment import Experiment, ExperimentError
from baldwinlab.papers.presets import load
from baldwinlab.simulation.replay import replay
from baldwinlab.simulation.simulate import simulate
from tests.worlds import make_small_experiment

FITNESS = np.array([3.0, 0.0, 5.0, 1.0, 0.5, 7.5, 2.0, 4.0])
KEY = GenerationKey(seed=11, run=0, generation=1)
SCHEMES = ["roulette", "tournament", "truncation", "rank", "neutral"]


@cache
def experiment_with_selection(scheme: str) -> Experiment:
    return load("evo/A").replace(evolution={"selection": scheme})


def selected(scheme: str, fitness: npt.NDArray[np.float64], uniforms: Uniforms) -> Parents:
    return select(experiment_with_selection(scheme), fitness, uniforms)


def drawn_parents(
    scheme: str, fitness: npt.NDArray[np.float64], rounds: int = 2500
) -> npt.NDArray[np.int32]:
    """Return the parents [round * child, 2] of `rounds` generations bred from one generation."""
    agents = fitness.size
    uniforms = [
        GenerationKey(5, 0, generation).uniforms(rng.SELECTION, (agents, 2))
        for generation in range(1, rounds + 1)
    ]
    return np.concatenate([selected(scheme, fitness, draws) for draws in uniforms])


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
def test_an_agent_becomes_a_parent_with_the_probability_of_the_scheme(scheme: str) -> None:
    expected = selection_probabilities(scheme)
    counts = np.bincount(drawn_parents(scheme, FITNESS).ravel(), minlength=FITNESS.size)
    assert (counts[expected == 0] == 0).all()
    possible = expected > 0
    assert chisquare(counts[possible], expected[possible] * counts.sum()).pvalue > 0.001


@pytest.mark.parametrize("scheme", SCHEMES)
def test_agents_without_energy_are_parents_with_equal_probability(scheme: str) -> None:
    counts = np.bincount(drawn_parents(scheme, np.zeros(6)).ravel(), minlength=6)
    assert chisquare(counts).pvalue > 0.001


@pytest.mark.parametrize("scheme", SCHEMES)
def test_the_two_parents_are_drawn_independently_and_with_replacement(scheme: str) -> None:
    pairs = drawn_parents(scheme, FITNESS)
    joint = np.outer(selection_probabilities(scheme), selection_probabilities(scheme))
    # The record orders the parents by fitness, so the order of the draws is lost.
    joint = np.triu(joint) + np.triu(joint.T, 1)
    unordered = np.sort(pairs, axis=1)
    counts = np.zeros_like(joint)
    np.add.at(counts, (unordered[:, 0], unordered[:, 1]), 1)
    possible = joint > 0
    assert counts[~possible].sum() == 0
    assert chisquare(counts[possible], joint[possible] * counts.sum()).pvalue > 0.001


@pytest.mark.parametrize("scheme", SCHEMES)
def test_the_fitter_parent_comes_first(scheme: str) -> None:
    pairs = drawn_parents(scheme, FITNESS, rounds=200)
    assert (FITNESS[pairs[:, 0]] >= FITNESS[pairs[:, 1]]).all()
    assert (FITNESS[pairs[:, 0]] > FITNESS[pairs[:, 1]]).any()


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("edge", [2.0**-33, 1 - 2.0**-33])
def test_the_extreme_draws_choose_an_agent_that_ate(scheme: str, edge: float) -> None:
    fitness = np.array([0.0, 0.1, 0.3, 0.0])
    parents = selected(scheme, fitness, np.full((4, 2, 4), edge))
    assert parents.min() >= 0
    assert parents.max() < 4
    if scheme in ("roulette", "truncation"):
        assert (fitness[parents] > 0).all()


@pytest.mark.parametrize("agents", [1, 2, 3, 7])
def test_truncation_selects_the_fitter_half_rounded_down_but_at_least_one_agent(
    agents: int,
) -> None:
    fitness = np.arange(agents, dtype=float)
    chosen = set(drawn_parents("truncation", fitness, rounds=100).ravel().tolist())
    assert chosen == set(range(agents - max(1, agents // 2), agents))


@pytest.mark.parametrize("scheme", ["tournament", "truncation", "rank", "neutral"])
def test_schemes_that_use_ranks_accept_negative_fitness(scheme: str) -> None:
    np.testing.assert_array_equal(
        drawn_parents(scheme, FITNESS - 100, rounds=50), drawn_parents(scheme, FITNESS, rounds=50)
    )


@pytest.mark.parametrize(
    ("scheme", "fitness", "message"),
    [
        (
            "roulette",
            [1.0, -2.5],
            "the fitness of agent 1 is -2.5 and must be 0 or more: "
            "choose rank or tournament, or a fitness that is never negative",
        ),
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
        selected(scheme, np.array(fitness), np.full((len(fitness), 2, 4), 0.5))


def test_a_scheme_that_there_is_not_is_refused() -> None:
    with pytest.raises(
        ExperimentError, match=r"evolution\.selection = 'roulete'.*'roulette', 'tournament'"
    ):
        load("evo/A").replace(evolution={"selection": "roulete"})


def cross_over(
    fitter: OneGenome, second_parent: OneGenome, draws: Uniforms, gate: float = 1, **settings: float
) -> OneGenome:
    child = np.empty_like(fitter)
    Crossover.vary(SimpleNamespace(**settings), fitter, second_parent, draws, gate, child)
    return child


def distinct_weights(agents: int, weights: int) -> Genome:
    """Return genomes in which each weight has a different value."""
    genome = np.empty((agents, 2, weights), np.float32)
    genome[...] = np.arange(genome.size).reshape(genome.shape)
    return genome


def test_each_weight_comes_from_either_parent_with_probability_one_half() -> None:
    genome = distinct_weights(8, 60)
    experiment = load("evo+self-taught/A").replace(
        population={"size": 8}, evolution={"mutation_rate": 0}
    )
    children, parents = breed(experiment, genome, FITNESS, KEY)
    first = children == genome[parents[:, 0]]
    second = children == genome[parents[:, 1]]
    assert (first | second).all()
    different = parents[:, 0] != parents[:, 1]
    share = first[different].mean()
    assert abs(share - 0.5) < 4 * 0.5 / np.sqrt(first[different].size)
    assert first[different].any(axis=0).all(), "each weight can come from the fitter parent"
    assert second[different].any(axis=0).all(), "each weight can come from the second parent"
    assert children.dtype == np.float32


def test_a_draw_below_one_half_copies_the_weight_of_the_fitter_parent() -> None:
    second_parent, fitter = distinct_weights(2, 3)
    draws = np.ones((6, 4))
    draws[:, 0] = [0.0, 0.49, 0.5, 0.51, 0.99, 0.2]
    child = cross_over(fitter, second_parent, draws, one_gate=False, rate=0, size=0)
    assert (child == fitter).tolist() == [[True, True, False], [False, False, True]]
    assert (child == second_parent).tolist() == [[False, False, True], [True, True, False]]


@pytest.mark.parametrize(("rate", "size"), [(0.05, 0.05), (0.5, 2.0), (1.0, 0.1)])
def test_a_weight_mutates_with_the_mutation_rate_by_up_to_the_mutation_size(
    rate: float, size: float
) -> None:
    experiment = load("evo+self-taught/A").replace(
        population={"size": 200}, evolution={"mutation_rate": rate, "mutation_size": size}
    )
    changes, _ = breed(experiment, np.zeros((200, 2, 60), np.float32), np.ones(200), KEY)
    mutated = changes != 0
    assert abs(mutated.mean() - rate) <= 4 * np.sqrt(rate * (1 - rate) / mutated.size)
    assert np.abs(changes).max() <= np.float32(size)
    assert kstest(changes[mutated] / size, "uniform", args=(-1, 2)).pvalue > 0.001


def test_a_gate_per_child_opens_for_all_its_weights_or_for_none() -> None:
    experiment = load("evo+self-taught/A", "mutation-per-child").replace(
        population={"size": 2000}, evolution={"mutation_rate": 0.3}
    )
    changes, _ = breed(experiment, np.zeros((2000, 2, 60), np.float32), np.ones(2000), KEY)
    mutated = (changes != 0).reshape(2000, -1)
    share = mutated.mean(axis=1)
    assert set(np.unique(share > 0.5)) == {True, False}
    # A mutation by exactly 0 is possible but rare.
    assert (share[share > 0] > 0.98).all()
    assert abs((share > 0).mean() - 0.3) < 4 * np.sqrt(0.3 * 0.7 / 2000)
    assert kstest(changes[changes != 0] / 0.05, "uniform", args=(-1, 2)).pvalue > 0.001


def test_the_gate_opens_below_the_mutation_rate() -> None:
    parent = np.ones((1, 4), np.float32)
    draws = np.zeros((4, 4))
    draws[:, 1] = [0.0, 0.2499, 0.1, 0.25]
    draws[:, 2] = [0.0, 1.0, 0.5, 0.0]
    assert cross_over(parent, parent, draws, one_gate=False, rate=0.25, size=0.5).tolist() == [
        [0.5, 1.5, 1.0, 1.0]
    ]
    for gate, changed in ((0.2499, [[0.5, 1.5, 1.0, 0.5]]), (0.25, [[1.0, 1.0, 1.0, 1.0]])):
        assert (
            cross_over(parent, parent, draws, gate, one_gate=True, rate=0.25, size=0.5).tolist()
            == changed
        )


def test_initial_weights_are_standard_normal_and_independent_between_modules() -> None:
    experiment = load("evo+self-taught/A").replace(population={"size": 300})
    genome = draw_genomes(experiment, GenerationKey(1, 2, 0))
    assert genome.shape == (300, 2, 60)
    for module in range(2):
        assert kstest(genome[:, module].ravel(), "norm").pvalue > 0.001
        assert kstest(genome[:, module].mean(axis=0) * np.sqrt(300), "norm").pvalue > 0.001
        assert kstest(genome[:, module].mean(axis=1) * np.sqrt(60), "norm").pvalue > 0.001
    assert abs(np.corrcoef(genome[:, 0].ravel(), genome[:, 1].ravel())[0, 1]) < 4 / np.sqrt(
        genome[:, 0].size
    )


def test_biases_are_standard_normal_too() -> None:
    experiment = load("evo/A", "biases").replace(population={"size": 300})
    genome = draw_genomes(experiment, GenerationKey(1, 2, 0))
    assert genome.shape == (300, 1, 73)
    assert kstest(genome[:, 0, 30:40].ravel(), "norm").pvalue > 0.001
    assert kstest(genome[:, 0, 70:].ravel(), "norm").pvalue > 0.001


def test_a_child_inherits_the_weights_of_its_parents_at_birth() -> None:
    experiment = make_small_experiment(
        "evo+self-taught", learning={"rate": 0.5}, evolution={"mutation_rate": 0}
    )
    result = simulate(experiment, seed=2)
    genome = result["genome"].values
    parents = result["parents"].values
    learned = replay(experiment, seed=2, generation=0)["weight_death"].values[:, 0]
    assert (learned != genome[0, :, 0]).mean() > 0.9, "the agents learned"
    for generation in (1, 2):
        pairs = genome[generation - 1][parents[generation]]
        from_first = genome[generation] == pairs[:, 0]
        from_second = genome[generation] == pairs[:, 1]
        assert (from_first | from_second).all()


def test_the_fitter_parent_is_recorded_first() -> None:
    result = simulate(
        make_small_experiment("evo+self-taught", evolution={"generations": 8}), seed=3
    )
    energy = result["energy"].values
    parents = result["parents"].values
    assert (parents[0] == -1).all()
    for generation in range(1, 8):
        fitness = energy[generation - 1][parents[generation]]
        assert (fitness[:, 0] >= fitness[:, 1]).all()
        if energy[generation - 1].any():
            assert (fitness > 0).all(), "roulette selection never draws an agent without energy"


def test_a_generation_is_bred_from_the_genomes_and_energy_of_the_previous_generation() -> None:
    experiment = make_small_experiment(
        "evo+self-taught",
        world={"food": [{"x": [20, 100], "y": [10, 90], "count": 12, "energy": 2.5}]},
    )
    result = simulate(experiment, seed=3, run=4)
    genome = result["genome"].values
    energy = result["energy"].values
    assert (energy == 2.5 * result["food_eaten"].values).all()
    for generation in (1, 2):
        children, parents = breed(
            experiment,
            genome[generation - 1],
            energy[generation - 1],
            GenerationKey(3, 4, generation),
        )
        np.testing.assert_array_equal(children, genome[generation])
        np.testing.assert_array_equal(parents, result["parents"].values[generation])


def test_learning_without_evolution_draws_new_genomes_in_every_generation() -> None:
    result = simulate(
        make_small_experiment("self-taught", population={"size": 50}, lifetime={"steps": 5}), seed=3
    )
    assert (result["parents"] == -1).all()
    genome = result["genome"].values
    for generation in range(3):
        assert kstest(genome[generation].ravel(), "norm").pvalue > 0.001
    assert np.intersect1d(genome[0], genome[1]).size < 3
    assert abs(np.corrcoef(genome[0].ravel(), genome[1].ravel())[0, 1]) < 4 / np.sqrt(
        genome[0].size
    )


def test_genomes_are_stored_every_nth_generation_and_for_the_last_generation() -> None:
    sparse = simulate(
        make_small_experiment(
            "evo", evolution={"generations": 6}, record={"genome_every": 2}, lifetime={"steps": 5}
        ),
        seed=1,
    )
    full = simulate(
        make_small_experiment("evo", evolution={"generations": 6}, lifetime={"steps": 5}), seed=1
    )
    is_stored = ~np.isnan(sparse["genome"].values).all(axis=(1, 2, 3))
    assert is_stored.tolist() == [True, False, True, False, True, True]
    np.testing.assert_array_equal(
        sparse["genome"].values[is_stored], full["genome"].values[is_stored]
    )
