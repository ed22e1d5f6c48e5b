"""Test plastic prisoners against matches in plain Python, and the exact payoffs of strategies."""

from __future__ import annotations

from itertools import product
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
import xarray as xr

import baldwinlab as bl
from baldwinlab.analysis.report.figures.shares import compute_shares
from baldwinlab.experiment import assign
from baldwinlab.models.plastic_prisoners import (
    INITIAL_PAIRS,
    PAIRS,
    STRATEGIES,
    STRATEGY_OF_GENOME,
    PlasticPrisoners,
    compute_payoffs,
)
from baldwinlab.parts import MatrixView
from baldwinlab.studies.assays.results import open_assay
from tests.models.runs import simulate_runs
from tests.oracles.models import evaluate_plastic_prisoners

ROUNDS = 50
NOISE = 1 / 25
# Name of the strategy of each genome.
NAMES = [STRATEGIES[number] for number in STRATEGY_OF_GENOME]
NO_SLIP = [(False, False)]


def bits(genome: int) -> list[float]:
    return [float(genome >> bit & 1) for bit in range(8)]


def list_genomes(strategy: str) -> list[int]:
    return [genome for genome, name in enumerate(NAMES) if name == strategy]


def draw_pairs(count: int) -> npt.NDArray[np.int64]:
    return np.random.default_rng(4).integers(0, 256, (count, 2))


def test_a_genome_has_a_move_and_a_plasticity_bit_for_each_pair_of_moves() -> None:
    assert NAMES[0b0000_0000] == "0000" and NAMES[0b0000_1001] == "1001", (
        "DD is the first entry, CC the last"
    )
    assert {NAMES[0b1001_0000 | moves] for moves in (0b0000, 0b0001, 0b1000, 0b1001)} == {"x00x"}
    assert NAMES[0b1001_0010] == "x10x" and NAMES[0b1111_0101] == "xxxx"
    assert [len(list_genomes("x" * plastic + "0" * (4 - plastic))) for plastic in range(5)] == [
        1,
        2,
        4,
        8,
        16,
    ]


@pytest.mark.parametrize("learning", [True, False])
@pytest.mark.parametrize("first", INITIAL_PAIRS)
def test_without_noise_the_payoff_agrees_with_matches_in_plain_python(
    first: str, learning: bool
) -> None:
    model = PlasticPrisoners(learning=learning)
    payoff = compute_payoffs(ROUNDS, 0.0, learning, first)
    for genome, opponent in draw_pairs(150):
        matches = [
            evaluate_plastic_prisoners(model, bits(genome), bits(opponent), begin, NO_SLIP * ROUNDS)
            for begin in INITIAL_PAIRS[first]
        ]
        assert payoff[genome, opponent] == pytest.approx(np.mean(matches), abs=1e-12)


def test_with_noise_the_payoff_is_the_mean_over_all_combinations_of_slips() -> None:
    model = PlasticPrisoners()
    noise = 0.2
    rounds = 3
    payoff = compute_payoffs(rounds, noise, True, "cooperation")
    slips = list(
        product([(False, False), (False, True), (True, False), (True, True)], repeat=rounds)
    )
    for genome, opponent in draw_pairs(40):
        chances = [
            np.prod([noise if slip else 1 - noise for both in match for slip in both])
            for match in slips
        ]
        matches = [
            evaluate_plastic_prisoners(
                model, bits(genome), bits(opponent), PAIRS.index("CC"), match
            )
            for match in slips
        ]
        assert payoff[genome, opponent] == pytest.approx(np.dot(chances, matches), abs=1e-12)


