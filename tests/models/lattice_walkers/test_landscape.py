"""Landscapes on a line: climbing and neighborhoods against plain Python."""

from __future__ import annotations

import numpy as np
import pytest

from baldwinlab.models.lattice_walkers.landscape import (
    average_neighborhood,
    climb,
    make_landscape,
)


def climb_in_python(fitness: list[float], position: int, steps: int) -> int:
    for _ in range(steps):
        neighbors = [q for q in (position + 1, position - 1) if 0 <= q < len(fitness)]
        best = max(neighbors, key=lambda q: fitness[q])
        if fitness[best] <= fitness[position]:
            break
        position = best
    return position


@pytest.mark.parametrize("steps", [0, 1, 2, 5])
def test_agents_climb_to_the_fitter_neighbor(steps: int) -> None:
    for run in range(20):
        fitness = make_landscape(3, run, 12, 0.05, 0.5)
        expected = [climb_in_python(fitness.tolist(), position, steps) for position in range(12)]
        assert climb(fitness, steps).tolist() == expected


def test_random_plasticity_has_the_mean_fitness_of_the_neighborhood() -> None:
    fitness = np.array([1.0, 2.0, 6.0, 3.0])
    assert average_neighborhood(fitness, 0).tolist() == fitness.tolist()
    assert average_neighborhood(fitness, 1) == pytest.approx([4 / 3, 3, 11 / 3, 4])
    assert average_neighborhood(fitness, 2) == pytest.approx([11 / 5, 13 / 5, 3, 17 / 5])


def test_without_roughness_fitness_rises_by_the_slope() -> None:
    assert make_landscape(3, 0, 8, 0.15, 0.0) == pytest.approx(1.15 ** np.arange(8))


def test_a_landscape_depends_on_the_run_and_has_the_declared_changes() -> None:
    landscapes = np.array([make_landscape(3, run, 200, 0.15, 0.4) for run in range(20)])
    changes = landscapes[:, 1:] / landscapes[:, :-1] - 1
    assert changes.min() > -0.25 and changes.max() < 0.55
    assert changes.mean() == pytest.approx(0.15, abs=4 * 0.4 / np.sqrt(3 * changes.size))
    assert len(np.unique(landscapes[:, 1])) == 20
