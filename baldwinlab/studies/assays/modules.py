"""Assay of modules: evolved modules of the last generation combined with random modules."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from baldwinlab.studies.assays.sample import Conditions, Sample

BOTH_EVOLVED = "both evolved"
MODULE_COMBINATIONS = (
    BOTH_EVOLVED,
    "evolved reinforcement, random action",
    "random reinforcement, evolved action",
    "both random",
)


def coordinates(study: Conditions, condition: str) -> Mapping[str, Any]:
    return {"modules": list(MODULE_COMBINATIONS)}


def count_lives(study: Conditions, condition: str) -> int:
    return len(MODULE_COMBINATIONS)


def measure(sample: Sample) -> Mapping[str, npt.NDArray[Any]]:
    """Measure `energy` [run, modules, agent].

    In all cases, an agent has the same initial position and the same random modules.
    """
    last = sample.experiment.evolution.generations - 1
    evolved = sample.genomes(last)
    random = sample.random_genomes()
    action = slice(0, 1)
    reinforcement = slice(1, 2)
    crossed = [
        np.concatenate([random[:, :, action], evolved[:, :, reinforcement]], axis=2),
        np.concatenate([evolved[:, :, action], random[:, :, reinforcement]], axis=2),
        random,
    ]
    outcomes = [
        sample.simulate_as_evolved(last, evolved),
        *(sample.simulate(sample.experiment, last, genomes) for genomes in crossed),
    ]
    return {"energy": np.stack([lives.energy for lives in outcomes], axis=1)}
