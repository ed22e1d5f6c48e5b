"""Plastic prisoners: matches against plain Python, move by move, and what is exact of their strategies."""

from __future__ import annotations

from itertools import product
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
import xarray as xr

import baldwinlab as bl
from baldwinlab.analysis.report import content
from baldwinlab.api.checks import check_part
from baldwinlab.evolution import GenerationKey, draw_genomes
from baldwinlab.experiment import ExperimentError, assign
from baldwinlab.models.plastic_prisoners import (
    FIRST,
    PAIRS,
    STRATEGIES,
    STRATEGY,
    PlasticPrisoners,
    payoffs,
)
from baldwinlab.parts import MatrixView
from baldwinlab.simulation.simulate import simulate_histories
from baldwinlab.studies.assays.run import open_assay

ROUNDS, NOISE = 50, 1 / 25
NAMES = [STRATEGIES[number] for number in STRATEGY]  # of each genome
FREE = [(False, False)]  # of slips


def bits(genome: int) -> list[float]:
    return [float(genome >> bit & 1) for bit in range(8)]


def genomes_of(strategy: str) -> list[int]:
    return [genome for genome, name in enumerate(NAMES) if name == strategy]


def pairs_of_genomes(count: int) -> npt.NDArray[np.int64]:
    return np.random.default_rng(4).integers(0, 256, (count, 2))


def test_a_genome_is_a_move_for_each_pair_of_moves_and_whether_it_is_plastic() -> None:
    assert NAMES[0b0000_0000] == "0000" and NAMES[0b0000_1001] == "1001", (
        "DD and CC are the first and the last"
    )
    assert {NAMES[0b1001_0000 | moves] for moves in (0b0000, 0b0001, 0b1000, 0b1001)} == {"x00x"}
    assert NAMES[0b1001_0010] == "x10x" and NAMES[0b1111_0101] == "xxxx"
    assert [len(genomes_of("x" * plastic + "0" * (4 - plastic))) for plastic in range(5)] == [
        1,
        2,
        4,
        8,
        16,
    ]


@pytest.mark.parametrize("learning", [True, False])
@pytest.mark.parametrize("first", FIRST)
def test_without_noise_a_match_is_what_it_is_move_by_move(first: str, learning: bool) -> None:
    model, found = PlasticPrisoners(learning=learning), payoffs(ROUNDS, 0.0, learning, first)
    for own, other in pairs_of_genomes(150):
        matches = [
            model.oracle(bits(own), bits(other), begin, FREE * ROUNDS) for begin in FIRST[first]
        ]
        assert found[own, other] == pytest.approx(np.mean(matches), abs=1e-12)


def test_with_noise_it_is_the_mean_over_all_ways_in_which_moves_can_go_wrong() -> None:
    model, noise, rounds = PlasticPrisoners(), 0.2, 3
    found = payoffs(rounds, noise, True, "cooperation")
    slips = list(
        product([(False, False), (False, True), (True, False), (True, True)], repeat=rounds)
    )
    for own, other in pairs_of_genomes(40):
        chances = [
            np.prod([noise if slip else 1 - noise for both in each for slip in both])
            for each in slips
        ]
        matches = [model.oracle(bits(own), bits(other), PAIRS.index("CC"), each) for each in slips]
        assert found[own, other] == pytest.approx(np.dot(chances, matches), abs=1e-12)


def test_long_matches_that_are_played_come_to_the_expectation() -> None:
    model, found, generator = (
        PlasticPrisoners(),
        payoffs(ROUNDS, NOISE, True, "any"),
        np.random.default_rng(8),
    )
    for own, other in [(genomes_of("x00x")[0], 0), (0b1001, 0b1001), (0b1111_0000, 0b1001_1001)]:
        slips = generator.random((400, ROUNDS, 2)) < NOISE
        begins = generator.integers(0, 4, 400)
        played = [
            model.oracle(bits(own), bits(other), *match)
            for match in zip(begins, slips.tolist(), strict=True)
        ]
        assert abs(np.mean(played) - found[own, other]) < 4 * np.std(played) / np.sqrt(len(played))


def test_payoffs_of_who_never_changes_her_mind_are_in_closed_form() -> None:
    """Moves are then independent: C with the chance n of a slip by who always defects, with 1 - n by who always cooperates."""
    found, chance = payoffs(ROUNDS, NOISE, True, "any"), {0b0000: NOISE, 0b1111: 1 - NOISE}
    for own, other in product(chance, repeat=2):
        c, c_of_other = chance[own], chance[other]
        expected = (1 - c) * (1 - c_of_other) + 5 * (1 - c) * c_of_other + 3 * c * c_of_other
        assert found[own, other] == pytest.approx(expected, abs=1e-12)


