"""Test double pole balancing against plain Python: with velocities, and with Gruau's fitness."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import xarray as xr

import baldwinlab as bl
from baldwinlab.api.checks.evolution import compare_children
from baldwinlab.evolution import GenerationKey
from baldwinlab.evolution.neat.genome import GENE_SIZE, HEAD_SIZE, make_minimal_graphs
from baldwinlab.evolution.neat.operators import Neat
from baldwinlab.experiment import assign
from baldwinlab.models.neat_poles import (
    INITIAL_STATE,
    MIN_BALANCED_STARTS,
    START_STATES,
    NeatPoles,
    UnseenVelocities,
)
from baldwinlab.models.pole_balancing import STATE_SIZE, is_balanced, move
from baldwinlab.simulation.simulate import simulate_histories
from tests.evolution.neat.grown import genes_of, make_network, population
from tests.evolution.single_runs import breed
from tests.models.evolved_poles import STEEPNESS, evolve_balancers
from tests.oracles import neat as oracle
from tests.oracles.parts import use_oracles

NAME = "neat-poles-without-velocities"
POLES = "stanley-miikkulainen-2002:poles-without-velocities"
# Rounded weights of an evolved network: position, both angles and the bias.
WEIGHTS = (-2.0, -5.8, 3.9, 0.7)
Graph = npt.NDArray[np.float32]


def balancing(to_itself: float = -1.2, weights: tuple[float, ...] = WEIGHTS) -> Graph:
    """Return a network of a single output node with a link to itself."""
    graph: Graph = make_minimal_graphs(4, 1, 10, np.array([weights]))[0]
    graph[HEAD_SIZE + 4 * GENE_SIZE : HEAD_SIZE + 5 * GENE_SIZE] = 9, 4, 4, to_itself, 1
    return graph


def simulate_graphs(*graphs: Graph, **fields: Any) -> Any:
    return UnseenVelocities(max_links=10, **fields).simulate(
        0, [0], 0, np.stack(graphs)[None, :, None]
    )


def simulate_in_python(
    graph: Graph, max_steps: int, sensed_entries: tuple[int, ...]
) -> list[float]:
    """Return the unrest after each step that a network balances. Without velocities, it has loops.

    The mechanics are those of `move`, which other tests check.
    """
    scales = (4.8, 2.0, 0.52, 2.0, 0.52, 2.0)
    state = np.array(INITIAL_STATE)
    motion = np.empty((7, STATE_SIZE))
    values = dict[float, float]()
    unrest: list[float] = []
    while len(unrest) < max_steps:
        inputs = [*(state[entry] / scales[entry] for entry in sensed_entries), 1]
        if len(sensed_entries) == STATE_SIZE:
            (output,) = oracle.activate(graph.tolist(), STEEPNESS, inputs)
        else:
            values = oracle.step(graph.tolist(), STEEPNESS, inputs, values)
            output = values.get(4.0, 0.0)
        for _ in range(2):
            move(state, 10 * (2 * output - 1), 0.01, 2e-6, motion)
        if abs(state[0]) > 2.4 or max(abs(state[2]), abs(state[4])) > math.radians(36):
            break
        unrest.append(sum(abs(state[:4])))
    return unrest


def test_the_duration_of_a_lifetime_agrees_with_plain_python() -> None:
    graphs = evolve_balancers("neat-poles")
    steps = NeatPoles(max_steps=40).simulate(0, [0], 0, graphs[None, :, None]).energy[0]
    expected = [len(simulate_in_python(graph, 40, tuple(range(6)))) for graph in graphs]
    # Networks have single precision.
    np.testing.assert_allclose(steps, expected, atol=1)
    assert len(set(expected)) > 3


def simulate_gruau_in_python(graph: Graph) -> tuple[int, float]:
    """Return the number of balanced steps, of 150, and Gruau's fitness."""
    unrest = simulate_in_python(graph, 150, (0, 2, 4))
    steps = len(unrest)
    return steps, 0.1 * steps / 150 + (0.9 * 0.75 / sum(unrest[-100:]) if steps >= 100 else 0.0)


