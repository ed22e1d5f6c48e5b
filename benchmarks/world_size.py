"""Measure the cost of larger experiments: `python -m benchmarks.world_size [--out DIR]`.

The command varies agents, items and hidden units separately, in interleaved rounds. All
agents are self-taught newborns among the food of map A, where a step costs most. It writes
world_size.md into DIR.
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Callable
from pathlib import Path
from statistics import median
from typing import Any

from baldwinlab.evolution import draw_genomes, make_run_keys
from baldwinlab.experiment import Experiment
from baldwinlab.models.miniworld.backends.choice import CPU
from baldwinlab.models.miniworld.backends.cpu import CpuBatch
from baldwinlab.papers.presets import load
from benchmarks.compare import OUTPUT_FOLDER
from benchmarks.machine import provenance
from benchmarks.tables import describe_machine, table

# Agent-steps before the measurement.
N_STEPS = 40_000
# Smallest duration of a measurement, in seconds.
MIN_MEASUREMENT_SECONDS = 0.1
N_ROUNDS = 3
N_AGENTS = (20, 50, 100, 200, 500, 1000, 2000)
N_ITEMS = (0, 10, 20, 50, 100, 200, 500, 1000)
N_HIDDEN_UNITS = (2, 5, 10, 20, 50, 100)

Measure = Callable[[], float]
"""Simulate further steps, and return nanoseconds per agent-step."""


def among_food(**changes: Any) -> Experiment:
    world = {"start": {"x": 480, "y": 160, "radius": 80}}
    return load("evo+self-taught/A").replace(world=world).replace(**changes)


def at_constant_density(agents: int) -> Experiment:
    """Return an experiment whose map and food grow in proportion to the agents."""
    side = math.sqrt(agents / 20)
    x, y = [400 * side, 560 * side], [80 * side, 240 * side]
    food = [{"x": x, "y": y, "count": 50 * agents // 20}]
    start = {"x": 480 * side, "y": 160 * side, "radius": 80 * side}
    world = {"width": 640 * side, "height": 640 * side, "food": food, "start": start}
    return among_food(world=world, population={"size": agents})


def with_items(count: int) -> Experiment:
    return among_food(world={"food": [{"x": [400, 560], "y": [80, 240], "count": count}]})


def list_cases() -> dict[str, dict[int, Measure]]:
    """Return a measurement for each value of each varied quantity."""
    return {
        "agents": {size: measure(among_food(population={"size": size})) for size in N_AGENTS},
        "agents, map and food": {size: measure(at_constant_density(size)) for size in N_AGENTS},
        "food items": {count: measure(with_items(count)) for count in N_ITEMS},
        "hidden units": {
            units: measure(among_food(network={"hidden": [units]})) for units in N_HIDDEN_UNITS
        },
    }


def measure(experiment: Experiment) -> Measure:
    """Return a measurement of a batch on one thread, after some steps."""
    # Batches of all sizes have about as many agents.
    worlds = range(max(1, CPU.worlds * 20 // experiment.population.size))
    agents = len(worlds) * experiment.population.size
    piece = max(1, N_STEPS // agents)
    # The current step of the batch.
    step = piece
    batch = CpuBatch(experiment, 0, worlds)
    batch.begin(0, draw_genomes(experiment, make_run_keys(0, worlds, 0)))
    batch.simulate(0, step)

    def continue_lifetimes() -> float:
        nonlocal step
        first = step
        began = time.perf_counter()
        while time.perf_counter() - began < MIN_MEASUREMENT_SECONDS:
            batch.simulate(step, step + piece)
            step += piece
        return (time.perf_counter() - began) * 1e9 / ((step - first) * agents)

    return continue_lifetimes


def format_table(quantity: str, points: dict[int, Measure]) -> str:
    """Measure in rounds, and return a table of nanoseconds per agent-step: median and range."""
    rounds = [[point() for point in points.values()] for _ in range(N_ROUNDS)]
    times = list(zip(*rounds, strict=True))
    middle = ["ns", *(f"{median(values):.3g}" for values in times)]
    spread = [f"{min(values):.3g} to {max(values):.3g}" for values in times]
    return table([quantity, *map(str, points)], [middle, ["(minimum to maximum)", *spread]])


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    arguments.add_argument("--out", type=Path, default=OUTPUT_FOLDER)
    given = arguments.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    tables = [format_table(quantity, points) for quantity, points in list_cases().items()]
    text = "\n\n".join([f"{describe_machine(provenance())}.", *tables]) + "\n"
    (given.out / "world_size.md").write_text(text)
    print(text)


if __name__ == "__main__":
    main()
