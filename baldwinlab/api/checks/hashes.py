"""Hashes of simulations, and the backends and updates that are compared."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from itertools import pairwise
from typing import Any, Final

import numpy as np

from baldwinlab.api.checks.fixture import PartGroup, is_of_miniworld
from baldwinlab.evolution import GenerationKey, draw_genomes
from baldwinlab.experiment import BaseExperiment
from baldwinlab.models.miniworld.backends.choice import CPU, choose_backend
from baldwinlab.simulation.simulate import simulate_batch

UPDATES: Final = ("simultaneous", "sequential")
Bits = list[str]
"""A hash for each run."""


def hash_runs(
    experiment: Any, seed: int, runs: Sequence[int], cuts: Sequence[int] = (), backend: Any = CPU
) -> Bits:
    """Simulate runs, and hash all recorded data and, for MiniWorld, the end of a lifetime."""
    digests = [hashlib.sha256() for _ in runs]
    records = simulate_batch(experiment, seed, runs, backend)
    for digest, record in zip(digests, records, strict=True):
        for name in sorted(map(str, record.data_vars)):
            digest.update(name.encode() + record[name].values.tobytes())
    if is_of_miniworld(experiment):
        batch = backend.batch(experiment, seed, runs)
        keys = [GenerationKey(seed, run, 0) for run in runs]
        batch.begin(0, np.stack([draw_genomes(experiment, key) for key in keys]))
        for first_step, last_step in pairwise([0, *cuts, experiment.lifetime.steps]):
            batch.simulate(first_step, last_step)
        for array in (batch.eaten_in_life(), batch.weights(), batch.items()):
            for world, digest in enumerate(digests):
                digest.update(np.ascontiguousarray(array[world]).tobytes())
    return [digest.hexdigest() for digest in digests]


def make_update_variants(group: PartGroup) -> list[Any]:
    """Return the experiment with both updates, or the experiment of another model."""
    if not is_of_miniworld(group.experiment):
        return [group.experiment]
    return [group.experiment.replace(lifetime={"update": update}) for update in UPDATES]


def describe_update(experiment: BaseExperiment) -> str:
    """Return the update of an experiment as the start of a sentence.

    The result is empty for another model than MiniWorld.
    """
    update = getattr(getattr(experiment, "lifetime", None), "update", "")
    return f"under the {update} update, " if update else ""


def load_backend(name: str) -> Any:
    """Return a backend by its name."""
    try:
        return choose_backend(name)
    except ImportError as error:
        raise ValueError(f"the backend {name!r} cannot be loaded: {error}") from None
