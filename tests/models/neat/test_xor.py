"""The exclusive or under NEAT: what no network without hidden nodes can do, and how long it takes to grow one that can."""

from __future__ import annotations

import math
from functools import cache
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import pytest
import xarray as xr
from scipy.optimize import linprog

import baldwinlab as bl
from baldwinlab.evolution import GenerationKey
from baldwinlab.evolution.neat.genome import HEAD, SPECIES, STALE
from baldwinlab.evolution.neat.operators import Neat, Species
from baldwinlab.experiment import ExperimentError, assign
from baldwinlab.experiment.toml import from_toml, to_toml
from baldwinlab.experiment.unused_settings import idle_settings
from baldwinlab.models.neat.xor import ANSWERS, QUESTIONS, NeatXor
from baldwinlab.simulation.simulate import simulate_histories
from tests.commands import Command
from tests.evolution.neat.grown import network

SMALL = ["population.size=30", "evolution.generations=5", "neat_xor.max_links=20"]


def small() -> Any:
    return assign(bl.load("neat-xor"), SMALL)


def lives(graph: npt.NDArray[np.float32], **fields: Any) -> Any:
    return NeatXor(max_links=12, **fields).simulate(0, [0], 0, graph[None, None, None])


def test_no_network_without_hidden_nodes_can_know_the_exclusive_or() -> None:
    """Its four answers are four linear inequalities in its weights, which contradict each other."""
    signs = np.where(np.array(ANSWERS) == 1, -1.0, 1.0)
    asked = np.array([(*question, 1) for question in QUESTIONS])  # the last is the bias
    found = linprog(
        np.zeros(3), A_ub=signs[:, None] * asked, b_ub=-np.full(4, 1e-6), bounds=(None, None)
    )
    assert found.status == 2, "infeasible"


def test_and_none_ever_does() -> None:
    still = assign(
        bl.load("neat-xor"), ["evolution.neat.add_node_rate=0", "evolution.generations=60"]
    )
    for history in simulate_histories(still, 1, range(3)):
        assert history.recorded_values("right").max() == 3
        assert history.recorded_values("hidden").max() == 0


def test_a_network_with_one_hidden_node_can() -> None:
    """The hidden node says `both`, and takes twice from a sum that says `any`."""
    both = [(7, 0, 7, 9, 1), (8, 7, 3, -20, 1), (9, 1, 7, 9, 1), (10, 2, 7, -13, 1)]
    found = lives(network((4, 0, 3, 9, 1), (5, 1, 3, 9, 1), (6, 2, 3, -4, 1), *both))
    assert found.records["right"].item() == 4
    assert (found.records["hidden"].item(), found.records["enabled"].item()) == (1, 7)
    assert found.energy.item() == pytest.approx(16, abs=1e-3)


def test_who_says_one_half_is_right_never() -> None:
    found = lives(network((4, 0, 3, 0, 1), (5, 1, 3, 0, 1), (6, 2, 3, 0, 1)))
    assert found.records["right"].item() == 0
    assert found.energy.item() == 4


def test_fitness_is_the_plain_oracle_s() -> None:
    run = bl.simulate(
        assign(small(), ["evolution.neat.add_node_rate=0.3", "evolution.generations=20"]), seed=3
    )
    model = NeatXor(max_links=20)
    for genome, energy in zip(run.genome.values[-1], run.energy.values[-1], strict=True):
        assert model.oracle(genome[0].tolist()) == pytest.approx(energy, rel=1e-4, abs=1e-4)


def test_founders_have_no_hidden_nodes_and_weights_from_the_range() -> None:
    model = NeatXor(founder_weight_range=3.0)
    founders = model.founders(500, GenerationKey(1, 0, 0))
    found = model.simulate(0, [0], 0, founders[None])
    assert (found.records["hidden"] == 0).all() and (found.records["enabled"] == 3).all()
    weights = founders[:, 0, [12, 17, 22]]
    assert (
        weights.min() < -2.9
        and weights.max() > 2.9
        and abs(weights.mean()) < 4 * 3 / math.sqrt(3 * 1500)
    )


def test_a_run_has_the_same_bits_alone_and_beside_others_and_begins_like_a_shorter_one() -> None:
    together = [history.dataset() for history in simulate_histories(small(), 4, [0, 1, 2])]
    for run, found in enumerate(together):
        assert found.equals(bl.simulate(small(), seed=4, run=run))
    shorter = bl.simulate(small().replace(evolution={"generations": 3}), seed=4)
    np.testing.assert_array_equal(shorter.energy, together[0].energy[:3])


