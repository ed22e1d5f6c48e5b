"""Simulate the recorded runs of the explorable: `python -m scripts.explorable_recordings`.

The page shows them in the step of the foragers, where a browser cannot simulate, in print, and
before the first live run. Run the script again if a test reports that the engine changed. It takes
about half a minute.
"""

from __future__ import annotations

import json
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from baldwinlab.evolution import GenerationKey
from baldwinlab.experiment import Experiment
from baldwinlab.lab.pages import explorable, single_page
from baldwinlab.lab.sources import binary_frames
from baldwinlab.lab.sources.life_query import Life, Span, StartData
from baldwinlab.lab.sources.recording import record_life
from baldwinlab.simulation.reevaluation import Outcomes, reevaluate
from baldwinlab.simulation.simulate import simulate, simulate_batch

# Arrays that change little from row to row.
DIFFERENCES = ("x", "y", "heading", "sensor", "action", "eaten_in_life")
RUNS: Final = range(explorable.RUNS)
LAST_LEARNING_GENERATION: Final = explorable.FORK_GENERATION - 1
Numbers = npt.NDArray[np.float64]
Genomes = npt.NDArray[np.float32]


def record_curve(experiment: Experiment) -> list[list[float]]:
    """Return the mean number of eaten items per agent [run][generation]."""
    runs = simulate_batch(experiment, explorable.SEED, RUNS)
    return [run.food_eaten.mean("agent").values.tolist() for run in runs]


def simulate_learners() -> tuple[Numbers, Genomes]:
    """Return the items that learners eat, and their genomes, with the dimensions [generation, run].

    The further dimensions are [agent], and [agent, module, weight].
    """
    runs = simulate_batch(explorable.make_scenes()["learning"], explorable.SEED, RUNS)
    generations = slice(explorable.FORK_GENERATION)
    eaten = np.stack([run.food_eaten.values[generations] for run in runs], axis=1)
    genomes = np.stack([run.genome.values[generations] for run in runs], axis=1)
    return eaten.astype(float), genomes


def evaluate(newborns: Genomes, generation: int, *, learns: bool) -> Outcomes:
    """Simulate the newborns [run, agent, module, weight] of a generation of learners again."""
    experiment = explorable.make_scenes()["learning"]
    if not learns:
        experiment = experiment.replace(learning={"rate": 0.0})
    return reevaluate(experiment, explorable.SEED, RUNS, generation, newborns)


def measure_selection(fitness: Numbers, trait: Numbers) -> float:
    """Return the selection differential of a trait in its standard deviations [..., agent].

    The mean over all populations in which the trait varies and an agent eats.
    """
    mean, deviation = fitness.mean(axis=-1), trait.std(axis=-1)
    varies = (mean > 0) & (deviation > 0)
    covariance = ((trait - trait.mean(axis=-1, keepdims=True)) * fitness).mean(axis=-1)
    return float((covariance[varies] / (mean * deviation)[varies]).mean())


def record_hiding(eaten: Numbers, eaten_without_learning: Numbers) -> float:
    """Return the share of the selection on innate eating that learning removes."""
    generations = slice(explorable.FIRST_GENERATION, None)
    innate = eaten_without_learning[generations]
    with_learning = measure_selection(eaten[generations], innate)
    return 1 - with_learning / measure_selection(innate, innate)


def record_newborns(newborns: Genomes) -> dict[str, float]:
    """Return the items of the newborns of the last generation that learns, three times.

    They learn, do not learn, or are born with their learned network and do not learn.
    """
    learning = evaluate(newborns, LAST_LEARNING_GENERATION, learns=True)
    frozen = newborns.copy()
    frozen[:, :, 0] = learning.weights
    outcomes = {
        "learning": learning,
        "off": evaluate(newborns, LAST_LEARNING_GENERATION, learns=False),
        "frozen": evaluate(frozen, LAST_LEARNING_GENERATION, learns=False),
    }
    return {name: float(outcome.energy.mean()) for name, outcome in outcomes.items()}


def record_learner() -> dict[str, Any]:
    """Return the agent in the middle of the first life, and its genome: both networks."""
    learning = explorable.make_scenes()["learning"]
    run = simulate(learning, seed=explorable.SEED, run=explorable.FIRST_RUN)
    eaten = run.food_eaten.values[explorable.FIRST_GENERATION]
    agent = int(eaten.argsort(kind="stable")[eaten.size // 2])
    genome = run.genome.values[explorable.FIRST_GENERATION, agent]
    return {"agent": agent, "genome": genome.ravel().tolist()}


def record_lives() -> dict[str, str]:
    """Return compressed recordings of lifetimes by name."""
    scenes = explorable.make_scenes()
    return {
        "learning": _record_life(scenes["learning"], explorable.FIRST_GENERATION),
        "alone": _record_life(scenes["alone"], explorable.EVOLUTION_GENERATIONS - 1),
    }


def _record_life(experiment: Experiment, generation: int) -> str:
    run = simulate(experiment, seed=explorable.SEED, run=explorable.FIRST_RUN)
    genomes = run.genome.values[generation]
    key = GenerationKey(explorable.SEED, explorable.FIRST_RUN, generation)
    life = Life(experiment, key, lambda: StartData(genomes, None))
    container = record_life(life, Span(0, explorable.STEPS), {})
    header, arrays = binary_frames.unpack(container)
    return single_page.compress(binary_frames.pack(header, arrays, DIFFERENCES))


def make_recordings() -> dict[str, Any]:
    eaten, genomes = simulate_learners()
    forked = explorable.make_scenes()["learning"].replace(
        schedule=[{"generation": explorable.FORK_GENERATION, "learning.rate": 0.0}]
    )
    born = np.array(
        [
            evaluate(newborns, generation, learns=False).energy
            for generation, newborns in enumerate(genomes)
        ]
    )
    return {
        "curves": {
            "alone": record_curve(explorable.make_scenes()["alone"]),
            "forked": record_curve(forked),
            "born": born.mean(axis=-1).T.tolist(),
        },
        "hiding": record_hiding(eaten, born),
        "newborns": record_newborns(genomes[LAST_LEARNING_GENERATION]),
        "learner": record_learner(),
        "lives": record_lives(),
    }


if __name__ == "__main__":
    explorable.RECORDINGS_FILE.write_text(json.dumps(make_recordings()) + "\n", "utf-8")
