"""Assay within the lifetime: food eaten in each part of the lifetime, and the first meal."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from baldwinlab.core.variables import RANDOM_NEWBORNS
from baldwinlab.evolution import Genome
from baldwinlab.simulation.recorder import FirstTime, Series, record_batch
from baldwinlab.simulation.reevaluation import make_batch
from baldwinlab.studies.assays.sample import Conditions, Sample, first_middle_last

# Length of a part of the lifetime in steps; the last part can be shorter.
WINDOW_STEPS = 250


def coordinates(study: Conditions, condition: str) -> Mapping[str, Any]:
    experiment = study.experiments[condition]
    compared = first_middle_last(experiment.evolution.generations)
    windows = np.arange(0, experiment.lifetime.steps, WINDOW_STEPS, dtype=np.int32)
    return {
        "newborns": [RANDOM_NEWBORNS, *(f"generation {number}" for number in compared)],
        "window": windows,
    }


def count_lives(study: Conditions, condition: str) -> int:
    return 1 + len(first_middle_last(study.experiments[condition].evolution.generations))


def measure(sample: Sample) -> Mapping[str, npt.NDArray[Any]]:
    """Measure `eaten_in_window` [run, newborns, window, agent] and `first_meal`.

    `first_meal` [run, newborns, agent] is the step of the first meal, NaN without one.
    """
    compared = first_middle_last(sample.experiment.evolution.generations)
    measured = [_measure_newborns(sample, compared[-1], sample.random_genomes())]
    for generation in compared:
        measured.append(_measure_newborns(sample, generation, sample.genomes(generation)))
    eaten, first_meal = zip(*measured, strict=True)
    return {"eaten_in_window": np.stack(eaten, axis=1), "first_meal": np.stack(first_meal, axis=1)}


def _measure_newborns(
    sample: Sample, generation: int, genomes: Genome
) -> tuple[npt.NDArray[Any], npt.NDArray[Any]]:
    """Measure the items eaten [run, window, agent] and the step of the first meal [run, agent]."""
    steps = sample.experiment.lifetime.steps
    runs, agents = genomes.shape[:2]
    batch = make_batch(sample.experiment, sample.seed, sample.runs, generation, genomes)
    recorded_steps = [*range(0, steps, WINDOW_STEPS), steps]
    eaten = Series("eaten_in_life", recorded_steps, slice(runs * agents))
    fed = FirstTime(lambda batch: np.any(batch.eaten_in_life(), axis=-1), recorded_steps)
    record_batch(batch, [eaten, fed])
    sample.count_generation()
    in_window = np.diff(eaten.values, axis=0).reshape(-1, runs, agents)
    # The recorded time is the number of steps done. The meal was in the step before.
    return in_window.swapaxes(0, 1), fed.values - 1
