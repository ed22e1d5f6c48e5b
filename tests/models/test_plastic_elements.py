"""Test plastic elements against plain Python, all outcomes of learning, and exact recursions."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import xarray as xr
from scipy import stats

import baldwinlab as bl
from baldwinlab.evolution import GenerationKey
from baldwinlab.experiment import assign
from baldwinlab.models.plastic_elements import PlasticElements
from baldwinlab.parts import LIFE, uniforms
from tests.evolution.single_runs import breed, draw_genomes
from tests.oracles.theory.element_selection import Elements, advance_shares, predict_selection

Genomes = npt.NDArray[np.float32]
TREE = PlasticElements(
    success_probabilities=(0.3, 0.9, 0.5, 0.6),
    weights=(1.0, 0.5, 2.0, 1.5),
    prerequisites=(0, 1, 1, 3),
)
# All strings of four alleles.
STRINGS = np.array(list(product((0.0, 0.5, 1.0), repeat=4)), np.float32)


def set_elements(model: PlasticElements, genome: Any, succeeds: Any) -> list[bool]:
    """Return whether each element of an agent is right at death."""
    right: list[bool] = []
    for allele, success, prerequisite in zip(genome, succeeds, model.prerequisites, strict=True):
        can_learn = model.learning and (prerequisite == 0 or right[prerequisite - 1])
        right.append(bool(allele == 1 or (allele == 0.5 and can_learn and success)))
    return right


def as_elements(model: PlasticElements) -> Elements:
    return Elements(model.success_probabilities, model.weights, model.prerequisites)


def alleles(n_innate: int, n_plastic: int, n_wrong: int) -> Genomes:
    return np.array([1.0] * n_innate + [0.5] * n_plastic + [0.0] * n_wrong, np.float32)


@pytest.mark.parametrize("learning", [True, False])
def test_a_lifetime_agrees_with_plain_python(learning: bool) -> None:
    model = TREE if learning else TREE.without_learning()
    genomes = np.random.default_rng(1).choice(alleles(1, 2, 1), (2, 200, 1, 4))
    results = model.simulate(7, [3, 5], 2, genomes)
    for row, run in enumerate((3, 5)):
        draws = uniforms(7, run, 2, LIFE, (200, 4))[:, :, 0]
        for agent in range(200):
            genome = genomes[row, agent, 0]
            right = set_elements(model, genome, draws[agent] < model.success_probabilities)
            fitness = sum(w for w, is_right in zip(model.weights, right, strict=True) if is_right)
            assert results.energy[row, agent] == pytest.approx(fitness, abs=1e-12)
            records = {name: values[row, agent] for name, values in results.records.items()}
            assert records["right"] == sum(right) / 4
            assert records["innate"] == (genome == 1).mean()
            assert records["plastic"] == (genome == 0.5).mean()
            mask = sum(2**element for element in range(4) if genome[element] == 1)
            assert records["innate_elements"] == mask
            assert results.learned is not None
            learned = [1 if is_right else a for is_right, a in zip(right, genome, strict=True)]
            assert results.learned[row, agent].tolist() == learned


def test_expected_fitness_is_the_mean_over_all_outcomes_of_learning() -> None:
    expected = np.zeros(len(STRINGS))
    for succeeds in product((False, True), repeat=4):
        chances = [
            p if s else 1 - p for p, s in zip(TREE.success_probabilities, succeeds, strict=True)
        ]
        right = np.array([set_elements(TREE, genome, succeeds) for genome in STRINGS])
        expected += np.prod(chances) * (right @ np.array(TREE.weights))
    assert np.allclose(TREE.expected_fitness(STRINGS), expected, rtol=0, atol=1e-12)


def test_mean_fitness_agrees_with_expected_fitness() -> None:
    genomes = np.repeat(STRINGS, 2000, axis=0)[None, :, None]
    energy = TREE.simulate(1, [0], 0, genomes).energy.reshape(len(STRINGS), 2000)
    error = energy.std(axis=1) / np.sqrt(2000)
    assert (abs(energy.mean(axis=1) - TREE.expected_fitness(STRINGS)) <= 4.5 * error + 1e-9).all()


def test_predicted_selection_agrees_with_the_law() -> None:
    generator = np.random.default_rng(4)
    for _ in range(20):
        model = PlasticElements(
            success_probabilities=tuple(generator.random(8).tolist()),
            weights=tuple(generator.exponential(size=8).tolist()),
            prerequisites=tuple(int(generator.integers(0, i + 1)) for i in range(8)),
        )
        law = predict_selection(as_elements(model))
        assert np.allclose(model.predicted_selection(), law, rtol=0, atol=1e-12)


def test_learning_has_no_effect_once_all_elements_are_innate_or_wrong() -> None:
    genomes = np.random.default_rng(2).choice(alleles(1, 0, 1), (1, 50, 1, 4))
    on, off = (model.simulate(0, [0], 0, genomes) for model in (TREE, TREE.without_learning()))
    assert (on.energy == off.energy).all() and on.energy.std() > 0


def measure_differences(name: str, n_agents: int, generations: int) -> npt.NDArray[np.float64]:
    """Return the shares of alleles [allele, element] minus those of an infinite population."""
    changes = [
        "evolution.variation=gene-pool",
        "evolution.mutation_rate=0",
        "evolution.selection=expected-offspring",
        f"population.size={n_agents}",
        "plastic_elements.initial_unset_share=0.6",
    ]
    experiment = assign(bl.load(name), changes)
    model = experiment.model_part
    genome = draw_genomes(experiment, GenerationKey(3, 0, 0))
    shares = count_alleles(genome)
    for generation in range(1, generations + 1):
        energy = model.simulate(3, [0], generation - 1, genome[None]).energy[0]
        genome, _ = breed(experiment, genome, energy, GenerationKey(3, 0, generation))
        shares = advance_shares(shares, as_elements(model))
    return count_alleles(genome) - shares


def count_alleles(genome: Genomes) -> npt.NDArray[np.float64]:
    return np.stack([(genome[:, 0] == allele).mean(axis=0) for allele in (1, 0.5, 0)])


@pytest.mark.parametrize("name", ["dependency", "importance", "difficulty", "chain"])
def test_a_large_gene_pool_follows_the_recursion_of_an_infinite_population(name: str) -> None:
    n_agents = 20_000
    differences = measure_differences(name, n_agents, generations=12)
    # Twelve generations of random sampling, with a standard error of at most 0.5 / sqrt(n) each.
    error = 0.5 * np.sqrt(12 / n_agents)
    assert abs(differences).max() < 4 * error
    no_selection = count_alleles(draw_genomes(bl.load(name), GenerationKey(3, 0, 0)))
    assert no_selection[1].min() == 1


def make_runs(times: list[list[int]], generations: int = 9) -> xr.Dataset:
    """Return runs of three agents whose element i is innate from generation times[run][i] on."""
    masks = [
        [sum(1 << i for i, time in enumerate(run) if g >= time) for g in range(generations)]
        for run in times
    ]
    dims = ("run", "generation", "agent")
    record = (dims, np.repeat(np.array(masks, np.int32)[..., None], 3, axis=-1))
    return xr.Dataset({"innate_elements": record}, {"run": range(len(times))})


def agreement(model: PlasticElements, measure: str, times: list[list[int]]) -> list[float]:
    values: list[float] = model.all_measures()[measure].of(make_runs(times)).values.tolist()
    return values


def test_agreement_with_the_numbers_is_the_tau_of_kendall() -> None:
    generator = np.random.default_rng(5)
    times = [generator.permutation(8).tolist() for _ in range(10)]
    expected = [stats.kendalltau(range(8), run).statistic for run in times]
    assert agreement(PlasticElements(), "order-by-number", times) == pytest.approx(expected)


def test_agreement_counts_only_pairs_with_different_predictions() -> None:
    """Elements 1 and 2 have equal predictions, and element 3 has a smaller one."""
    model = PlasticElements(
        success_probabilities=(0.1, 0.1, 0.9), weights=(1, 1, 1), prerequisites=(0, 0, 0)
    )
    # In the last runs, an element never becomes innate, or two elements become innate together.
    times = [[1, 2, 3], [2, 1, 3], [3, 2, 1], [1, 3, 2], [1, 99, 99], [2, 5, 2]]
    assert agreement(model, "order-by-selection", times) == [1, 1, -1, 0, 0.5, -0.5]


def test_equal_elements_have_no_predicted_order() -> None:
    assert np.isnan(agreement(PlasticElements(), "order-by-selection", [[1] * 8])).all()