def test_no_champion_of_a_species_above_five_members_is_lost() -> None:
    run = bl.simulate(
        assign(bl.load("neat-xor"), ["evolution.generations=30", "record.genome_every=1"]), seed=2
    )
    genomes, energy = run.genome.values[:, :, 0], run.energy.values
    kept = 0
    for generation in range(29):
        for species, size in zip(
            *np.unique(genomes[generation, :, SPECIES], return_counts=True), strict=True
        ):
            members = np.flatnonzero(genomes[generation, :, SPECIES] == species)
            best = members[energy[generation, members] == energy[generation, members].max()]
            living = [
                (genomes[generation + 1, :, HEAD:] == genomes[generation, each, HEAD:]).all(axis=1)
                for each in best
            ]
            kept += bool(np.any(living))
            assert size <= 5 or np.any(living) or genomes[generation, members[0], STALE] >= 14
    assert kept > 29


class Solved(NamedTuple):
    """The first network of a run that is right four times."""

    generations: int
    evaluations: int
    hidden: int
    enabled: int


@cache
def first_solutions(runs: int, *changes: str) -> list[Solved | None]:
    found: list[Solved | None] = []
    experiment = assign(bl.load("neat-xor"), list(changes))
    for history in simulate_histories(experiment, 1, range(runs)):
        right = np.argwhere(history.recorded_values("right") == 4)
        if not right.size:
            found.append(None)
            continue
        at = tuple(right[0])
        generation, agent = (int(each) for each in at)
        evaluations = generation * experiment.population.size + agent + 1
        hidden, enabled = (int(history.recorded_values(name)[at]) for name in ("hidden", "enabled"))
        found.append(Solved(generation + 1, evaluations, hidden, enabled))
    return found


def test_what_is_measured_of_a_run_is_its_first_solution() -> None:
    runs = xr.concat(
        [history.dataset() for history in simulate_histories(bl.load("neat-xor"), 1, range(6))],
        "run",
    )
    runs = runs.assign_coords(run=np.arange(6))
    unsolved = runs.isel(generation=slice(0, 1))
    found = {name: measure.of(runs).values for name, measure in NeatXor.measures.items()}
    for run, first in enumerate(first_solutions(6)):
        assert found["solved"][run] == (first is not None)
        expected = [np.nan] * 4 if first is None else list(first)
        measured = [
            found[name][run] for name in ("generations", "evaluations", "hidden", "enabled")
        ]
        np.testing.assert_array_equal(measured, expected)
    assert (NeatXor.measures["solved"].of(unsolved) == 0).all(), "founders have no hidden nodes"
    assert NeatXor.measures["evaluations"].of(unsolved).isnull().all()


def test_neat_grows_networks_that_know_it() -> None:
    found = [each for each in first_solutions(6) if each]
    assert len(found) >= 5
    assert all(each.hidden >= 1 for each in found)


@pytest.mark.nightly
def test_neat_takes_about_as_many_networks_as_is_published() -> None:
    """Published: 100 runs of 100, 4,755 networks on average, 2.35 hidden nodes. Here a few know nothing by generation 150."""
    found = first_solutions(60)
    solved = [each for each in found if each]
    assert len(solved) >= 0.9 * len(found)
    assert 3000 < np.mean([each.evaluations for each in solved]) < 7000
    assert 1 <= np.median([each.hidden for each in solved]) <= 4


def test_its_fields_are_assigned_shown_and_limited_like_any_others() -> None:
    changed = assign(
        small(),
        ["evolution.neat.compatibility_threshold=4", "evolution.species.stagnation_generations=9"],
    )
    assert from_toml(to_toml(changed), where="there") == changed
    assert not idle_settings(changed)
    with pytest.raises(
        ExperimentError,
        match=r"^neat_xor\.max_links = 2: input should be greater than or equal to 3",
    ):
        assign(small(), ["neat_xor.max_links=2"])


@pytest.mark.parametrize("choice", ["selection=species", "variation=neat"])
def test_genomes_that_are_no_graphs_are_refused(choice: str) -> None:
    with pytest.raises(
        ExperimentError,
        match=r"needs genomes that are graphs: those of network\.kind = 'neat', or",
    ):
        assign(bl.load("evo/A"), [f"evolution.{choice}"])


def test_a_study_of_it_runs_resumes_and_is_reported(command: Command) -> None:
    given = ("run", "neat-xor", "--set", *SMALL, "--out", "xor")
    assert command(*given, "--runs", "1").code == 0
    assert command(*given, "--runs", "2").code == 0
    assert command("report", "xor").code == 0
    assert bl.open_study("xor").runs("neat-xor") == [0, 1]


@pytest.mark.nightly
def test_the_parts_keep_the_whole_contract() -> None:
    found = bl.check_part([NeatXor, Neat, Species])
    assert all(each.holds is not False for each in found), "\n".join(map(str, found))
