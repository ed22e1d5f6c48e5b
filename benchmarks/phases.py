"""Measure the time of each phase of a step, and compare it with the peak of the machine.

    python benchmarks/phases.py

The peak is that of independent additions and multiplications of sixteen float32 in registers. The
counts of operations are those of the paper's networks (3-10-3, no biases) and of 50 items,
according to the source code. A division counts as one operation.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from baldwinlab.engine.jit import cached_jit, jit_entry_point
from baldwinlab.engine.reference import as_pointer
from baldwinlab.engine.simd import WIDTH, get, put, simd_block
from baldwinlab.evolution import GenerationKey, draw_genomes
from baldwinlab.experiment import Experiment
from baldwinlab.models.miniworld.backends.choice import CPU
from baldwinlab.models.miniworld.backends.cpu import CpuBatch
from baldwinlab.models.miniworld.items import eat_items
from baldwinlab.models.miniworld.lookup import compute_outputs
from baldwinlab.models.miniworld.map import move_agents
from baldwinlab.models.miniworld.senses.perception import (
    list_near_agents,
    mark_agents_near_regions,
    perceive,
)
from baldwinlab.models.miniworld.state_arrays import list_hooks
from baldwinlab.papers.presets import load
from baldwinlab.parts.bodies import choose_action
from baldwinlab.parts.learning_rules import learn

ROUNDS = 2000
REPETITIONS = 9
# Vector operations of a sigmoid, and of 60 weights.
SIGMOID = 22
DENSE = 107
# SIMD blocks of 50 items.
ITEM_BLOCKS = 4


class Phase(NamedTuple):
    """A phase of a step.

    Attributes
    ----------
    name : str
        The name of the phase.
    run : callable
        A Python function that repeats the phase; it is compiled with the parts of the experiment.
    far, near : float
        Vector operations per agent-step far from food, and among food.
    """

    name: str
    run: Callable[[Any, Any, int], None]
    far: float
    near: float


def _sense(model: Any, state: Any, rounds: int) -> None:
    model = as_pointer(model)
    state = as_pointer(state)
    for _ in range(rounds):
        for first in range(0, state.positions.shape[1], WIDTH):
            mark_agents_near_regions(model, state, simd_block(first))
        for world in range(model.worlds):
            for number in range(list_near_agents(model, state, world, 0, model.agents)):
                perceive(
                    model, state, world, get(state.near_agents, 0, world * model.agents + number)
                )


def _think(model: Any, state: Any, rounds: int) -> None:
    model = as_pointer(model)
    state = as_pointer(state)
    for _ in range(rounds):
        for first in range(0, state.positions.shape[1], WIDTH):
            compute_outputs(state.lookup, model, state, simd_block(first))


def _act(model: Any, state: Any, rounds: int) -> None:
    model = as_pointer(model)
    state = as_pointer(state)
    for _ in range(rounds):
        for first in range(0, state.positions.shape[1], WIDTH):
            choose_action(state.body, model, state, simd_block(first))
        for first in range(0, state.positions.shape[1], WIDTH):
            move_agents(state.features, model, state, simd_block(first))


def _learn(model: Any, state: Any, rounds: int) -> None:
    model = as_pointer(model)
    state = as_pointer(state)
    for _ in range(rounds):
        for first in range(0, state.positions.shape[1], WIDTH):
            learn(state.rule, model, state, 0, simd_block(first))


def _eat(model: Any, state: Any, rounds: int) -> None:
    model = as_pointer(model)
    state = as_pointer(state)
    for step in range(rounds):
        for world in range(model.worlds):
            for agent in range(model.agents):
                eat_items(model, state, world, agent, step)


@jit_entry_point
def _peak(rows: Any, rounds: int) -> None:
    a = get(rows, 0, simd_block(0))
    b = get(rows, 1, simd_block(0))
    c = get(rows, 2, simd_block(0))
    d = get(rows, 3, simd_block(0))
    e = a
    f = b
    g = c
    h = d
    x = get(rows, 4, simd_block(0))
    y = get(rows, 5, simd_block(0))
    for _ in range(rounds):
        a = a + x
        b = b * y
        c = c + x
        d = d * y
        e = e * y
        f = f + x
        g = g * y
        h = h + x
    put(rows, 0, simd_block(0), a + b + c + d + e + f + g + h)


PHASES = (
    Phase("sense", _sense, 12 / WIDTH, 12 / WIDTH + 29 * ITEM_BLOCKS),
    Phase("think", _think, (DENSE - 50 + 3 * SIGMOID) / WIDTH, (DENSE + 13 * SIGMOID) / WIDTH),
    Phase("learn", _learn, (15 + 120) / WIDTH, (15 + 120 + 30 + 60) / WIDTH),
    Phase("move", _act, 22 / WIDTH, 22 / WIDTH),
    Phase("eat", _eat, 0.0, 0.0),
)


def nanoseconds(phase: Phase, batch: CpuBatch, agents: int) -> float:
    """Return the time per agent-step, median over repetitions."""
    run = cached_jit(phase.run, list_hooks(batch.state))
    run(batch.model, batch.state, 1)
    times = []
    for _ in range(REPETITIONS):
        began = time.perf_counter()
        run(batch.model, batch.state, ROUNDS)
        times.append((time.perf_counter() - began) / ROUNDS / agents * 1e9)
    return float(np.median(times))


def nanoseconds_of_operation() -> float:
    """Return the time of one operation on sixteen float32 at the peak of the machine."""
    rows = np.ones((6, WIDTH), np.float32)
    _peak(rows, 1)
    times = []
    for _ in range(REPETITIONS):
        began = time.perf_counter()
        _peak(rows, 2_000_000)
        times.append((time.perf_counter() - began) / 2_000_000 / 8 * 1e9)
    return float(np.median(times))


def make_batch(experiment: Experiment) -> CpuBatch:
    """Return a batch after some steps of its first lifetime."""
    batch = CpuBatch(experiment, 0, range(CPU.worlds))
    batch.begin(
        0,
        np.stack([draw_genomes(experiment, GenerationKey(0, run, 0)) for run in range(CPU.worlds)]),
    )
    batch.simulate(0, 50)
    return batch


def main() -> None:
    far = make_batch(load("evo+self-taught/B"))
    near = make_batch(
        load("evo+self-taught/A").replace(world={"start": {"x": 480, "y": 160, "radius": 70}})
    )
    agents = CPU.worlds * 20
    operation = nanoseconds_of_operation()
    print(f"peak: {1 / operation:.2f} operations on sixteen float32 a nanosecond\n")
    print(
        "| phase | far from food, ns | arithmetic at peak | among food, ns | arithmetic at peak |"
    )
    print("|---|---|---|---|---|")
    for phase in PHASES:
        cells = []
        for batch, operations in ((far, phase.far), (near, phase.near)):
            cells += [f"{nanoseconds(phase, batch, agents):.1f}", f"{operations * operation:.1f}"]
        print(f"| {phase.name} | {' | '.join(cells)} |")


if __name__ == "__main__":
    main()
