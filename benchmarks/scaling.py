"""Measure the cost of larger experiments: `python -m benchmarks.scaling [--out DIR]`.

The command varies threads, worlds per batch, agents, items and hidden units separately, in
interleaved rounds. All agents are self-taught newborns among the food of map A, where a step costs
most. It writes scaling.json, scaling.md, scaling.png and scaling.svg.
"""

from __future__ import annotations

import argparse
import json
import math
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
from matplotlib import pyplot as plt

from baldwinlab.evolution import GenerationKey, draw_genomes
from baldwinlab.experiment import Experiment
from baldwinlab.models.miniworld.backends.choice import CPU
from baldwinlab.models.miniworld.backends.cpu import CpuBatch
from baldwinlab.papers.presets import load
from baldwinlab.studies.run import available_cores
from benchmarks.compare import OUTPUT_FOLDER
from benchmarks.machine import provenance
from benchmarks.tables import save, table

# Agent-steps before the measurement.
N_STEPS = 40_000
# Smallest duration of a measurement, in seconds.
MIN_MEASUREMENT_SECONDS = 0.1
N_ROUNDS = 3
MAX_AGENTS = 2000
# Maximum number of items of a food region.
MAX_ITEMS = 1_000_000
# Numbers of agents of one world, for `measure_large_worlds`.
WORLD_SIZES = (20, 1_000, 10_000, 100_000, 1_000_000)

Measure = Callable[[], float]
"""Simulate further steps, and return nanoseconds per agent-step."""


def among_food(**changes: Any) -> Experiment:
    return (
        load("evo+self-taught/A")
        .replace(world={"start": {"x": 480, "y": 160, "radius": 80}})
        .replace(**changes)
    )


def at_constant_density(agents: int) -> Experiment:
    """Return an experiment whose map and food grow in proportion to the agents.

    Adjacent regions have the food, because the number of items of a region is limited.
    """
    side = math.sqrt(agents / 20)
    count = round(50 * agents / 20)
    n_regions = math.ceil(count / MAX_ITEMS)
    width = 160 * side / n_regions
    food = [
        {
            "x": [400 * side + region * width, 400 * side + (region + 1) * width],
            "y": [80 * side, 240 * side],
            "count": count // n_regions,
        }
        for region in range(n_regions)
    ]
    start = {"x": 480 * side, "y": 160 * side, "radius": 80 * side}
    world = {"width": 640 * side, "height": 640 * side, "food": food, "start": start}
    return among_food(world=world, population={"size": agents})


def with_items(count: int) -> Experiment:
    return among_food(world={"food": [{"x": [400, 560], "y": [80, 240], "count": count}]})


