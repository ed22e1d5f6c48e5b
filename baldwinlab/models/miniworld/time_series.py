"""Time series within a lifetime: sums over the agents of a run in windows of steps."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from baldwinlab.experiment import Experiment
from baldwinlab.models.miniworld.backends.choice import Batch
from baldwinlab.models.miniworld.regions import eaten_energies

# [population, window].
Series = npt.NDArray[np.float64]


def simulate_windows(experiment: Experiment, batch: Batch, n_runs: int) -> Mapping[str, Series]:
    """Simulate a lifetime and return the time series of `record.every`, each [run, window]."""
    steps = experiment.lifetime.steps
    interval = experiment.record.every or steps
    # A batch without items has arrays of one region.
    item_energies = np.array(eaten_energies(experiment) or [0.0], np.float64)
    alive: list[npt.NDArray[np.float64]] = []
    births: list[npt.NDArray[np.float64]] = []
    energies: list[npt.NDArray[np.float64]] = []
    for first_step in range(0, steps, interval):
        batch.simulate(first_step, min(first_step + interval, steps))
        eaten = batch.eaten_in_life()
        alive.append(_count_alive(experiment, batch, len(eaten)))
        births.append(_count_births(experiment, batch, len(eaten)))
        energies.append(eaten.sum(axis=1, dtype=np.float64) @ item_energies)
    totals = {"births": births, "energy_gained": energies}
    series = {name: np.diff(np.stack(values), axis=0, prepend=0) for name, values in totals.items()}
    series["agents_alive"] = np.stack(alive)
    # The populations of a batch are ordered by repeat, then by run.
    return {
        name: np.asarray(values.T.reshape(-1, n_runs, len(values)).mean(axis=0))
        for name, values in series.items()
    }


def _count_alive(
    experiment: Experiment, batch: Batch, n_populations: int
) -> npt.NDArray[np.float64]:
    """Return the number of agents that are alive, [population]."""
    size = experiment.population.size
    if not experiment.has_deaths:
        return np.full(n_populations, float(size))
    lanes = slice(n_populations * size)
    is_alive = batch.state.alive[0, lanes].reshape(n_populations, size)
    return np.asarray(is_alive.sum(axis=1), np.float64)


def _count_births(
    experiment: Experiment, batch: Batch, n_populations: int
) -> npt.NDArray[np.float64]:
    """Return the number of births in this lifetime, [population]."""
    if not experiment.births_in_life:
        return np.zeros(n_populations)
    # Each population has one world. A batch on the GPU has further worlds after them.
    return np.asarray(batch.state.birth_count[:n_populations].sum(axis=1), np.float64)
