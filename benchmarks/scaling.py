"""How baldwinlab's cost grows: `python -m benchmarks.scaling [--out DIR]`.

Threads, worlds in a batch, agents, food items and hidden units, each alone, in interleaved rounds. All agents are self-taught
newborns in the midst of map A's food, where a step costs most. Writes scaling.json, scaling.md and scaling.png and .svg.
"""

from __future__ import annotations

import argparse
import json
import math
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
from matplotlib import pyplot as plt

from baldwinlab.evolution import GenerationKey, draw_genomes
from baldwinlab.experiment import Experiment
from baldwinlab.models.miniworld.backends.choice import CPU
from baldwinlab.models.miniworld.backends.cpu import Batch
from baldwinlab.papers.presets import load
from baldwinlab.studies.run import available_cores
from benchmarks.compare import OUT
from benchmarks.machine import provenance
from benchmarks.tables import save, table

STEPS = 40_000  # agent-steps in the first, uncounted piece of a life
FILL = 0.1  # seconds that a measurement lasts at least
ROUNDS = 3
MANY = 2000

Measure = Callable[[], float]
"""Lives on for a while; nanoseconds per agent-step."""


def in_the_food(**changes: Any) -> Experiment:
    return (
        load("evo+self-taught/A")
        .replace(world={"start": {"x": 480, "y": 160, "radius": 80}})
        .replace(**changes)
    )


def grown(agents: int) -> Experiment:
    """More agents with map and food grown in proportion, so that the density stays."""
    side = math.sqrt(agents / 20)
    food = {
        "x": [400 * side, 560 * side],
        "y": [80 * side, 240 * side],
        "count": round(50 * agents / 20),
    }
    start = {"x": 480 * side, "y": 160 * side, "radius": 80 * side}
    world = {"width": 640 * side, "height": 640 * side, "food": [food], "start": start}
    return in_the_food(world=world, population={"size": agents})


def with_items(count: int) -> Experiment:
    return in_the_food(world={"food": [{"x": [400, 560], "y": [80, 240], "count": count}]})


def worlds_for(agents: int) -> int:
    return max(1, CPU.worlds * 20 // agents)


def cases() -> dict[str, dict[int, Measure]]:
    """By what grows: its values, and how to measure there."""
    normal, agents = in_the_food(), (20, 50, 100, 200, 500, 1000, MANY)
    return {
        "threads": {
            number: measure(normal, CPU.worlds, number) for number in sorted({1, available_cores()})
        },
        "worlds in a batch": {
            worlds: measure(normal, worlds) for worlds in (1, 2, 4, 8, 16, 32, 64)
        },
        "agents": {
            size: measure(in_the_food(population={"size": size}), worlds_for(size))
            for size in agents
        },
        "agents, map and food": {size: measure(grown(size), worlds_for(size)) for size in agents},
        "food items": {
            count: measure(with_items(count), CPU.worlds)
            for count in (0, 10, 20, 50, 100, 200, 500, 1000)
        },
        "hidden units": {
            units: measure(in_the_food(network={"hidden": [units]}), CPU.worlds)
            for units in (2, 5, 10, 20, 50, 100)
        },
    }


def measure(experiment: Experiment, worlds: int, threads: int = 1) -> Measure:
    """A batch in each thread, in which all have lived for a while."""
    step = [max(1, STEPS // (worlds * experiment.population.size))]
    batches = [Batch(experiment, thread, range(worlds)) for thread in range(threads)]
    for batch in batches:
        batch.begin(
            0,
            np.stack(
                [draw_genomes(experiment, GenerationKey(0, world, 0)) for world in range(worlds)]
            ),
        )
        batch.simulate(0, step[0])

    def live_on() -> float:
        lived, piece, began = (
            0,
            max(1, STEPS // (worlds * experiment.population.size)),
            time.perf_counter(),
        )
        with ThreadPoolExecutor(threads) as pool:
            while time.perf_counter() - began < FILL:
                first, step[0] = step[0], step[0] + piece
                list(pool.map(lambda batch: batch.simulate(first, first + piece), batches))  # noqa: B023
                lived += piece
                piece *= 2
        return (
            (time.perf_counter() - began)
            * 1e9
            / (lived * worlds * experiment.population.size * threads)
        )

    return live_on


def run_cases() -> dict[str, dict[int, list[float]]]:
    found: dict[str, dict[int, list[float]]] = {}
    for name, points in cases().items():
        rounds = [[point() for point in points.values()] for _ in range(ROUNDS)]
        found[name] = dict(zip(points, map(list, zip(*rounds, strict=True)), strict=True))
    return found


def text(found: dict[str, dict[int, list[float]]]) -> str:
    """A table for each of what grows: nanoseconds per agent-step, median and range."""
    parts = []
    for name, points in found.items():
        middle = ["ns", *(f"{median(values):.3g}" for values in points.values())]
        spread = [
            "(minimum to maximum)",
            *(f"{min(values):.3g} to {max(values):.3g}" for values in points.values()),
        ]
        parts.append(table([name, *map(str, points)], [middle, spread]))
    return "\n\n".join(parts) + "\n"


def draw(found: dict[str, dict[int, list[float]]], out: Path) -> None:
    figure, axes = plt.subplots(2, 3, figsize=(11, 5.2), layout="constrained")
    for axis, (name, points) in zip(axes.flat, found.items(), strict=True):
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
    arguments.add_argument("--out", type=Path, default=OUT)
    given = arguments.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    found = run_cases()
    (given.out / "scaling.json").write_text(
        json.dumps({"machine": provenance(), "ns_per_agent_step": found}, indent=1) + "\n"
    )
    (given.out / "scaling.md").write_text(text(found))
    draw(found, given.out)
    print(text(found))


if __name__ == "__main__":
    main()