def test_fitness_agrees_with_gruaus_formula_in_plain_python() -> None:
    swinging = (
        balancing(0.0),
        balancing(0.0, (-2.0, -5.0, 3.9, 0.0)),
        balancing(-1.0),
        balancing(),
    )
    results = simulate_graphs(*swinging, max_steps=150)
    for number, graph in enumerate(swinging):
        steps, fitness = simulate_gruau_in_python(graph)
        assert results.records["balanced"][0, number] == steps
        assert results.energy[0, number] == pytest.approx(fitness, rel=1e-3)
    graphs = evolve_balancers(NAME)[:20]
    of_grown = UnseenVelocities(max_steps=150).simulate(0, [0], 0, graphs[None, :, None])
    expected = [simulate_gruau_in_python(graph)[0] for graph in graphs]
    np.testing.assert_allclose(of_grown.records["balanced"][0], expected, atol=1)
    all_steps = [*results.records["balanced"][0], *of_grown.records["balanced"][0]]
    assert min(all_steps) < 100 <= max(all_steps), (
        "unrest affects the fitness of some networks only"
    )


def test_a_cart_with_a_constant_force_leaves_the_track() -> None:
    graph = make_minimal_graphs(STATE_SIZE + 1, 1, 10, np.zeros((1, STATE_SIZE + 1)))
    # The weight of the bias.
    graph[0, HEAD_SIZE + GENE_SIZE * STATE_SIZE + 3] = 5
    results = NeatPoles(max_links=10).simulate(0, [0], 0, graph[None, :, None])
    assert results.energy.item() < 50 and results.records["solves"].item() == 0


def test_founders_have_links_from_all_inputs_and_the_bias_to_the_force() -> None:
    founders = NeatPoles().founders(30, GenerationKey(1, 0, 0))
    results = NeatPoles(max_steps=1).simulate(0, [0], 0, founders[None])
    assert (results.records["enabled"] == STATE_SIZE + 1).all()
    assert (results.records["hidden"] == 0).all()


def test_networks_that_balance_for_twenty_seconds_evolve() -> None:
    short = assign(bl.load("neat-poles"), ["neat_poles.max_steps=1000", "evolution.generations=30"])
    (history,) = simulate_histories(short, 0, [1])
    assert history.recorded_values("solves").any()


def test_five_links_balance_both_poles_for_half_an_hour_but_not_without_the_loop() -> None:
    results = simulate_graphs(balancing(), balancing(0.0))
    assert results.records["balanced"][0].tolist()[0] == 1000 > results.records["balanced"][0, 1]
    assert results.records["proven"][0].tolist() == [100_000, 0]
    assert 250 < results.records["generalises"][0, 0] < 400 and results.records["hidden"][0, 0] == 0


def test_generalization_is_tested_only_for_the_best_network_that_balances() -> None:
    records = simulate_graphs(
        balancing(), balancing(-1.0), balancing(0.0), max_steps=200, endurance_steps=3000
    ).records
    assert (records["proven"] > 0).sum() == 1 and (records["generalises"] > 0).sum() == 1
    short = simulate_graphs(balancing(0.0), max_steps=30, endurance_steps=3000).records
    assert 0 < short["proven"].item() < 3000
    assert short["generalises"].item() == 0


def test_start_states_are_a_grid_of_balanced_states() -> None:
    starts = np.array(START_STATES)
    assert starts.shape == (len({tuple(start) for start in START_STATES}), STATE_SIZE)
    assert len(starts) == 625 and all(is_balanced(start) for start in starts)
    np.testing.assert_allclose(
        starts.max(axis=0),
        [0.9 * 2.16, 0.9 * 1.35, 0.9 * 0.0628319, 0.9 * 0.1500983, 0, 0],
        rtol=1e-6,
    )
    np.testing.assert_allclose(starts, -starts[::-1], atol=1e-15)