def test_payoffs_of_pavlov_and_the_outstanding_strategy_have_published_values() -> None:
    """Against a defector, Pavlov (1001) cooperates in every second round, and [x00x] rarely.

    Both have a high payoff against themselves.
    """
    payoff = compute_payoffs(ROUNDS, NOISE, True, "any")
    defector = 0b0000
    pavlov = 0b1001
    against_defection = [payoff[genome, defector] for genome in list_genomes("x00x")]
    assert against_defection == pytest.approx([0.81] * 4, abs=0.01) and payoff[
        pavlov, defector
    ] == pytest.approx(0.64, abs=0.005)
    against_themselves = [payoff[genome, genome] for genome in list_genomes("x00x")]
    assert against_themselves == pytest.approx([2.61, 2.64, 2.64, 2.68], abs=0.005)
    assert payoff[pavlov, pavlov] == pytest.approx(2.80, abs=0.005)
    assert payoff[defector, pavlov] > payoff[pavlov, pavlov], "a defector invades Pavlov"


def find_stable_genomes(payoff: npt.NDArray[np.float64]) -> set[int]:
    """Return genomes whose payoff against themselves exceeds that of all others against them."""
    of_other_genomes = np.where(np.eye(256, dtype=bool), -np.inf, payoff)
    return {*np.flatnonzero(payoff.diagonal() > of_other_genomes.max(axis=0) + 1e-9).tolist()}


@pytest.mark.parametrize("rounds", [ROUNDS, 200])
def test_the_outstanding_strategy_is_evolutionarily_stable_and_the_only_one_that_cooperates(
    rounds: int,
) -> None:
    payoff = compute_payoffs(rounds, NOISE, True, "any")
    stable = find_stable_genomes(payoff)
    assert {NAMES[genome] for genome in stable} == {"0000", "0001", "000x", "x00x"}
    # It is stable for all values of its plastic moves.
    outstanding = {*list_genomes("x00x")}
    assert outstanding <= stable
    assert min(payoff[genome, genome] for genome in outstanding) > 2.6
    assert max(payoff[genome, genome] for genome in stable - outstanding) < 1.3


def test_without_noise_no_strategy_is_strictly_stable() -> None:
    assert find_stable_genomes(compute_payoffs(ROUNDS, 0.0, True, "any")) == set()


def test_fitness_is_the_mean_payoff_against_all_others() -> None:
    model = PlasticPrisoners()
    generator = np.random.default_rng(1)
    population = generator.integers(0, 2, (2, 30, 1, 8)).astype(np.float32)
    results = model.simulate(7, [0, 5], 3, population)
    payoff = compute_payoffs(ROUNDS, NOISE, True, "any")
    for run in range(2):
        numbers = [
            sum(int(bit) << position for position, bit in enumerate(genome))
            for genome in population[run, :, 0]
        ]
        for agent, genome in enumerate(numbers):
            expected = [
                payoff[genome, opponent]
                for number, opponent in enumerate(numbers)
                if number != agent
            ]
            assert results.energy[run, agent] == pytest.approx(np.mean(expected), abs=1e-12)
            assert STRATEGIES[results.records["strategy"][run, agent]] == NAMES[genome]


def strategy_numbers(strategies: list[list[str]]) -> npt.NDArray[np.int8]:
    return np.array(
        [[STRATEGIES.index(name) for name in generation] for generation in strategies], np.int8
    )


def test_measures_agree_with_the_strategies_of_agents() -> None:
    strategies = np.stack(
        [
            strategy_numbers([["0000", "0000", "xxxx"], ["xxxx", "x00x", "x00x"]]),
            strategy_numbers([["xxxx"] * 3, ["0001", "0001", "x00x"]]),
        ]
    )
    energy = np.stack([np.array([[1.0, 1, 1], [2, 2, 5]]), np.array([[4.0, 4, 4], [1, 2, 3]])])
    dims = ("run", "generation", "agent")
    runs = xr.Dataset(
        {"strategy": (dims, strategies), "energy": (dims, energy)}, {"agent": [0, 1, 2]}
    )
    measured = {
        name: measure.of(runs).values.tolist()
        for name, measure in PlasticPrisoners.measures.items()
    }
    assert measured["least-payoff"] == [1, 2] and measured["payoff-500"] == measured[
        "payoff-2000"
    ] == [3, 2]
    assert measured["most-plasticity"] == pytest.approx([200 / 3, 100]) and measured[
        "plasticity-falls"
    ] == [0, 0]
    assert measured["x00x-leads"] == [1, 0] and measured["x00x-ahead"] == [1, -1]
    dead = runs.assign(
        strategy=runs["strategy"].where(runs["agent"] < 1),
        energy=runs["energy"].where(runs["agent"] < 1),
    )
    shares = {
        name: share.of(dead).values.tolist()
        for name, share in PlasticPrisoners().all_shares().items()
    }
    assert shares == {"plasticity": [[0, 1], [1, 0]], "[x00x]": [[0, 0], [0, 0]]}


