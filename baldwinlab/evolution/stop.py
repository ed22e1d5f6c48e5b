"""Conditions under which a run ends before its last generation."""

from __future__ import annotations

from typing import Any, ClassVar, Literal

import numpy as np
from pydantic import Field

from baldwinlab.engine.jit import cached_jit, compiled
from baldwinlab.engine.phases import per_run
from baldwinlab.evolution.rng_key import Fitness
from baldwinlab.experiment import BaseExperiment
from baldwinlab.parts.breeding import RunArrays, Stop, breeding_part, should_stop
from baldwinlab.parts.lifetimes import Lifetimes


class NoStop(Stop, name="none"):
    """No early end: a run has `evolution.generations` generations."""


@compiled
def summarize_fitness(is_mean: bool, fitness: Fitness) -> float:
    """Return the mean of the fitness [agent] if `is_mean` is true, or the maximum."""
    maximum = fitness[0]
    total = 0.0
    for agent in range(fitness.size):
        maximum = max(maximum, fitness[agent])
        total += fitness[agent]
    return total / fitness.size if is_mean else maximum


class TargetFitness(Stop, name="target-fitness"):
    """End a run when the fitness of its population reaches a target."""

    target: float = Field(
        100.0, ge=-1e9, le=1e9, description="Fitness at which a run ends, in units of fitness."
    )
    statistic: Literal["mean", "maximum"] = Field(
        "mean", description="Statistic of the fitness of a generation that must reach the target."
    )

    derived: ClassVar[Any] = {
        "is_mean": lambda part, experiment: part.statistic == "mean",
        # Fitness is float64. A numeric field is float32 in a hook, a derived value is float64.
        "threshold": lambda part, experiment: part.target,
    }

    @staticmethod
    def should_stop(part: Any, lifetimes: Lifetimes, fitness: Fitness, generation: int) -> bool:
        return bool(summarize_fitness(part.is_mean, fitness) >= part.threshold)


class Stagnation(Stop, name="stagnation"):
    """End a run when the fitness of its population no longer increases.

    The run ends after `generations` successive generations in which the statistic is not above the
    largest earlier value.
    """

    generations: int = Field(
        20,
        ge=1,
        le=1_000_000,
        description="Number of generations without an increase after which a run ends.",
    )
    statistic: Literal["mean", "maximum"] = Field(
        "mean", description="Statistic of the fitness of a generation that must increase."
    )

    derived: ClassVar[Any] = {"is_mean": lambda part, experiment: part.statistic == "mean"}
    # Largest statistic of the run, and number of generations since then.
    arrays: ClassVar[Any] = {
        "largest": per_run(fill=-np.inf),
        "stagnant": per_run(dtype="int32"),
    }

    @staticmethod
    def should_stop(part: Any, lifetimes: Lifetimes, fitness: Fitness, generation: int) -> bool:
        value = summarize_fitness(part.is_mean, fitness)
        if value > part.largest[0]:
            part.largest[0] = value
            part.stagnant[0] = 0
        else:
            part.stagnant[0] += 1
        return bool(part.stagnant[0] >= part.generations)


class Fixation(Stop, name="fixation"):
    """End a run when all agents belong to one species, with `evolution.compete = "across"`."""

    @staticmethod
    def should_stop(part: Any, lifetimes: Lifetimes, fitness: Fitness, generation: int) -> bool:
        for agent in range(fitness.size):
            if lifetimes.species[agent] != lifetimes.species[0]:
                return False
        return True


def is_stopped(
    experiment: BaseExperiment,
    lifetimes: Lifetimes,
    fitness: Fitness,
    generation: int,
    run_arrays: RunArrays | None = None,
) -> bool:
    """Return whether the stop part of an experiment ends a run. The part changes `run_arrays`."""
    # Most experiments have no stop part, and need no compiled code for it.
    if experiment.evolution.stop == NoStop.name:
        return False
    part, code = breeding_part(experiment, "stop", run_arrays)
    return bool(cached_jit(call_stop, code)(part, lifetimes, fitness, generation))


def call_stop(part: Any, lifetimes: Lifetimes, fitness: Fitness, generation: int) -> bool:
    """Call the hook `should_stop` of a stop part."""
    return should_stop(part, lifetimes, fitness, generation)  # type: ignore[no-any-return]