def test_a_round_is_worth_two_to_six_to_both_together_and_learning_off_is_having_nothing_plastic() -> (
    None
):
    found, fixed = payoffs(ROUNDS, NOISE, True, "any"), payoffs(ROUNDS, NOISE, False, "any")
    both = found + found.T
    assert both.min() >= 2 and both.max() <= 6
    moves = np.arange(256) & 0b1111
    assert (fixed == fixed[np.ix_(moves, moves)]).all()
    assert (found[:16, :16] == fixed[:16, :16]).all() and (found != fixed).any()


def test_pavlov_and_the_outstanding_strategy_do_as_they_are_known_to() -> None:
    """Against who always defects, Pavlov (1001) cooperates in every other round and [x00x] hardly; both do well by themselves."""
    found, defects, pavlov = payoffs(ROUNDS, NOISE, True, "any"), 0b0000, 0b1001
    against_defection = [found[own, defects] for own in genomes_of("x00x")]
    assert against_defection == pytest.approx([0.81] * 4, abs=0.01) and found[
        pavlov, defects
    ] == pytest.approx(0.64, abs=0.005)
    by_themselves = [found[own, own] for own in genomes_of("x00x")]
    assert by_themselves == pytest.approx([2.61, 2.64, 2.64, 2.68], abs=0.005)
    assert found[pavlov, pavlov] == pytest.approx(2.80, abs=0.005)
    assert found[defects, pavlov] > found[pavlov, pavlov], "so who always defects invades Pavlov"


def stable(noise: float, rounds: int = ROUNDS) -> dict[str, float]:
    """The strategies whose genomes earn more against themselves than any other genome does, and the least that they earn so."""
    found = payoffs(rounds, noise, True, "any")
    others = np.where(np.eye(256, dtype=bool), -np.inf, found)
    genomes = np.flatnonzero(found.diagonal() > others.max(axis=0) + 1e-9)
    return {
        name: min(found[own, own] for own in genomes if NAMES[own] == name)
        for name in {NAMES[own] for own in genomes}
    }


@pytest.mark.parametrize("rounds", [ROUNDS, 200])
def test_the_outstanding_strategy_is_evolutionarily_stable_and_the_only_one_that_cooperates(
    rounds: int,
) -> None:
    found = stable(NOISE, rounds)
    assert set(found) == {"0000", "0001", "000x", "x00x"}
    assert (
        found["x00x"] > 2.6
        and max(payoff for name, payoff in found.items() if name != "x00x") < 1.3
    )
    every = payoffs(rounds, NOISE, True, "any")
    for own in genomes_of("x00x"):
        assert all(every[own, own] > every[other, own] for other in range(256) if other != own), (
            "whatever its plastic moves"
        )


def test_without_noise_nothing_is_strictly_stable() -> None:
    assert stable(0.0) == {}


def test_fitness_is_the_mean_payoff_against_all_others() -> None:
    model, population = (
        PlasticPrisoners(),
        np.random.default_rng(1).integers(0, 2, (2, 30, 1, 8)).astype(np.float32),
    )
    lives = model.simulate(7, [0, 5], 3, population)
    found = payoffs(ROUNDS, NOISE, True, "any")
    for run in range(2):
        numbers = [
            sum(int(bit) << place for place, bit in enumerate(genome))
            for genome in population[run, :, 0]
        ]
        for agent, own in enumerate(numbers):
            others = [found[own, other] for number, other in enumerate(numbers) if number != agent]
            assert lives.energy[run, agent] == pytest.approx(np.mean(others), abs=1e-12)
            assert STRATEGIES[lives.records["strategy"][run, agent]] == NAMES[own]
    alone = model.simulate(7, [5], 3, population[1:])
    assert (alone.energy[0] == lives.energy[1]).all() and (lives.cost == 0).all()


def test_founders_are_bits_of_a_coin() -> None:
    genomes = np.concatenate(
        [draw_genomes(bl.load("meta-pavlov"), GenerationKey(0, run, 0)) for run in range(5)]
    )
    assert set(np.unique(genomes)) == {0, 1} and genomes.shape[1:] == (1, 8)
    assert genomes.mean(axis=0)[0] == pytest.approx([0.5] * 8, abs=4 * 0.5 / np.sqrt(len(genomes)))


def of(strategies: list[list[str]]) -> npt.NDArray[np.int8]:
    return np.array(
        [[STRATEGIES.index(name) for name in generation] for generation in strategies], np.int8
    )


