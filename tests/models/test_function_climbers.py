"""Test function climbers against plain Python, closed forms and an infinite population."""

from __future__ import annotations

from itertools import pairwise, product
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from scipy.stats import chi2

import baldwinlab as bl
from baldwinlab.evolution import GenerationKey
from baldwinlab.experiment import assign
from baldwinlab.models.function_climbers import FunctionClimbers, decode_gray, make_blocks, sine
from tests.evolution.single_runs import apply_inheritance, breed, draw_genomes
from tests.oracles.theory.infinite_population import advance_frequencies

Numbers = npt.NDArray[np.float64]
# Strings as binary numbers, in descending order of fitness (Whitley 1991).
RANKED_STRINGS = [15, 0, 1, 2, 4, 8, 3, 5, 6, 9, 10, 12, 14, 13, 11, 7]
SEARCHES = ("genetic-search", "baldwinian", "lamarckian")
STRINGS = np.array(list(product((0.0, 1.0), repeat=4)), np.float32)


def test_the_deceptive_function_has_the_published_ranks() -> None:
    fitness = FunctionClimbers(learning_steps=0).simulate(0, [0], 0, STRINGS[None, :, None]).energy
    assert np.argsort(-fitness[0]).tolist() == RANKED_STRINGS
    assert sorted(fitness[0] * 30) == pytest.approx(list(range(0, 32, 2)))


def test_learning_removes_the_deception_of_single_bits() -> None:
    """The mean fitness of all strings with a bit is higher with 0 at birth, and with 1 learned."""
    for learning_steps, better_bit in ((0, 0), (1, 1)):
        model = FunctionClimbers(learning_steps=learning_steps)
        fitness = model.simulate(0, [0], 0, STRINGS[None, :, None]).energy[0]
        for locus in range(4):
            means = [fitness[STRINGS[:, locus] == bit].mean() for bit in (0, 1)]
            assert means[better_bit] > means[1 - better_bit]


def climb_in_python(values: Numbers, blocks: list[int], steps: int) -> tuple[list[int], int]:
    """Return the blocks after steepest ascent, and the number of evaluated strings."""
    n_bits = values.size.bit_length() - 1
    n_evaluations = 1
    for _ in range(steps):
        changes = [
            (values[block ^ 1 << bit] - values[block], index, block ^ 1 << bit)
            for index, block in enumerate(blocks)
            for bit in reversed(range(n_bits))
        ]
        n_evaluations += len(changes)
        gain, index, changed_block = max(changes, key=lambda change: change[0])
        if gain <= 0:
            break
        blocks[index] = changed_block
    return blocks, n_evaluations


@pytest.mark.parametrize("steps", [0, 1, 30])
@pytest.mark.parametrize(
    ("function", "encoding"),
    [("deceptive", "gray"), ("rastrigin", "gray"), ("schwefel", "gray"), ("schwefel", "binary")],
)
def test_a_lifetime_agrees_with_plain_python(function: Any, encoding: Any, steps: int) -> None:
    model = FunctionClimbers(
        function=function, variables=3, encoding=encoding, learning_steps=steps
    )
    genomes = np.random.default_rng(1).integers(0, 2, (2, 20, 1, model.n_weights()))
    results = model.simulate(0, [0, 1], 0, genomes.astype(np.float32))
    values = make_blocks(function, encoding).values
    for run, agent in product(range(2), range(20)):
        bits = genomes[run, agent, 0].reshape(3, -1)
        newborn = [int("".join(map(str, block)), 2) for block in bits]
        blocks, n_evaluations = climb_in_python(values, list(newborn), steps)
        died_with = "".join(f"{block:0{model.bits}b}" for block in blocks)
        assert results.energy[run, agent] == pytest.approx(values[blocks].mean(), abs=1e-15)
        assert results.learned is not None
        assert results.learned[run, agent].tolist() == [int(bit) for bit in died_with]
        records = {name: record[run, agent] for name, record in results.records.items()}
        assert records["evaluations"] == n_evaluations
        assert records["innate"] == pytest.approx(values[newborn].mean(), abs=1e-7)
        assert records["changed"] == sum(
            (before ^ after).bit_count() for before, after in zip(newborn, blocks, strict=True)
        )
        assert records["optimum"] == (values[newborn] == 1).all()