def worlds_for(agents: int) -> int:
    return max(1, CPU.worlds * 20 // agents)


def cases() -> dict[str, dict[int, Measure]]:
    """Return a measurement for each value of each varied quantity."""
    standard = among_food()
    agents = (20, 50, 100, 200, 500, 1000, MAX_AGENTS)
    return {
        "threads": {
            number: measure(standard, CPU.worlds, number)
            for number in sorted({1, available_cores()})
        },
        "worlds in a batch": {
            worlds: measure(standard, worlds) for worlds in (1, 2, 4, 8, 16, 32, 64)
        },
        "agents": {
            size: measure(among_food(population={"size": size}), worlds_for(size))
            for size in agents
        },
        "agents, map and food": {
            size: measure(at_constant_density(size), worlds_for(size)) for size in agents
        },
        "food items": {
            count: measure(with_items(count), CPU.worlds)
            for count in (0, 10, 20, 50, 100, 200, 500, 1000)
        },
        "hidden units": {
            units: measure(among_food(network={"hidden": [units]}), CPU.worlds)
            for units in (2, 5, 10, 20, 50, 100)
        },
    }


def measure_large_world(agents: int, threads: int) -> dict[str, float]:
    """Return the values of `large_world.Measurement`, measured in a new process."""
    command = [sys.executable, "-m", "benchmarks.large_world", str(agents), str(threads)]
    completed = subprocess.run(command, capture_output=True, check=True, text=True)
    measurement: dict[str, float] = json.loads(completed.stdout)
    return measurement


def measure_large_worlds(
    agents: Sequence[int] = WORLD_SIZES,
    threads: Sequence[int] = (1, 2),
    rounds: int = N_ROUNDS,
) -> list[dict[str, float]]:
    """Return measurements of one world of each size, for each number of threads, in turns."""
    return [
        measure_large_world(size, number)
        for size in agents
        for _ in range(rounds)
        for number in threads
    ]


def measure(experiment: Experiment, worlds: int, threads: int = 1) -> Measure:
    """Return a measurement with a batch in each thread, after some steps."""
    agents = worlds * experiment.population.size
    # The current step of all batches.
    step = [max(1, N_STEPS // agents)]
    batches = [CpuBatch(experiment, thread, range(worlds)) for thread in range(threads)]
    for batch in batches:
        batch.begin(
            0,
            np.stack(
                [draw_genomes(experiment, GenerationKey(0, world, 0)) for world in range(worlds)]
            ),
        )
        batch.simulate(0, step[0])

    def continue_lifetimes() -> float:
        steps_done = 0
        piece = max(1, N_STEPS // agents)
        began = time.perf_counter()
        with ThreadPoolExecutor(threads) as pool:
            while time.perf_counter() - began < MIN_MEASUREMENT_SECONDS:
                first = step[0]
                step[0] += piece
                list(pool.map(lambda batch: batch.simulate(first, first + piece), batches))  # noqa: B023
                steps_done += piece
                piece *= 2
        seconds = time.perf_counter() - began
        return seconds * 1e9 / (steps_done * agents * threads)

    return continue_lifetimes


def run_cases() -> dict[str, dict[int, list[float]]]:
    results: dict[str, dict[int, list[float]]] = {}
    for name, points in cases().items():
        rounds = [[point() for point in points.values()] for _ in range(N_ROUNDS)]
        results[name] = dict(zip(points, map(list, zip(*rounds, strict=True)), strict=True))
    return results


def format_tables(results: dict[str, dict[int, list[float]]]) -> str:
    """Return a table for each quantity: nanoseconds per agent-step, median and range."""
    parts = []
    for name, points in results.items():
        middle = ["ns", *(f"{median(values):.3g}" for values in points.values())]
        spread = [
            "(minimum to maximum)",
            *(f"{min(values):.3g} to {max(values):.3g}" for values in points.values()),
        ]
        parts.append(table([name, *map(str, points)], [middle, spread]))
    return "\n\n".join(parts) + "\n"


def draw(results: dict[str, dict[int, list[float]]], out: Path) -> None:
    figure, axes = plt.subplots(2, 3, figsize=(11, 5.2), layout="constrained")
    for axis, (name, points) in zip(axes.flat, results.items(), strict=True):
        values = [median(rounds) for rounds in points.values()]
        axis.plot(list(points), values, "o-", color="#0072B2", markersize=4)
        for point, rounds in points.items():
            axis.plot([point, point], [min(rounds), max(rounds)], color="#0072B2", linewidth=1)
        axis.set(xlabel=name, ylabel="ns per agent-step", ylim=(0, None))
        if 0 in points:
            axis.set_xscale("symlog", linthresh=10, linscale=0.4)
            axis.set_xlim(-3, 1.3 * max(points))
        else:
            axis.set_xscale("log")
        axis.set_xticks(list(points), [str(point) for point in points], fontsize=6)
        axis.minorticks_off()
        axis.spines[["top", "right"]].set_visible(False)
    save(figure, out / "scaling")


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    arguments.add_argument("--out", type=Path, default=OUTPUT_FOLDER)
    given = arguments.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    results = run_cases()
    (given.out / "scaling.json").write_text(
        json.dumps({"machine": provenance(), "ns_per_agent_step": results}, indent=1) + "\n"
    )
    (given.out / "scaling.md").write_text(format_tables(results))
    draw(results, given.out)
    print(format_tables(results))


if __name__ == "__main__":
    main()
