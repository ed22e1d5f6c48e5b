"""Test NK landscapes against exact theory, and lifetimes against plain Python."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest

import baldwinlab as bl
from baldwinlab.evolution import GenerationKey
from baldwinlab.models.kit import read_bits
from baldwinlab.models.nk_climbers import NKClimbers, landscape
from baldwinlab.parts import LIFE, PathView, uniforms
from tests.evolution.single_runs import draw_genomes

BITS = 12


def neighbor_fitness(heights: npt.NDArray[np.float64], bits: int) -> npt.NDArray[np.float64]:
    """Return the fitness [bit, string] of each string with one bit flipped."""
    strings = np.arange(heights.size)
    return np.array([heights[strings ^ (1 << bit)] for bit in range(bits)])


def count_peaks(k: int, run: int, bits: int = BITS) -> int:
    heights = landscape(3, run, bits, k)
    return int((heights > neighbor_fitness(heights, bits)).all(axis=0).sum())


def test_a_landscape_has_values_from_0_to_1_and_depends_on_the_run() -> None:
    first = landscape(3, 0, BITS, 4)
    second = landscape(3, 1, BITS, 4)
    assert (first.min(), first.max(), first.size) == (0, 1, 2**BITS)
    assert (first != second).any() and (first == landscape(3, 0, BITS, 4)).all()


@pytest.mark.parametrize("run", range(5))
def test_without_epistasis_there_is_one_peak_and_bits_add_up(run: int) -> None:
    heights = landscape(3, run, BITS, 0)
    assert count_peaks(0, run) == 1
    gains = neighbor_fitness(heights, BITS) - heights
    up = [gains[bit][(np.arange(heights.size) >> bit) & 1 == 0] for bit in range(BITS)]
    assert max(np.ptp(values) for values in up) < 1e-12


def test_the_number_of_peaks_with_maximum_epistasis_matches_theory() -> None:
    """The expected number is 2^N / (N + 1) (Kauffman 1993)."""
    numbers = [count_peaks(BITS - 1, run) for run in range(60)]
    expected = 2**BITS / (BITS + 1)
    assert abs(np.mean(numbers) - expected) < 4 * np.std(numbers) / np.sqrt(len(numbers))


@pytest.mark.parametrize(
    ("k", "expected"), [(0, 0.833), (1, 0.778), (2, 0.714), (4, 0.570), (8, 0.2485)]
)
def test_the_correlation_of_neighbors_matches_theory(k: int, expected: float) -> None:
    """Its value in a landscape is 1 - ((K + 1) / N) / (1 - 2^-(K + 1))."""
    correlations = []
    for run in range(30):
        heights = landscape(3, run, BITS, k)
        deviations = heights - heights.mean()
        of_neighbors = neighbor_fitness(heights, BITS) - heights.mean()
        correlations.append((deviations * of_neighbors).mean() / (deviations**2).mean())
    exact = 1 - ((k + 1) / BITS) / (1 - 2.0 ** -(k + 1))
    assert exact == pytest.approx(expected, abs=1e-3)
    assert (
        abs(np.mean(correlations) - exact)
        < 4 * np.std(correlations) / np.sqrt(len(correlations)) + 1e-9
    )


def simulate_in_python(
    model: NKClimbers, newborn: list[int], agent: int
) -> tuple[float, list[int]]:
    """Return the fitness of a string at death, and its bits at death."""
    heights = landscape(7, 0, model.bits, model.k)

    def height(bits: list[int]) -> float:
        return float(heights[sum(bit << position for position, bit in enumerate(bits))])

    string = list(newborn)
    for draw in uniforms(7, 0, 3, LIFE, (agent + 1, model.trials))[agent, :, 0]:
        flipped = list(string)
        flipped[int(draw * model.bits)] ^= 1
        string = flipped if height(flipped) > height(string) else string
    return height(string), string


@pytest.mark.parametrize("correlation", [1.0, 0.5])
def test_a_lifetime_agrees_with_plain_python(correlation: float) -> None:
    model = NKClimbers(bits=8, k=3, trials=6, cost_per_bit=0.02, correlation=correlation)
    newborns = np.random.default_rng(2).integers(0, 2, (1, 40, 1, 8)).astype(np.float32)
    results = model.simulate(7, [0], 3, newborns)
    numbers = read_bits(newborns[0])
    mask, random_bits = model.draw_start(7, 0)
    starts = (numbers & ~mask) | random_bits
    assert results.learned is not None
    for agent in range(40):
        string = [(int(starts[agent]) >> bit) & 1 for bit in range(8)]
        if correlation == 1:
            assert string == newborns[0, agent, 0].tolist()
        height, final_bits = simulate_in_python(model, string, agent)
        changed = sum(before != after for before, after in zip(string, final_bits, strict=True))
        assert (
            results.energy[0, agent] == height and results.learned[0, agent].tolist() == final_bits
        )
        assert (
            results.records["changed"][0, agent] == changed
            and results.cost[0, agent] == 0.02 * changed
        )
    innate = landscape(7, 0, 8, 3)[numbers]
    assert (results.records["innate"][0] == innate.astype(np.float32)).all()
    assert (results.energy > results.records["innate"]).any()


def start_bits(correlation: float) -> npt.NDArray[np.int64]:
    """Return the bits at the start of learning [agent, bit], for 200 random genomes."""
    model = NKClimbers(correlation=correlation)
    genomes = np.random.default_rng(4).integers(0, 2, (200, 1, 16)).astype(np.float32)
    mask, random_bits = model.draw_start(7, 0)
    strings = (read_bits(genomes) & ~mask) | random_bits
    return (strings[:, None] >> np.arange(16)) & 1


def test_learning_begins_with_bits_of_the_genome_at_the_share_of_the_correlation() -> None:
    """Random loci are added as the correlation falls. They have the same bit in all lives."""
    from_genome = start_bits(1.0)
    random_loci = np.zeros(16, bool)
    for correlation, n_random in ((1.0, 0), (0.9, 2), (0.75, 4), (0.25, 12), (0.0, 16)):
        bits = start_bits(correlation)
        differs = (bits != from_genome).any(axis=0)
        assert differs.sum() == n_random and differs[random_loci].all()
        assert (bits[:, differs] == bits[0, differs]).all()
        random_loci = differs


def test_the_correlation_is_the_squared_correlation_of_distances() -> None:
    """Distances between genomes and between the starts of learning, over all pairs of agents."""
    genome, start = (
        (bits[:, None] != bits[None]).sum(axis=-1)[np.triu_indices(200, 1)]
        for bits in (start_bits(1.0), start_bits(0.5))
    )
    assert np.corrcoef(genome, start)[0, 1] ** 2 == pytest.approx(0.5, abs=0.05)


def test_without_correlation_learned_fitness_does_not_depend_on_the_genome() -> None:
    model = NKClimbers(bits=8, k=3, trials=6, correlation=0.0)
    genomes = np.random.default_rng(2).integers(0, 2, (2, 1, 40, 1, 8)).astype(np.float32)
    energies = [model.simulate(7, [0], 3, population).energy for population in genomes]
    assert (energies[0] == energies[1]).all()


def test_agents_without_learning_have_the_fitness_of_the_genome() -> None:
    genomes = np.random.default_rng(2).integers(0, 2, (1, 40, 1, 8)).astype(np.float32)
    control = NKClimbers(bits=8, k=3, trials=6, correlation=0.0).without_learning()
    results = control.simulate(7, [0], 3, genomes)
    assert (results.energy.astype(np.float32) == results.records["innate"]).all()


def test_the_view_of_a_climb_has_each_trial_from_birth_to_death() -> None:
    model = NKClimbers(bits=8, k=3, trials=6)
    newborns = np.random.default_rng(2).integers(0, 2, (1, 40, 1, 8)).astype(np.float32)
    results = model.simulate(7, [0], 3, newborns)
    for agent in range(40):
        view = model.views["climb"].make_data(model, GenerationKey(7, 0, 3), newborns[0], agent)
        assert isinstance(view, PathView)
        line, average, best = view.lines.values()
        assert (line[0], line[-1]) == (
            landscape(7, 0, 8, 3)[read_bits(newborns[0])][agent],
            results.energy[0, agent],
        )
        assert len(line) == 7 and (np.diff(line) >= 0).all() and (best >= line).all()
    assert average[-1] == pytest.approx(results.energy.mean()) and average[0] < average[-1]


def test_all_founders_of_a_run_are_equal() -> None:
    first, second = (
        draw_genomes(bl.load("climbing/rugged"), GenerationKey(0, run, 0)) for run in (0, 1)
    )
    assert (
        (first == first[0]).all()
        and (first[0] != second[0]).any()
        and set(np.unique(first)) <= {0, 1}
    )
    assert (first == draw_genomes(bl.load("not-climbing/smooth"), GenerationKey(0, 0, 0))).all(), (
        "in every condition"
    )