def test_the_functions_agree_with_their_formulas() -> None:
    x = (np.arange(1024) - 512) / 100
    rastrigin = x**2 - 10 * np.cos(2 * np.pi * x)
    y = np.arange(1024) - 512.0
    schwefel = -y * np.sin(np.sqrt(np.abs(y)))
    for function, terms in (("rastrigin", rastrigin), ("schwefel", schwefel)):
        values = make_blocks(function, "binary").values
        assert np.abs(values - (terms.max() - terms) / np.ptp(terms)).max() < 1e-12
    # The minima are at 0 and near 420.97.
    assert make_blocks("rastrigin", "binary").values.argmax() == 512
    assert make_blocks("schwefel", "binary").values.argmax() == 512 + 421


def test_gray_codes_of_consecutive_numbers_differ_in_one_bit() -> None:
    numbers = decode_gray(np.arange(1024))
    codes = np.argsort(numbers)
    assert sorted(numbers) == list(range(1024))
    assert {int(first ^ second).bit_count() for first, second in pairwise(codes)} == {1}
    assert (codes == np.arange(1024) ^ (np.arange(1024) >> 1)).all()


def test_the_sine_agrees_with_numpy() -> None:
    angle = np.linspace(-40, 40, 10_001)
    assert np.abs(sine(angle) - np.sin(angle)).max() < 1e-14


def learned_fitness_and_strings(experiment: Any) -> tuple[Numbers, npt.NDArray[np.int64] | None]:
    """Return the fitness of all 16 strings, and the strings that they transmit."""
    results = experiment.model_part.simulate(0, [0], 0, STRINGS[None, :, None])
    assert results.learned is not None
    learned = (results.learned[0] @ (8, 4, 2, 1)).astype(np.int64)
    is_lamarckian = experiment.evolution.lamarckian_share == 1
    return results.energy[0], learned if is_lamarckian else None


@pytest.mark.parametrize("mutation_rate", [0.0, 0.001, 0.01])
def test_in_an_infinite_population_only_baldwinian_search_reaches_the_global_optimum(
    mutation_rate: float,
) -> None:
    for search in SEARCHES:
        fitness, inherited = learned_fitness_and_strings(bl.load(f"{search}/deceptive"))
        frequencies = np.full(16, 1 / 16)
        for _ in range(1000):
            frequencies = advance_frequencies(frequencies, fitness, mutation_rate, inherited)
        expected = "1111" if search == "baldwinian" else "0000"
        assert f"{frequencies.argmax():04b}" == expected
        assert frequencies[15] < 1e-3 or search == "baldwinian"


@pytest.mark.parametrize("mutation_rate", [0.0, 0.02])
@pytest.mark.parametrize("search", SEARCHES)
def test_populations_follow_the_recursion_within_their_sampling_error(
    search: str, mutation_rate: float
) -> None:
    """Given their parents, children are independent draws from the frequencies of the recursion."""
    agents = 20_000
    experiment = assign(
        bl.load(f"{search}/deceptive"),
        [f"population.size={agents}", f"evolution.mutation_rate={mutation_rate}"],
    )
    fitness, inherited = learned_fitness_and_strings(experiment)
    genomes = draw_genomes(experiment, GenerationKey(4, 0, 0))
    frequencies = np.full(16, 1 / 16)
    statistic = degrees = 0.0
    for generation in range(12):
        counts = np.bincount((genomes[:, 0] @ (8, 4, 2, 1)).astype(int), minlength=16)
        expected = agents * frequencies
        is_large = expected >= 5
        statistic += ((counts - expected)[is_large] ** 2 / expected[is_large]).sum()
        degrees += is_large.sum() - 1
        frequencies = advance_frequencies(counts / agents, fitness, mutation_rate, inherited)
        results = experiment.model_part.simulate(4, [0], generation, genomes[None])
        parents = apply_inheritance(experiment, genomes, results.learned[0])
        genomes, _ = breed(experiment, parents, results.energy[0], GenerationKey(4, 0, generation))
    assert 0.001 < chi2.sf(statistic, degrees) < 0.999
