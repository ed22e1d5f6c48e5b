"""Within life: what newborns of some generations, and random genomes, eat from one part of life to the next, and when first."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from baldwinlab.core.variables import RANDOM
from baldwinlab.evolution import Genome
from baldwinlab.simulation.recorder import FirstTime, Series, record_batch
from baldwinlab.simulation.reevaluation import make_batch
from baldwinlab.studies.assays.sample import Conditions, Sample, first_middle_last

WINDOW = 250  # steps; the last part of a life may be shorter


def coordinates(study: Conditions, condition: str) -> Mapping[str, Any]:
    experiment = study.experiments[condition]
    compared = first_middle_last(experiment.evolution.generations)
    windows = np.arange(0, experiment.lifetime.steps, WINDOW, dtype=np.int32)
    return {
        "newborns": [RANDOM, *(f"generation {number}" for number in compared)],
        "window": windows,
    }


def count_lives(study: Conditions, condition: str) -> int:
    return 1 + len(first_middle_last(study.experiments[condition].evolution.generations))


def measure(sample: Sample) -> Mapping[str, npt.NDArray[Any]]:
    """`eaten_in_window` [run, newborns, window, agent], items; `first_meal` [run, newborns, agent], steps, NaN for never."""
    compared = first_middle_last(sample.experiment.evolution.generations)
    found = [_of_newborns(sample, compared[-1], sample.random_genomes())]
    found += [
        _of_newborns(sample, generation, sample.genomes(generation)) for generation in compared
    ]
    eaten, first_meal = zip(*found, strict=True)
    return {"eaten_in_window": np.stack(eaten, axis=1), "first_meal": np.stack(first_meal, axis=1)}


def _of_newborns(
    sample: Sample, generation: int, genomes: Genome
) -> tuple[npt.NDArray[Any], npt.NDArray[Any]]:
    """Items eaten [run, window, agent], and the step of the first meal [run, agent]."""
    steps, (runs, agents) = sample.experiment.lifetime.steps, genomes.shape[:2]
    batch = make_batch(sample.experiment, sample.seed, sample.runs, generation, genomes)
    moments = [*range(0, steps, WINDOW), steps]
    eaten = Series("eaten_in_life", moments, slice(runs * agents))
    fed = FirstTime(lambda batch: np.any(batch.eaten_in_life(), axis=-1), moments)
    record_batch(batch, [eaten, fed])
    sample.tell()
    in_window = np.diff(eaten.values, axis=0).reshape(-1, runs, agents)
    return in_window.swapaxes(
        0, 1
    ), fed.values - 1  # what is there at a moment came about in the step before
