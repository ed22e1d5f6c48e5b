"""Simulate the recorded runs of the explorable: `python -m scripts.explorable_recordings`.

The page shows them where a browser cannot simulate, for the yoked control and the needle, in print,
and before the first live run. Run the script again if a test reports that the engine changed. It
takes about a minute.
"""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from baldwinlab.evolution import GenerationKey
from baldwinlab.experiment import Experiment
from baldwinlab.lab.pages import explorable, single_page
from baldwinlab.lab.sources import binary_frames
from baldwinlab.lab.sources.life_query import Life, Span, StartData
from baldwinlab.lab.sources.recording import record_life
from baldwinlab.simulation.simulate import simulate, simulate_batch

# Arrays that change little from row to row.
DIFFERENCES = ("x", "y", "heading", "sensor", "action", "eaten_in_life")


def record_curve(experiment: Experiment) -> list[list[float]]:
    """Return the mean number of eaten items per agent [run][generation]."""
    runs = simulate_batch(experiment, explorable.SEED, range(explorable.RUNS))
    return [run.food_eaten.mean("agent").values.tolist() for run in runs]


def record_lives() -> dict[str, str]:
    """Return compressed recordings of lifetimes by name.

    `learning` and `off` have the same genomes. Learning is off in the second one.
    """
    learning = explorable.make_scenes()["learning"]
    control = explorable.make_scenes()["alone"]
    last_generation = explorable.GENERATIONS - 1
    lives = {
        "learning": (learning, learning, explorable.FIRST_GENERATION),
        "off": (learning, learning.replace(learning={"rate": 0.0}), explorable.FIRST_GENERATION),
        "alone": (control, control, last_generation),
    }
    return {name: _record_life(*life) for name, life in lives.items()}


def _record_life(evolved: Experiment, experiment: Experiment, generation: int) -> str:
    run = simulate(evolved, seed=explorable.SEED, run=explorable.FIRST_RUN)
    genomes = run.genome.values[generation]
    key = GenerationKey(explorable.SEED, explorable.FIRST_RUN, generation)
    life = Life(experiment, key, lambda: StartData(genomes, None))
    container = record_life(life, Span(0, explorable.STEPS), {})
    header, arrays = binary_frames.unpack(container)
    return single_page.compress(binary_frames.pack(header, arrays, DIFFERENCES))


def record_needle() -> list[list[list[float]]]:
    """Return the share of ? in the second half of each run [cost][period][run]."""
    costs, periods = explorable.NEEDLE_COSTS, explorable.NEEDLE_PERIODS
    return [[_record_needle_runs(cost, period) for period in periods] for cost in costs]


def _record_needle_runs(cost: float, period: int) -> list[float]:
    experiment = explorable.make_needle(cost, period)
    runs = simulate_batch(experiment, explorable.SEED, range(explorable.NEEDLE_RUNS))
    return [float(np.mean(run.unset.values[run.sizes["generation"] // 2 :])) for run in runs]


def make_recordings() -> dict[str, Any]:
    experiments = {**explorable.make_scenes(), "forked": explorable.make_forked_scene()}
    del experiments["map"]
    curves = {name: record_curve(experiment) for name, experiment in experiments.items()}
    return {"curves": curves, "lives": record_lives(), "needle": record_needle()}


if __name__ == "__main__":
    explorable.RECORDINGS_FILE.write_text(json.dumps(make_recordings()) + "\n", "utf-8")
