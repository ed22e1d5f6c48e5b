"""Where the knowledge sits: the last generation's evolved modules, each with a random one in place of the other."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from baldwinlab.studies.assays.sample import Conditions, Sample

BOTH_EVOLVED = "both evolved"
MODULES = (
    BOTH_EVOLVED,
    "evolved reinforcement, random action",
    "random reinforcement, evolved action",
    "both random",
)


def coordinates(study: Conditions, condition: str) -> Mapping[str, Any]:
    return {"modules": list(MODULES)}


def count_lives(study: Conditions, condition: str) -> int:
    return len(MODULES)


def measure(sample: Sample) -> Mapping[str, npt.NDArray[Any]]:
    """`energy` [run, modules, agent]; an agent keeps its place of birth, and its random modules, from one case to the next."""
    last = sample.experiment.evolution.generations - 1
    evolved, random = sample.genomes(last), sample.random_genomes()
    action, reinforcement = slice(0, 1), slice(1, 2)
    crossed = [
        np.concatenate([random[:, :, action], evolved[:, :, reinforcement]], axis=2),
        np.concatenate([evolved[:, :, action], random[:, :, reinforcement]], axis=2),
        random,
    ]
    found = [
        sample.simulate_as_evolved(last, evolved),
        *(sample.simulate(sample.experiment, last, genomes) for genomes in crossed),
    ]
    return {"energy": np.stack([lives.energy for lives in found], axis=1)}
