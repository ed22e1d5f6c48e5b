"""Cells of the atlas: simulate one experiment and its control, and reduce them to values per run.

The genomes and records of a cell stay in memory. Only means over agents are stored, so that an
atlas of thousands of cells needs a few megabytes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from baldwinlab.analysis.atlas.outcomes import CellData, reduce_cell
from baldwinlab.core.deferred import xr
from baldwinlab.core.records import select_record
from baldwinlab.core.variables import make_dataset
from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.models.miniworld.backends.choice import Backend
from baldwinlab.simulation.records import make_batch
from baldwinlab.simulation.simulate import simulate_histories
from baldwinlab.studies.assays import LIFE_KINDS, Sample, innate
from baldwinlab.studies.assays.catalog import get_assay
from baldwinlab.studies.assays.fork import (
    BRANCH_GENERATIONS,
    HISTORIES,
    POPULATION,
    REGIMES,
    Fork,
)

# Number of intervals between the measured generations.
N_INTERVALS = 20
# Agents of all generations and runs that are simulated together, which limits the memory.
MAX_RECORDED_AGENTS = 4_000_000


class CellTask(NamedTuple):
    """Task that simulates some runs of a cell and returns their values."""

    experiment: Experiment
    runs: tuple[int, ...]

    @property
    def experiments(self) -> tuple[BaseExperiment, ...]:
        """The experiment and its control."""
        return self.experiment, self.experiment.without_learning()

    @property
    def agent_steps(self) -> int:
        """Number of agent-steps of the runs, of their controls and of the measurements."""
        lives_per_generation = len(LIFE_KINDS) - 1
        lives = (
            2 * self.experiment.evolution.generations
            + lives_per_generation * len(choose_generations(self.experiment))
            + len(HISTORIES) * (len(REGIMES) * (BRANCH_GENERATIONS + 1) + 1)
        )
        return len(self.runs) * self.experiment.agent_steps * lives

    def run(
        self, seed: int, directory: Path, backend: Backend, report_progress: Callable[[int], None]
    ) -> xr.Dataset:
        """Return the values of all runs, from `reduce_cell`."""
        progress = _LimitedProgress(self.agent_steps, report_progress)
        parts = [
            measure_runs(self.experiment, seed, runs, directory, progress.report)
            for runs in _split_runs(self.experiment, self.runs)
        ]
        progress.finish()
        return xr.concat(parts, "run", combine_attrs="override")


class _LimitedProgress:
    """Progress whose sum is the announced number of agent-steps."""

    def __init__(self, total: int, report_progress: Callable[[int], None]) -> None:
        self._n_left = total
        self._report_progress = report_progress

    def report(self, agent_steps: int) -> None:
        """Report agent-steps, at most those that are left."""
        n_reported = min(self._n_left, agent_steps)
        self._n_left -= n_reported
        self._report_progress(n_reported)

    def finish(self) -> None:
        """Report all agent-steps that are left."""
        self.report(self._n_left)


def choose_generations(experiment: BaseExperiment) -> list[int]:
    """Return the generations that are measured: equally spaced, and the last one."""
    last = experiment.evolution.generations - 1
    return [*range(0, last, _interval(experiment)), last]


def _interval(experiment: BaseExperiment) -> int:
    return max(1, -(-(experiment.evolution.generations - 1) // N_INTERVALS))


def _split_runs(experiment: BaseExperiment, runs: Sequence[int]) -> Iterator[Sequence[int]]:
    """Yield groups of runs whose records fit into the memory."""
    agents_of_run = experiment.population.size * experiment.evolution.generations
    size = max(1, MAX_RECORDED_AGENTS // agents_of_run)
    for start in range(0, len(runs), size):
        yield runs[start : start + size]


def measure_runs(
    experiment: Experiment,
    seed: int,
    runs: Sequence[int],
    directory: Path,
    report_progress: Callable[[int], None],
) -> xr.Dataset:
    """Simulate runs with and without learning, and return the values of `reduce_cell`.

    `report_progress`: called with the number of simulated agent-steps.
    """
    sample = Sample(directory, seed, experiment, tuple(runs), (), (), report_progress)
    learners, learner_data = _simulate(sample)
    controls, control_data = _simulate(replace(sample, experiment=experiment.without_learning()))
    generations = choose_generations(experiment)
    assayed = _label(
        "innate",
        innate.measure_generations(learners, generations),
        run=list(runs),
        generation=generations,
        life=list(LIFE_KINDS),
        layer=innate.layer_names(experiment),
    )
    forked = _label(
        "fork",
        Fork(POPULATION).measure(replace(learners, control=controls)),
        run=list(runs),
        generation=generations[-1:],
        history=list(HISTORIES),
        regime=list(REGIMES),
    )
    return reduce_cell(CellData(experiment, learner_data, control_data, assayed, forked))


def _simulate(sample: Sample) -> tuple[Sample, xr.Dataset]:
    """Return the sample with its simulated records, and the records as one dataset."""
    interval = _interval(sample.experiment)
    recorded = sample.experiment.replace(record={"genome_every": interval})
    histories = simulate_histories(
        recorded, sample.seed, sample.runs, after_generation=lambda _: sample.report_generation()
    )
    batch = make_batch(histories).to_dataset()
    records = [select_record(batch, index) for index in range(len(histories))]
    return replace(sample, experiment=recorded, records=records), batch


def _label(assay: str, arrays: Mapping[str, Any], **coordinates: Sequence[Any]) -> xr.Dataset:
    """Return the dataset of an assay."""
    data = make_dataset(get_assay(assay).variables, arrays, {})
    return data.assign_coords({name: np.asarray(labels) for name, labels in coordinates.items()})
