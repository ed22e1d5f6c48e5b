"""Lifetimes as arguments of oracles: agents and items in plain Python, by step."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from copy import deepcopy
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from baldwinlab.api.checks.fixture import PartGroup, part_values
from baldwinlab.api.checks.reference import Agent, Item, Naive
from baldwinlab.evolution import GenerationKey, draw_genomes
from baldwinlab.models.miniworld.backends.cpu import CpuBatch
from baldwinlab.models.miniworld.regions import item_kinds, item_regions
from baldwinlab.models.miniworld.state import HEADING_COUNT

MOVED_VARIABLES = ("x", "y", "heading", "action")
"""Variables of an agent that a body changes."""
EARLIER_VARIABLES = ("hidden", "eaten_in_life", "gained_in_life", "rate")
"""Variables of an agent that oracles get with their values before the step."""


class Step(NamedTuple):
    """A step of a lifetime."""

    number: int
    sensing: list[Agent]  # The agents with the positions at which they sensed.
    learning: list[Agent]  # The agents with the positions after the step.
    weights: npt.NDArray[np.float32]  # Weights after the step, [agent, weight].
    items: list[Item]
    # Indices of the agents that no newborn replaced at the end of the step. Only their weights and
    # positions after the step are those of the agents in `sensing`.
    survivors: list[int]


def make_naive(experiment: Any, seed: int = 0) -> Naive:
    """Return the reference functions for an experiment."""
    world = experiment.world
    return Naive(
        sizes=experiment.layer_sizes,
        biases=experiment.network.biases,
        width=world.width,
        height=world.height,
        visual_radius=experiment.senses.visual_radius,
        seed=seed,
        kinds=tuple(item_kinds(experiment)),
    )


def record_steps(group: PartGroup, part: Any) -> Iterator[Step]:
    """Simulate a lifetime and yield its steps for oracles."""
    experiment = group.experiment
    naive = make_naive(experiment)
    batch = CpuBatch(experiment, group.seed, [0])
    genome = draw_genomes(experiment, GenerationKey(group.seed, 0, 0))
    batch.begin(0, genome[None])
    agent_arrays = _initial_arrays(experiment, part, batch.state)
    for number in range(experiment.lifetime.steps):
        teachers = _list_teachers(experiment, naive, batch)
        births = batch.state.birth_count[0].copy()
        before = _take_snapshot(experiment, batch)
        items = _list_items(experiment, batch)
        batch.simulate(number, number + 1)
        after = _take_snapshot(experiment, batch)
        sensing: list[Agent] = []
        learning: list[Agent] = []
        for agent, (teacher, arrays) in enumerate(zip(teachers, agent_arrays, strict=True)):
            fixed = {
                "inputs": after["inputs"][agent],
                "outputs": after["outputs"][agent],
                **{name: before[name][agent] for name in EARLIER_VARIABLES},
                "number": agent,
                "step": number,
                "arrays": arrays,
            }
            action_module = naive.module(before["weights"][agent])
            for agents, snapshot in ((sensing, before), (learning, after)):
                modules = deepcopy((action_module, teacher))
                agents.append(_make_agent(snapshot, agent, fixed, modules))
        survivors = np.flatnonzero(batch.state.birth_count[0] == births).tolist()
        weights = np.array(after["weights"], np.float32)
        yield Step(number, sensing, learning, weights, items, survivors)
        agent_arrays = _initial_arrays(experiment, part, batch.state)
        for agent in survivors:
            agent_arrays[agent] = learning[agent].arrays


def _list_teachers(experiment: Any, naive: Naive, batch: CpuBatch) -> list[Any]:
    """Return the reinforcement module of each agent, or None without such modules."""
    if "reinforcement" not in experiment.modules:
        return [None] * experiment.population.size
    reinforcement = experiment.modules.index("reinforcement")
    return [naive.module(genome[reinforcement]) for genome in batch.state.genome[0]]


def _initial_arrays(experiment: Any, part: Any, state: Any) -> list[dict[str, Any]]:
    """Return the arrays of the part by name, for each agent."""
    values = part_values(experiment, part, state)
    names = [name for name, array in part.arrays.items() if array.owner == "agent"]
    return [
        {name: getattr(values, name)[:, agent].tolist() for name in names}
        for agent in range(experiment.population.size)
    ]


def _make_agent(
    snapshot: Mapping[str, Any], agent_index: int, fixed: Mapping[str, Any], modules: Sequence[Any]
) -> Agent:
    positions = enumerate(zip(snapshot["x"], snapshot["y"], strict=True))
    action_module, reinforcement_module = modules
    return Agent(
        **{name: snapshot[name][agent_index] for name in MOVED_VARIABLES},
        **fixed,
        action_module=action_module,
        reinforcement_module=reinforcement_module,
        other_agents=[Item(x, y, "agent") for agent, (x, y) in positions if agent != agent_index],
    )


def _take_snapshot(experiment: Any, batch: CpuBatch) -> dict[str, Any]:
    """Return the state of a batch of one world as lists, with one entry per agent."""
    state = batch.state
    agents = experiment.population.size
    sizes = experiment.layer_sizes
    # A network without hidden layers has two sizes: inputs and outputs.
    hidden_units = sizes[1] if len(sizes) > 2 else 0
    energies = np.array([region.energy for region in item_regions(experiment)])
    # A newborn has eaten nothing.
    eaten_in_life = state.eaten_in_life - state.eaten_before
    arrays: dict[str, Any] = {
        "x": state.positions[0],
        "y": state.positions[1],
        "heading": state.heading[0] * (360 / HEADING_COUNT),
        "action": state.action[0].astype(int),
        "eaten_in_life": eaten_in_life.sum(axis=0),
        "rate": state.rate[0],
        "inputs": state.activations[: len(experiment.inputs)].T,
        "outputs": state.activations[-len(experiment.actions) :].T,
        "gained_in_life": energies @ eaten_in_life[: len(energies)],
        "hidden": state.activations[sizes[0] : sizes[0] + hidden_units].T,
        "weights": state.weights.T,
    }
    return {name: array[:agents].tolist() for name, array in arrays.items()}


def _list_items(experiment: Any, batch: CpuBatch) -> list[Item]:
    """Return the items of a batch of one world."""
    model = batch.model
    state = batch.state
    names = item_kinds(experiment)
    counts = np.diff(model.region_items)
    kinds = [
        names[kind]
        for kind, count in zip(model.region_kind, counts, strict=True)
        for _ in range(count)
    ]
    world = 0
    items = zip(state.item_x[world].tolist(), state.item_y[world].tolist(), kinds, strict=True)
    return [Item(x, y, kind) for x, y, kind in items]
