"""Selection, crossover and mutation against theory."""

from __future__ import annotations

import re
from functools import cache

import numpy as np
import numpy.typing as npt
import pytest
from scipy.stats import chisquare, kstest, rankdata

from baldwinlab.engine import rng
from baldwinlab.evolution import (
    GenerationKey,
    Parents,
    Uniforms,
    breed,
    draw_genomes,
    select,
)
from baldwinlab.experiment import Experiment, ExperimentError
from baldwinlab.papers.presets import load
from baldwinlab.simulation.simulate import simulate
from tests.worlds import make_small_experiment

FITNESS = np.array([3.0, 0.0, 5.0, 1.0, 0.5, 7.5, 2.0, 4.0])
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
@pytest.mark.parametrize("edge", [2.0**-33, 1 - 2.0**-33])
def test_the_extreme_draws_choose_an_agent_that_ate(scheme: str, edge: float) -> None:
    fitness = np.array([0.0, 0.1, 0.3, 0.0])
    parents = selected(scheme, fitness, np.full((4, 2, 4), edge))
    assert parents.min() >= 0
    assert parents.max() < 4
    if scheme in ("roulette", "truncation"):
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
        (
            "expected-offspring",
            [1.0, -1.0],
            "the fitness of agent 1 is -1 and must be 0 or more",
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
