"""How large a live run may be: what `baldwinlab run` can do is not always what can be lived while somebody waits."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.models.miniworld.allocation import items_looked_at
from baldwinlab.studies.run import agent_steps_of_run

MOST_RUNS: Final = 50
MOST_GENERATIONS: Final = 10_000
MOST_MEMORY: Final = 500_000_000  # bytes of one live run
MOST_WORK: Final = 20_000_000_000  # weights x agent-steps of a generation: some seconds
MOST_ITEMS: Final = 500_000  # of food
MOST_WITHOUT_LOOK: Final = 30_000_000  # agent-steps x (weights + items looked at): less than a second, in which nothing is obeyed
OF_AN_AGENT: Final = 32  # bytes of an agent's fitness, parents and what it ate
MOST_SWEPT_RUNS: Final = 1_000  # of all points of a sweep
MOST_SWEPT_WORK: Final = (
    1_000_000_000_000  # weights x agent-steps of all of them: some minutes to an hour
)
MOST_SWEPT_DISK: Final = 1_000_000_000  # bytes
AT_WORK: Final = (
    5  # generations' genomes that are held at a time while one lives and the next is bred
)


def memory_of(experiment: BaseExperiment, runs: int) -> int:
    """The bytes that a live run comes to hold, at most."""
    genome = 4 * len(experiment.modules) * experiment.genome_length
    agents = runs * experiment.population.size
    return agents * (experiment.evolution.generations * (genome + OF_AN_AGENT) + AT_WORK * genome)


def steps_at_once(experiment: Experiment, runs: int) -> int:
    """Steps that are lived without a look at what the page wants: as many as, at their slowest, take less than a second."""
    return max(1, MOST_WITHOUT_LOOK // _work_of_step(experiment, runs))


def _work_of_step(experiment: Experiment, runs: int) -> int:
    return (
        runs * experiment.population.size * (experiment.weight_count + items_looked_at(experiment))
    )


def check_size(experiment: BaseExperiment, runs: int) -> None:
    """Raises ValueError for what `baldwinlab run` can do, but not while somebody waits for it."""
    if not 1 <= runs <= MOST_RUNS:
        raise ValueError(f"runs = {runs} must be at least 1 and at most {MOST_RUNS} for a live run")
    generations, agents = experiment.evolution.generations, experiment.population.size
    work = runs * agents * experiment.steps * experiment.weight_count
    items = step = 0
    if isinstance(experiment, Experiment):
        items = runs * sum(region.count for region in experiment.world.food)
        step = _work_of_step(experiment, runs)
    faults = (
        (generations, MOST_GENERATIONS, "generations"),
        (items, MOST_ITEMS, "items of food in all its runs"),
        (work, MOST_WORK, "runs x agents x steps x weights in a generation"),
        (step, MOST_WITHOUT_LOOK, "runs x agents x (weights + items that it looks at) in a step"),
        (
            memory_of(experiment, runs),
            MOST_MEMORY,
            "bytes of memory, which are runs x generations x agents x (weights x 4 + 32)",
        ),
    )
    for value, most, what in faults:
        if value > most:
            raise ValueError(
                f"a live run may have {most:,} {what}, and this one would have {value:,}; `baldwinlab run` does it"
            )


def check_swept_runs(runs: int) -> None:
    """Raises ValueError for a sweep of more runs, of all its points, than the page starts."""
    _require_of_sweep(runs, MOST_SWEPT_RUNS, "runs, of all its points")


def check_sweep(points: Sequence[Experiment], runs: int, disk: int) -> None:
    """Raises ValueError for a sweep that `baldwinlab sweep` can do, but not the page; its runs take so many bytes of `disk`."""
    for point in points:
        check_size(point, runs)
    work = sum(runs * agent_steps_of_run(point) * point.weight_count for point in points)
    _require_of_sweep(work, MOST_SWEPT_WORK, "runs x generations x agents x steps x weights")
    _require_of_sweep(disk, MOST_SWEPT_DISK, "bytes on the disk")


def _require_of_sweep(value: int, most: int, what: str) -> None:
    if value > most:
        raise ValueError(
            f"a sweep from here may have {most:,} {what}, and this would have {value:,}; `baldwinlab sweep` does it"
        )
