"""Within life: what newborns of several generations, and blank slates, eat from one part of life to the next, and when first."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from baldwinlab.assays.sample import Sample, middle_and_ends
from baldwinlab.evolution import Genome
from baldwinlab.models.miniworld.cpu import Block
from baldwinlab.models.miniworld.make import arrays_of
from baldwinlab.runs.relive import born
from baldwinlab.studies.store import Study

WINDOW = 250  # steps; the last part of a life may be shorter
BLANK = "blank slate"  # freshly drawn weights, born where the last generation was


def coords(study: Study, condition: str) -> Mapping[str, Any]:
    experiment = study.experiments[condition]
    compared = middle_and_ends(experiment.evolution.generations)
    windows = np.arange(0, experiment.lifetime.steps, WINDOW, dtype=np.int32)
    return {"newborns": [BLANK, *(f"generation {number}" for number in compared)], "window": windows}


def lives(study: Study, condition: str) -> int:
    return 1 + len(middle_and_ends(study.experiments[condition].evolution.generations))


def measure(sample: Sample) -> Mapping[str, npt.NDArray[Any]]:
    """`eaten` [run, newborns, window, agent], items; `first_meal` [run, newborns, agent], steps, NaN for never."""
    compared = middle_and_ends(sample.experiment.evolution.generations)
    found = [_of_newborns(sample, compared[-1], sample.blank_slates())]
    found += [_of_newborns(sample, generation, sample.genomes(generation)) for generation in compared]
    eaten, first_meal = zip(*found, strict=True)
    return {"eaten": np.stack(eaten, axis=1), "first_meal": np.stack(first_meal, axis=1)}


def _of_newborns(sample: Sample, generation: int, genomes: Genome) -> tuple[npt.NDArray[Any], npt.NDArray[Any]]:
    """Items eaten [run, window, agent], and the step of the first meal [run, agent]."""
    steps = sample.experiment.lifetime.steps
    block = born(sample.experiment, sample.study.seed, sample.runs, generation, genomes)
    first_meal = np.full(genomes.shape[:2], np.nan, np.float32)
    eaten = []
    for first in range(0, steps, WINDOW):
        before = block.eaten()
        _live_and_note_first_meals(block, first, min(first + WINDOW, steps), first_meal)
        eaten.append((block.eaten() - before).sum(axis=-1))
    sample.tell()
    return np.stack(eaten, axis=1), first_meal


def _live_and_note_first_meals(block: Block, first: int, last: int, first_meal: npt.NDArray[np.float32]) -> None:
    """Live from step `first` to `last`. Where somebody eats for the first time, go back and live in halves, down to the step."""
    before = [array.copy() for array in arrays_of(block.state)]
    block.live(first, last)
    new = np.isnan(first_meal) & block.eaten().any(axis=-1)
    if not new.any():
        return
    if last - first == 1:
        first_meal[new] = first
        return
    for array, value in zip(arrays_of(block.state), before, strict=True):
        array[:] = value
    middle = (first + last) // 2
    _live_and_note_first_meals(block, first, middle, first_meal)
    _live_and_note_first_meals(block, middle, last, first_meal)
