"""Test the exclusive or under NEAT: hidden nodes are necessary, and networks evolve them."""

from __future__ import annotations

import math
from functools import cache
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import pytest

import baldwinlab as bl
from baldwinlab.evolution import GenerationKey
from baldwinlab.evolution.neat.genome import HEAD_SIZE, SPECIES, STALE
from baldwinlab.experiment import assign
from baldwinlab.models.neat_networks import NeatXor
from baldwinlab.simulation.simulate import simulate_histories
from tests.commands import Command
from tests.evolution.neat.grown import make_network
from tests.models.runs import simulate_runs
from tests.oracles.neat import compute_xor_fitness

SMALL = ["population.size=30", "evolution.generations=5", "neat_xor.max_links=20"]


def make_small_experiment() -> Any:
    return assign(bl.load("neat-xor"), SMALL)


def simulate_graph(graph: npt.NDArray[np.float32], **fields: Any) -> Any:
    return NeatXor(max_links=12, **fields).simulate(0, [0], 0, graph[None, None, None])


@pytest.mark.nightly
def test_no_network_without_hidden_nodes_evolves_the_exclusive_or() -> None:
    experiment = assign(
        bl.load("neat-xor"), ["evolution.neat.add_node_rate=0", "evolution.generations=60"]
    )
    for history in simulate_histories(experiment, 1, range(3)):
        assert history.recorded_values("right").max() == 3
        assert history.recorded_values("hidden").max() == 0


def test_a_network_with_one_hidden_node_can_compute_the_exclusive_or() -> None:
    """The hidden node detects that both inputs are 1 and inhibits the output."""
    both = [(7, 0, 7, 9, 1), (8, 7, 3, -20, 1), (9, 1, 7, 9, 1), (10, 2, 7, -13, 1)]
    results = simulate_graph(
        make_network((4, 0, 3, 9, 1), (5, 1, 3, 9, 1), (6, 2, 3, -4, 1), *both)
    )
    assert results.records["right"].item() == 4
    assert (results.records["hidden"].item(), results.records["enabled"].item()) == (1, 7)
    assert results.energy.item() == pytest.approx(16, abs=1e-3)


def test_an_output_of_one_half_is_never_correct() -> None:
    results = simulate_graph(make_network((4, 0, 3, 0, 1), (5, 1, 3, 0, 1), (6, 2, 3, 0, 1)))
    assert results.records["right"].item() == 0
    assert results.energy.item() == 4


def test_fitness_agrees_with_the_plain_oracle() -> None:
    run = bl.simulate(
        assign(
            make_small_experiment(),
            ["evolution.neat.add_node_rate=0.3", "evolution.generations=20"],
        ),
        seed=3,
    )
    model = NeatXor(max_links=20)
    for genome, energy in zip(run.genome.values[-1], run.energy.values[-1], strict=True):
        assert compute_xor_fitness(model, genome[0].tolist()) == pytest.approx(
            energy, rel=1e-4, abs=1e-4
        )


def test_founders_have_no_hidden_nodes_and_weights_from_the_range() -> None:
    model = NeatXor(founder_weight_range=3.0)
    founders = model.founders(500, GenerationKey(1, 0, 0))
    results = model.simulate(0, [0], 0, founders[None])
    assert (results.records["hidden"] == 0).all() and (results.records["enabled"] == 3).all()
    weights = founders[:, 0, [12, 17, 22]]
    assert (
        weights.min() < -2.9
        and weights.max() > 2.9
        and abs(weights.mean()) < 4 * 3 / math.sqrt(3 * 1500)
    )


def test_a_run_begins_like_a_shorter_run() -> None:
    longer, shorter = (
        bl.simulate(make_small_experiment().replace(evolution={"generations": n}), seed=4)
        for n in (5, 3)
    )
    np.testing.assert_array_equal(shorter.energy, longer.energy[:3])


def test_no_champion_of_a_species_above_five_members_is_lost() -> None:
    run = bl.simulate(
        assign(bl.load("neat-xor"), ["evolution.generations=30", "record.genome_every=1"]), seed=2
    )
    genomes = run.genome.values[:, :, 0]
    energy = run.energy.values
    survived = 0
    for generation in range(29):
        for species, size in zip(
            *np.unique(genomes[generation, :, SPECIES], return_counts=True), strict=True
        ):
            members = np.flatnonzero(genomes[generation, :, SPECIES] == species)
            best = members[energy[generation, members] == energy[generation, members].max()]
            survives = [
                (
                    genomes[generation + 1, :, HEAD_SIZE:]
                    == genomes[generation, champion, HEAD_SIZE:]
                ).all(axis=1)
                for champion in best
            ]
            survived += bool(np.any(survives))
            assert size <= 5 or np.any(survives) or genomes[generation, members[0], STALE] >= 14
    assert survived > 29


class Solved(NamedTuple):
    """First network of a run with four correct answers."""

    generations: int
    evaluations: int
    hidden: int
    enabled: int


@cache
def first_solutions(runs: int, *changes: str) -> list[Solved | None]:
    solutions: list[Solved | None] = []
    experiment = assign(bl.load("neat-xor"), list(changes))
    for history in simulate_histories(experiment, 1, range(runs)):
        right = np.argwhere(history.recorded_values("right") == 4)
        if not right.size:
            solutions.append(None)
            continue
        index = tuple(right[0])
        generation, agent = (int(number) for number in index)
        evaluations = generation * experiment.population.size + agent + 1
        hidden, enabled = (
            int(history.recorded_values(name)[index]) for name in ("hidden", "enabled")
        )
        solutions.append(Solved(generation + 1, evaluations, hidden, enabled))
    return solutions


@pytest.mark.nightly
def test_measures_of_a_run_describe_its_first_solution() -> None:
    runs = simulate_runs(bl.load("neat-xor"), 1, 6).assign_coords(run=np.arange(6))
    unsolved = runs.isel(generation=slice(0, 1))
    measures = {name: measure.of(runs).values for name, measure in NeatXor.measures.items()}
    for run, first in enumerate(first_solutions(6)):
        assert measures["solved"][run] == (first is not None)
        expected = [np.nan] * 4 if first is None else list(first)
        measured = [
            measures[name][run] for name in ("generations", "evaluations", "hidden", "enabled")
        ]
        np.testing.assert_array_equal(measured, expected)
    assert (NeatXor.measures["solved"].of(unsolved) == 0).all(), "founders have no hidden nodes"
    assert NeatXor.measures["evaluations"].of(unsolved).isnull().all()


def test_neat_evolves_networks_that_compute_the_exclusive_or() -> None:
    solutions = [solution for solution in first_solutions(6) if solution]
    assert len(solutions) >= 5
    assert all(solution.hidden >= 1 for solution in solutions)


@pytest.mark.nightly
def test_the_number_of_networks_is_close_to_the_published_one() -> None:
    """Published: 100 of 100 runs, 4,755 networks and 2.35 hidden nodes on average.

    A few runs have no solution in generation 150.
    """
    solutions = first_solutions(60)
    solved = [solution for solution in solutions if solution]
    assert len(solved) >= 0.9 * len(solutions)
    assert 3000 < np.mean([solution.evaluations for solution in solved]) < 7000
    assert 1 <= np.median([solution.hidden for solution in solved]) <= 4


def test_a_study_runs_resumes_and_has_a_report(command: Command) -> None:
    given = ("run", "neat-xor", "--set", *SMALL, "--out", "xor")
    assert command(*given, "--runs", "1").code == 0
    assert command(*given, "--runs", "2").code == 0
    assert command("report", "xor").code == 0
    assert bl.open_study("xor").runs("neat-xor") == [0, 1]
