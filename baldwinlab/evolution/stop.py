"""Conditions under which a run ends before its last generation."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any, ClassVar, Literal

import numpy as np
import numpy.typing as npt
from pydantic import Field

from baldwinlab.engine.elements import for_element
from baldwinlab.engine.jit import cached_jit, compiled
from baldwinlab.engine.phases import per_run
from baldwinlab.evolution.rng_key import Fitness, split_runs
from baldwinlab.experiment import BaseExperiment
from baldwinlab.parts.breeding import RunArrays, Stop, list_part_calls, should_stop
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


def find_stopped_runs(
    experiment: BaseExperiment,
    lifetimes: Lifetimes,
    fitness: Fitness,
    generation: int,
    run_arrays: Sequence[RunArrays] | None = None,
) -> npt.NDArray[np.bool_]:
    """Return which runs the stop part of an experiment ends, [run].

    `fitness` [run, agent]. `run_arrays` [run]: the part changes them.
    """
    n_runs, n_agents = fitness.shape
    is_stopped = np.zeros(n_runs, np.bool_)
    # Most experiments have no stop part, and need no compiled code for it.
    if experiment.evolution.stop == NoStop.name:
        return is_stopped
    for call in list_part_calls(experiment, "stop", n_runs, run_arrays):
        stop_range = cached_jit(stop_runs, call.code)
        arguments = (call.values, lifetimes, fitness, generation, is_stopped)
        split_runs(call.runs, n_agents, partial(stop_range, *arguments))
    return is_stopped


@compiled
def _stop(
    part: Any,
    lifetimes: Lifetimes,
    fitness: Fitness,
    generation: int,
    is_stopped: npt.NDArray[np.bool_],
) -> None:
    is_stopped[0] = should_stop(part, lifetimes, fitness, generation)


_stop_run = for_element(_stop)


def stop_runs(
    part: Any,
    lifetimes: Lifetimes,
    fitness: Fitness,
    generation: int,
    is_stopped: npt.NDArray[np.bool_],
    first_run: int,
    end_run: int,
) -> None:
    """Fill `is_stopped` [run] of a range of runs by the hook `should_stop` of a stop part."""
    for run in range(first_run, end_run):
        _stop_run(part, lifetimes, run, fitness[run], generation, is_stopped[run : run + 1])
