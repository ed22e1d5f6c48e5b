"""Draws of parents by selections, for comparisons with theoretical frequencies."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.stats import chisquare

from baldwinlab.engine import rng
from baldwinlab.evolution import GenerationKey, Parents
from baldwinlab.experiment import Experiment
from baldwinlab.papers.presets import load
from baldwinlab.parts.lifetimes import Lifetimes
from tests.evolution.single_runs import select

# The fitness of eight agents, without equal values.
FITNESS = np.array([3.0, 0.0, 5.0, 1.0, 0.5, 7.5, 2.0, 4.0])
# Probability that a correct program fails a test.
ERROR_RATE = 0.001


def use_selection(
    name: str, settings: dict[str, Any] | None = None, **evolution: Any
) -> Experiment:
    """Return an experiment with a selection and the settings of its part."""
    table = {name.replace("-", "_"): settings} if settings else {}
    experiment: Experiment = load("evo/A").replace(
        evolution={"selection": name} | table | evolution
    )
    return experiment


def draw_parents(
    experiment: Experiment, fitness: Any, generation: int = 1, lifetimes: Lifetimes | None = None
) -> Parents:
    key = GenerationKey(3, 0, generation)
    values = np.asarray(fitness, float)
    return select(experiment, values, key.uniforms(rng.SELECTION, (values.size, 2)), lifetimes, key)


def draw_generations(
    experiment: Experiment, fitness: Any, rounds: int, lifetimes: Lifetimes | None = None
) -> npt.NDArray[np.int32]:
    """Return the parents [round, child, 2] of many generations from the same population."""
    return np.stack(
        [
            draw_parents(experiment, fitness, generation, lifetimes)
            for generation in range(1, rounds + 1)
        ]
    )


def count_parents(
    experiment: Experiment, fitness: Any, rounds: int, lifetimes: Lifetimes | None = None
) -> npt.NDArray[np.int64]:
    """Return how often each agent is a parent in each round, [round, agent]."""
    parents = draw_generations(experiment, fitness, rounds, lifetimes)
    return np.stack([np.bincount(drawn.ravel(), minlength=len(fitness)) for drawn in parents])


def require_frequencies(counts: npt.NDArray[Any], shares: Any) -> None:
    """Require that counts of draws agree with probabilities in proportion to `shares`."""
    expected = np.asarray(shares, float) / np.sum(shares) * counts.sum()
    possible = expected > 0
    assert (counts[~possible] == 0).all()
    assert chisquare(counts[possible], expected[possible]).pvalue > ERROR_RATE
