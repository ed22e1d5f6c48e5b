"""Limits of live runs and of comparisons from the page.

`baldwinlab run` and `baldwinlab sweep` accept larger studies, because no user waits at a page.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.models.miniworld.grid import estimate_scanned_items
from baldwinlab.studies.run import count_agent_steps

MAX_RUNS: Final = 50
MAX_GENERATIONS: Final = 10_000
# Memory of one live run.
MAX_RUN_BYTES: Final = 500_000_000
# Agent-steps x weights of one generation. A generation with this work takes some seconds.
MAX_GENERATION_WORK: Final = 20_000_000_000
# Number of food items in all runs.
MAX_FOOD_ITEMS: Final = 500_000
# Agent-steps x (weights + visible items) between two checks for commands of a page. This work
# takes less than a second.
MAX_UNINTERRUPTED_WORK: Final = 30_000_000
# Size of the fitness, the parents and the eaten items of one agent.
BYTES_PER_AGENT: Final = 32
FLOAT32_BYTES: Final = 4
# Number of runs of all conditions together.
MAX_COMPARISON_RUNS: Final = 1_000
# Agent-steps x weights of all runs. Runs with this work take up to an hour.
MAX_COMPARISON_WORK: Final = 1_000_000_000_000
MAX_COMPARISON_DISK_BYTES: Final = 1_000_000_000
# Simulation and reproduction need the memory of this many copies of a generation's genomes.
GENERATIONS_IN_USE: Final = 5


def estimate_memory(experiment: BaseExperiment, n_runs: int) -> int:
    """Return an upper estimate of the memory of a live run, in bytes."""
    genome_bytes = FLOAT32_BYTES * len(experiment.modules) * experiment.genome_length
    n_agents = n_runs * experiment.population.size
    history_bytes = experiment.evolution.generations * (genome_bytes + BYTES_PER_AGENT)
    return n_agents * (history_bytes + GENERATIONS_IN_USE * genome_bytes)


def count_uninterrupted_steps(experiment: Experiment, n_runs: int) -> int:
    """Return the number of steps between two checks for commands."""
    return max(1, MAX_UNINTERRUPTED_WORK // _estimate_step_work(experiment, n_runs))


def _estimate_step_work(experiment: Experiment, n_runs: int) -> int:
    """Return agents x (weights + visible items) of one step of all runs."""
    work_per_agent = experiment.weight_count + estimate_scanned_items(experiment)
    n_agents = experiment.population.size * experiment.lifetime.repeats
    return n_runs * n_agents * work_per_agent


def check_size(experiment: BaseExperiment, n_runs: int) -> None:
    """Raise ValueError if a live run would exceed a limit."""
    if not 1 <= n_runs <= MAX_RUNS:
        raise ValueError(
            f"runs = {n_runs} must be at least 1 and at most {MAX_RUNS} for a live run"
        )
    _check_run_limit(experiment.evolution.generations, MAX_GENERATIONS, "generations")
    if isinstance(experiment, Experiment):
        n_worlds = n_runs * experiment.population.worlds * experiment.lifetime.repeats
        n_items = n_worlds * sum(region.count for region in experiment.world.food)
        _check_run_limit(n_items, MAX_FOOD_ITEMS, "food items in all runs")
    _check_run_limit(
        n_runs * experiment.agent_steps * experiment.weight_count,
        MAX_GENERATION_WORK,
        "runs x agents x steps x weights in a generation",
    )
    if isinstance(experiment, Experiment):
        _check_run_limit(
            _estimate_step_work(experiment, n_runs),
            MAX_UNINTERRUPTED_WORK,
            "runs x agents x (weights + visible items) in a step",
        )
    _check_run_limit(
        estimate_memory(experiment, n_runs),
        MAX_RUN_BYTES,
        "bytes of memory (runs x generations x agents x (weights x 4 + 32))",
    )


def _check_run_limit(value: int, limit: int, unit: str) -> None:
    if value > limit:
        raise ValueError(
            f"a live run can have at most {limit:,} {unit}, and this one would have {value:,};"
            " use `baldwinlab run`"
        )


def check_comparison_runs(n_runs: int) -> None:
    """Raise ValueError if all conditions together have too many runs for the page."""
    _check_comparison_limit(n_runs, MAX_COMPARISON_RUNS, "runs of all conditions")


def check_comparison(
    experiments: Sequence[Experiment], runs_per_experiment: int, disk_bytes: int
) -> None:
    """Raise ValueError if a comparison is too large for the page."""
    for experiment in experiments:
        check_size(experiment, runs_per_experiment)
    work_per_run = sum(
        count_agent_steps(experiment) * experiment.weight_count for experiment in experiments
    )
    _check_comparison_limit(
        runs_per_experiment * work_per_run,
        MAX_COMPARISON_WORK,
        "runs x generations x agents x steps x weights",
    )
    _check_comparison_limit(disk_bytes, MAX_COMPARISON_DISK_BYTES, "bytes of disk space")


def _check_comparison_limit(value: int, limit: int, unit: str) -> None:
    if value > limit:
        raise ValueError(
            f"a comparison from the page can have at most {limit:,} {unit}, and this one would have"
            f" {value:,}; use `baldwinlab run` or `baldwinlab sweep`"
        )
