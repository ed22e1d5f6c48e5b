"""Limits of live runs and of sweeps from the page.

They are lower than those of `baldwinlab run` and `baldwinlab sweep`, because a user waits.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.models.miniworld.allocation import estimate_scanned_items
from baldwinlab.studies.run import count_agent_steps

MAX_RUNS: Final = 50
MAX_GENERATIONS: Final = 10_000
MAX_RUN_BYTES: Final = 500_000_000  # memory of one live run
# Weights x agent-steps of one generation, which takes some seconds.
MAX_GENERATION_WORK: Final = 20_000_000_000
MAX_FOOD_ITEMS: Final = 500_000
# Agent-steps x (weights + visible items) between two checks for commands. It takes less than a
# second.
MAX_UNINTERRUPTED_WORK: Final = 30_000_000
BYTES_PER_AGENT: Final = 32  # fitness, parents and eaten items of one agent
# Runs of all points.
MAX_SWEEP_RUNS: Final = 1_000
# Weights x agent-steps of all runs, which take up to an hour.
MAX_SWEEP_WORK: Final = 1_000_000_000_000
MAX_SWEEP_DISK_BYTES: Final = 1_000_000_000
# The number of generations whose genomes are in memory during simulation and reproduction.
GENERATIONS_IN_USE: Final = 5


def estimate_memory(experiment: BaseExperiment, runs: int) -> int:
    """Return an upper estimate of the memory of a live run, in bytes."""
    genome_bytes = 4 * len(experiment.modules) * experiment.genome_length
    agents = runs * experiment.population.size
    history_bytes = experiment.evolution.generations * (genome_bytes + BYTES_PER_AGENT)
    return agents * (history_bytes + GENERATIONS_IN_USE * genome_bytes)


def count_uninterrupted_steps(experiment: Experiment, runs: int) -> int:
    """Return the number of steps between two checks for commands."""
    return max(1, MAX_UNINTERRUPTED_WORK // _estimate_step_work(experiment, runs))


def _estimate_step_work(experiment: Experiment, runs: int) -> int:
    work_of_agent = experiment.weight_count + estimate_scanned_items(experiment)
    return runs * experiment.population.size * work_of_agent


def check_size(experiment: BaseExperiment, runs: int) -> None:
    """Raise ValueError if a live run would be too large."""
    if not 1 <= runs <= MAX_RUNS:
        raise ValueError(f"runs = {runs} must be at least 1 and at most {MAX_RUNS} for a live run")
    agents = experiment.population.size
    work = runs * agents * experiment.steps * experiment.weight_count
    items = 0
    step_work = 0
    if isinstance(experiment, Experiment):
        items = runs * sum(region.count for region in experiment.world.food)
        step_work = _estimate_step_work(experiment, runs)
    memory = estimate_memory(experiment, runs)
    memory_unit = "bytes of memory (runs x generations x agents x (weights x 4 + 32))"
    quantities = (
        (experiment.evolution.generations, MAX_GENERATIONS, "generations"),
        (items, MAX_FOOD_ITEMS, "food items in all runs"),
        (work, MAX_GENERATION_WORK, "runs x agents x steps x weights in a generation"),
        (step_work, MAX_UNINTERRUPTED_WORK, "runs x agents x (weights + visible items) in a step"),
        (
            memory,
            MAX_RUN_BYTES,
            memory_unit,
        ),
    )
    for value, limit, unit in quantities:
        if value > limit:
            raise ValueError(
                f"a live run can have at most {limit:,} {unit}, and this one would have {value:,};"
                " use `baldwinlab run`"
            )


def check_sweep_runs(runs: int) -> None:
    """Raise ValueError if a sweep has too many runs, over all points, for the page."""
    _check_sweep_limit(runs, MAX_SWEEP_RUNS, "runs over all points")


def check_sweep(points: Sequence[Experiment], runs: int, disk: int) -> None:
    """Raise ValueError if a sweep is too large for the page.

    Parameters
    ----------
    points
        The experiments of the sweep.
    runs
        The number of runs of each point.
    disk
        The required disk space, in bytes.

    """
    for point in points:
        check_size(point, runs)
    work = sum(runs * count_agent_steps(point) * point.weight_count for point in points)
    _check_sweep_limit(work, MAX_SWEEP_WORK, "runs x generations x agents x steps x weights")
    _check_sweep_limit(disk, MAX_SWEEP_DISK_BYTES, "bytes of disk space")


def _check_sweep_limit(value: int, limit: int, unit: str) -> None:
    if value > limit:
        raise ValueError(
            f"a sweep from the page can have at most {limit:,} {unit}, and this one would have"
            f" {value:,}; use `baldwinlab sweep`"
        )