def test_a_new_link_can_have_any_target_except_an_input() -> None:
    graph = make_network(
        (4, 0, 3, 1, 1), (5, 1, 3, 1, 1), (6, 2, 3, 1, 1), (7, 0, 7, 1, 1), (8, 7, 3, 1, 1)
    )
    fields = {"add_link_rate": 1.0, "add_node_rate": 0.0, "weight_mutation_rate": 0.0}
    changes = [f"evolution.neat.{name}={value}" for name, value in fields.items()]
    experiment = assign(bl.load(NAME), [*changes, "population.size=300"])
    genome = population(*[graph] * 300)
    children, _ = breed(experiment, genome, np.ones(300), GenerationKey(2, 0, 1))
    new_links = {
        (gene[0], gene[1])
        for child in children[:, 0]
        for number, gene in genes_of(child).items()
        if number > 8
    }
    assert new_links == {(1, 7), (2, 7), (3, 3), (3, 7), (7, 7)}


def test_children_with_loops_agree_with_the_plain_oracle() -> None:
    fast = [
        "evolution.neat.add_node_rate=0.3",
        "evolution.neat.add_link_rate=0.5",
        "neat_poles_without_velocities.max_links=20",
    ]
    group: Any = SimpleNamespace(experiment=assign(bl.load(NAME), fast), seed=3)
    with use_oracles():
        compare_children(group, Neat)


def test_measures_describe_the_first_network_that_generalizes() -> None:
    starts = np.zeros((2, 3, 4), int)
    starts[0, 1, 2] = MIN_BALANCED_STARTS
    starts[0, 2, 0] = 400
    starts[1] = MIN_BALANCED_STARTS - 1
    dims = ("run", "generation", "agent")
    runs = xr.Dataset(
        dict.fromkeys(("generalises", "hidden", "enabled"), (dims, starts)), {"run": [0, 1]}
    )
    measured = {
        name: measure.of(runs).values.tolist()
        for name, measure in UnseenVelocities.measures.items()
    }
    assert measured["solved"] == [1, 0]
    assert (measured["evaluations"][0], measured["generalises"][0]) == (7, MIN_BALANCED_STARTS)
    assert np.isnan(measured["evaluations"][1])


def test_the_control_has_the_numbers_of_the_paper() -> None:
    experiment: Any = bl.load(POLES)
    neat = experiment.evolution.neat
    assert experiment.population.size == 1000
    numbers = (neat.add_link_rate, neat.weight_coefficient, neat.compatibility_threshold)
    assert numbers == (0.3, 3.0, 4.0)


def count_tested_networks(preset: str, record: str, minimum: int, runs: int) -> list[float]:
    """Return the number of networks up to the first solution of each run, infinite without one."""
    counts = []
    experiment = assign(bl.load(preset), ["evolution.generations=40"])
    for history in simulate_histories(experiment, 0, range(runs)):
        solves = (history.recorded_values(record) >= minimum).ravel()
        counts.append(int(solves.argmax()) + 1 if solves.any() else math.inf)
    return counts


# The simulations take minutes.
@pytest.mark.nightly
def test_the_number_of_networks_is_within_a_factor_of_two_of_the_published_one() -> None:
    """Published: 3,578 on average of 120 runs, and 33,184 of 20 runs without velocities.

    The README of the paper reports the 20 runs with velocities. The standard error of their mean
    is 200.
    """
    assert 3578 / 2 < np.mean(count_tested_networks("neat-poles", "solves", 1, 20)) < 3578 * 2
    unseen = count_tested_networks(POLES, "generalises", MIN_BALANCED_STARTS, 10)
    assert 33184 / 2 < np.median(unseen) < 33184 * 2