def test_measures_are_those_of_the_agents_that_lived() -> None:
    strategies = np.stack(
        [
            of([["0000", "0000", "xxxx"], ["xxxx", "x00x", "x00x"]]),
            of([["xxxx"] * 3, ["0001", "0001", "x00x"]]),
        ]
    )
    energy = np.stack([np.array([[1.0, 1, 1], [2, 2, 5]]), np.array([[4.0, 4, 4], [1, 2, 3]])])
    dims = ("run", "generation", "agent")
    runs = xr.Dataset(
        {"strategy": (dims, strategies), "energy": (dims, energy)}, {"agent": [0, 1, 2]}
    )
    found = {
        name: measure.of(runs).values.tolist()
        for name, measure in PlasticPrisoners.measures.items()
    }
    assert found["least-payoff"] == [1, 2] and found["payoff-500"] == found["payoff-2000"] == [3, 2]
    assert found["most-plasticity"] == pytest.approx([200 / 3, 100]) and found[
        "plasticity-2000"
    ] == pytest.approx([200 / 3, 100 / 6])
    assert found["x00x-leads"] == [1, 0] and found["x00x-ahead"] == [1, -1]
    dead = runs.assign(
        strategy=runs["strategy"].where(runs["agent"] < 1),
        energy=runs["energy"].where(runs["agent"] < 1),
    )
    shares = {
        name: share.of(dead).values.tolist()
        for name, share in PlasticPrisoners().all_shares().items()
    }
    assert shares == {"plasticity": [[0, 1], [1, 0]], "[x00x]": [[0, 0], [0, 0]]}


def test_the_one_ahead_is_held_against_the_strategy_that_leads_most_other_runs() -> None:
    strategies = np.stack([of([[name] * 2]) for name in ("x00x", "0001", "xxxx", "xxxx", "1001")])
    runs = xr.Dataset({"strategy": (("run", "generation", "agent"), strategies)}, {"agent": [0, 1]})
    assert PlasticPrisoners.measures["x00x-ahead"].of(runs).values.tolist() == [1, 0, -1, -1, 0]


def test_a_report_draws_the_shares_that_follow_from_the_strategies() -> None:
    experiment = assign(bl.load("meta-pavlov"), ["evolution.generations=3", "population.size=40"])
    study = xr.concat(
        [history.dataset() for history in simulate_histories(experiment, 0, range(2))], "run"
    ).expand_dims(condition=["meta-pavlov"])
    shares = content.compute_shares(study, {"meta-pavlov": experiment})
    plastic = study["genome"].isel(weight=slice(4, 8)).mean(("agent", "module", "weight"))
    assert list(shares) == ["plasticity", "[x00x]"]
    assert shares["plasticity"].isel(generation=[0, 2]).values == pytest.approx(
        plastic.isel(generation=[0, 2]).values
    )


def test_a_life_without_learning_is_assayed_though_nobody_has_a_genome_at_death(
    tmp_path: Path,
) -> None:
    experiment = assign(bl.load("meta-pavlov"), ["evolution.generations=3", "population.size=40"])
    study = bl.run(experiment, runs=2, out=tmp_path / "study")
    study.assay("innate")
    found = open_assay(tmp_path / "study", "innate", "meta-pavlov")
    payoff = {life: found["energy"].sel(life=life) for life in ("on", "off", "frozen")}
    assert (payoff["on"] != payoff["off"]).any() and payoff["off"].notnull().all()
    assert payoff["frozen"].isnull().all() and found["distance"].isnull().all()


def test_one_prisoner_alone_is_refused() -> None:
    with pytest.raises(ExperimentError, match=r"population\.size = 1 must be at least 2"):
        assign(bl.load("meta-pavlov"), ["population.size=1"])


def test_the_part_is_as_a_part_should_be() -> None:
    assert [one for one in check_part(PlasticPrisoners) if one.holds is False] == []


def test_the_view_shows_what_the_commonest_genomes_get_from_each_other() -> None:
    genomes = np.zeros((10, 1, 8), np.float32)
    genomes[:7, 0, [0, 3, 4, 7]] = 1  # x00x, born with C after DD and CC
    model = PlasticPrisoners(noise=0)
    seen = PlasticPrisoners.views["payoffs"].of(model, None, genomes, 0)
    assert isinstance(seen, MatrixView)
    assert seen.rows == ["x00x born CDDC, 70.0%", "0000 born DDDD, 30.0%"] and seen.columns == [
        "x00x born CDDC",
        "0000 born DDDD",
    ]
    assert seen.values[1, 1] == 1, "who always defects gets the punishment from herself"
    both = payoffs(50, 0.0, True, "any")
    assert seen.values[0, 1] == both[0b10011001, 0]
