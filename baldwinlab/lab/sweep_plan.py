"""The plan of a sweep from the page: its file, its points, its size and its expected duration."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Iterator, Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any, Final, NamedTuple

import tomlkit

from baldwinlab.experiment import Experiment
from baldwinlab.experiment import validate as read_experiment
from baldwinlab.lab.limits import check_sweep, check_sweep_runs
from baldwinlab.lab.presets import load_preset
from baldwinlab.lab.query import read_body_number
from baldwinlab.models.miniworld.backends.choice import CPU
from baldwinlab.simulation import memory
from baldwinlab.simulation.compilation import available_cores, compile_experiments
from baldwinlab.simulation.simulate import simulate_histories
from baldwinlab.studies.run import count_agent_steps
from baldwinlab.studies.sweeps.design import SWEEP_FILE_NAME, expand_sweep
from baldwinlab.studies.sweeps.file import Sweep, validate_sweep

# One core stays free for the page.
WORKERS: Final = max(1, available_cores() - 1)
# Approximate time to write a run.
SECONDS_PER_WRITE: Final = 0.05
_measurement_lock = threading.Lock()


class SweepPlan(NamedTuple):
    """A sweep that can be started.

    Parameters
    ----------
    sweep
        The sweep.
    points
        The experiments of the sweep.
    toml
        The content of the sweep's file.

    """

    sweep: Sweep
    points: list[Experiment]
    toml: str

    @property
    def runs(self) -> int:
        """Return the number of runs of all points."""
        return len(self.points) * self.sweep.runs

    @property
    def agent_steps(self) -> int:
        """Return the number of agent-steps of all runs."""
        return sum(self.sweep.runs * count_agent_steps(point) for point in self.points)

    @property
    def disk(self) -> int:
        """Return the disk space of all runs, in bytes."""
        runs = [(point, self.sweep.runs) for point in self.points]
        return memory.estimate_runs(runs, WORKERS, CPU.worlds).disk

    def estimate_seconds(self) -> float:
        """Estimate the duration on this machine, from one simulated generation of a point."""
        point = self.points[0]
        worlds = min(self.sweep.runs, CPU.worlds)
        generations = self.agent_steps / (worlds * point.steps * point.population.size)
        simulation = _measure_generation(point, worlds) * generations
        writing = SECONDS_PER_WRITE * self.runs
        return (simulation + writing) / min(WORKERS, self.runs)


@lru_cache(maxsize=16)
def _measure_generation(experiment: Experiment, runs: int) -> float:
    """Return the seconds that one generation takes."""
    with _measurement_lock:
        compile_experiments([experiment])
        start = time.perf_counter()
        simulate_histories(experiment.replace(evolution={"generations": 1}), 0, range(runs))
        return time.perf_counter() - start


def make_sweep_plan(order: Mapping[str, Any]) -> SweepPlan:
    """Return the plan of a sweep.

    Parameters
    ----------
    order
        The request: `preset`, the `experiment` that was made from it, `runs`, `seed`, and `fields`
        with the values of each swept field.

    Raises
    ------
    ValueError
        If the sweep is not valid or too large for the page.
    MissingError
        If the preset does not exist.

    """
    fields = order.get("fields")
    runs = read_body_number(order, "runs", 1)
    if not isinstance(fields, dict):
        raise ValueError("fields must contain each swept field with its values")
    name = str(order.get("preset", ""))
    preset = load_preset(name).to_dict()
    experiment = read_experiment(order.get("experiment", {})).to_dict()
    changes = {
        path: value
        for path, value in _list_changes(preset, experiment | {"name": preset["name"]})
        if not _is_within(path, fields)
    }
    tree = {"experiment": name, "runs": runs, "seed": read_body_number(order, "seed", 0)}
    if changes:
        tree["set"] = changes
    tree["fields"] = fields
    sweep = validate_sweep(tree, SWEEP_FILE_NAME)
    n_points = math.prod(len(values) for values in sweep.lists.values())
    check_sweep_runs(runs * n_points)
    plan = SweepPlan(sweep, expand_sweep(sweep, Path(SWEEP_FILE_NAME)), tomlkit.dumps(tree))
    check_sweep(plan.points, runs, plan.disk)
    return plan


def _list_changes(base: Any, tree: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """Yield the path and the new value of each field in which a tree differs from a base.

    Raise ValueError for a change that a sweep's file cannot contain.
    """
    if _has_tables(tree) and _has_tables(base) and len(tree) == len(base):
        base = dict(enumerate(base))
        tree = dict(enumerate(tree))
    if isinstance(tree, dict):
        for key, value in tree.items():
            base_value = base.get(key) if isinstance(base, dict) else None
            yield from _list_changes(base_value, value, f"{path}.{key}" if path else key)
    elif tree != base:
        if tree is None or _has_tables(tree):
            raise ValueError(
                f"{path} has a change that the file of a sweep cannot contain; use the value of"
                " the preset"
            )
        yield path, tree


def _has_tables(value: Any) -> bool:
    return isinstance(value, list) and any(isinstance(item, dict) for item in value)


def _is_within(path: str, fields: Mapping[str, Any]) -> bool:
    return any(path == field or path.startswith(f"{field}.") for field in fields)