def test_the_fall_of_plasticity_compares_two_periods() -> None:
    # Of the entries, all are plastic until generation 500, then a half, and at the end a quarter.
    names = ["0000"] * 150 + ["xxxx"] * 351 + ["x00x"] * 1400 + ["000x"] * 100
    strategies = strategy_numbers([[name] for name in names])[None]
    runs = xr.Dataset({"strategy": (("run", "generation", "agent"), strategies)})
    fall = PlasticPrisoners.measures["plasticity-falls"].of(runs).item()
    assert fall == pytest.approx(100 - (50 + 25) / 2)


def test_the_competitor_is_the_most_frequent_strategy_of_most_other_runs() -> None:
    strategies = np.stack(
        [strategy_numbers([[name] * 2]) for name in ("x00x", "0001", "xxxx", "xxxx", "1001")]
    )
    runs = xr.Dataset({"strategy": (("run", "generation", "agent"), strategies)}, {"agent": [0, 1]})
    assert PlasticPrisoners.measures["x00x-ahead"].of(runs).values.tolist() == [1, 0, -1, -1, 0]


def test_a_report_has_the_shares_of_plasticity_and_of_the_outstanding_strategy() -> None:
    experiment = assign(bl.load("meta-pavlov"), ["evolution.generations=3", "population.size=40"])
    study = simulate_runs(experiment, 0, 2).expand_dims(condition=["meta-pavlov"])
    shares = compute_shares(study, {"meta-pavlov": experiment})
    plastic = study["genome"].isel(weight=slice(4, 8)).mean(("agent", "module", "weight"))
    assert list(shares) == ["plasticity", "[x00x]"]
    assert shares["plasticity"].isel(generation=[0, 2]).values == pytest.approx(
        plastic.isel(generation=[0, 2]).values
    )


def test_the_innate_assay_applies_although_genomes_at_death_are_not_recorded(
    tmp_path: Path,
) -> None:
    experiment = assign(bl.load("meta-pavlov"), ["evolution.generations=3", "population.size=40"])
    study = bl.run(experiment, runs=2, out=tmp_path / "study")
    study.assay("innate")
    values = open_assay(tmp_path / "study", "innate", "meta-pavlov")
    payoff = {life: values["energy"].sel(life=life) for life in ("on", "off", "frozen")}
    assert (payoff["on"] != payoff["off"]).any() and payoff["off"].notnull().all()
    assert payoff["frozen"].isnull().all() and values["distance"].isnull().all()


def test_the_view_shows_payoffs_between_the_most_frequent_genomes() -> None:
    genomes = np.zeros((10, 1, 8), np.float32)
    # The strategy x00x with C after DD and CC at birth.
    genomes[:7, 0, [0, 3, 4, 7]] = 1
    model = PlasticPrisoners(noise=0)
    view = PlasticPrisoners.views["payoffs"].make_data(model, None, genomes, 0)
    assert isinstance(view, MatrixView)
    assert view.rows == [
        "x00x born CDDC, 7 of 10 agents",
        "0000 born DDDD, 3 of 10 agents",
    ] and view.columns == [
        "x00x born CDDC",
        "0000 born DDDD",
    ]
    assert view.values[1, 1] == 1, "the payoff between defectors is the punishment"
    both = compute_payoffs(50, 0.0, True, "any")
    assert view.values[0, 1] == both[0b10011001, 0]
