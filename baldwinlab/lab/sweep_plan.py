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

from baldwinlab.engine.threads import available_cores
from baldwinlab.experiment import Experiment
from baldwinlab.experiment import validate as read_experiment
from baldwinlab.lab.limits import check_sweep, check_sweep_runs
from baldwinlab.lab.presets import load_preset
from baldwinlab.lab.query import read_body_number
from baldwinlab.models.miniworld.backends.choice import CPU
from baldwinlab.simulation import memory
from baldwinlab.simulation.compilation import compile_experiments
from baldwinlab.simulation.simulate import simulate_histories
from baldwinlab.studies.run import count_agent_steps
from baldwinlab.studies.sweeps.design import SWEEP_FILE_NAME, expand_sweep
from baldwinlab.studies.sweeps.file import Sweep, validate_sweep

# One core stays free for the page.
WORKERS: Final = max(1, available_cores() - 1)
# Approximate time to write the record of a run.
SECONDS_PER_RECORD: Final = 0.05
MAX_CACHED_MEASUREMENTS: Final = 16
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
    def n_runs(self) -> int:
        """Return the number of runs of all points."""
        return len(self.points) * self.sweep.runs

    @property
    def agent_steps(self) -> int:
        """Return the number of agent-steps of all runs."""
        return sum(self.sweep.runs * count_agent_steps(point) for point in self.points)

    @property
    def disk_bytes(self) -> int:
        """Return the disk space of all runs."""
        runs_by_point = [(point, self.sweep.runs) for point in self.points]
        return memory.estimate_runs(runs_by_point, WORKERS, CPU.worlds).disk

    def estimate_seconds(self) -> float:
        """Estimate the duration on this machine, from one simulated generation of a point."""
        point = self.points[0]
        n_worlds = min(self.sweep.runs, CPU.worlds)
        agent_steps_per_generation = n_worlds * point.agent_steps
        n_generations = self.agent_steps / agent_steps_per_generation
        simulation_seconds = _measure_generation(point, n_worlds) * n_generations
        writing_seconds = SECONDS_PER_RECORD * self.n_runs
        return (simulation_seconds + writing_seconds) / min(WORKERS, self.n_runs)


@lru_cache(maxsize=MAX_CACHED_MEASUREMENTS)
def _measure_generation(experiment: Experiment, n_runs: int) -> float:
    """Return the seconds that one generation of several runs takes."""
    single_generation = experiment.replace(evolution={"generations": 1})
    # A measurement at the same time would slow this one down.
    with _measurement_lock:
        compile_experiments([experiment])
        start_time = time.perf_counter()
        simulate_histories(single_generation, seed=0, runs=range(n_runs))
        return time.perf_counter() - start_time


def make_sweep_plan(body: Mapping[str, Any]) -> SweepPlan:
    """Return the plan of a sweep.

    Parameters
    ----------
    body
        The body of the request: `preset`, the `experiment` that was made from it, `runs`, `seed`,
        and `fields` with the values of each swept field.

    Raises
    ------
    ValueError
        If the sweep is not valid or too large for the page.
    MissingError
        If the preset does not exist.

    """
    fields = body.get("fields")
    runs_per_point = read_body_number(body, "runs", 1)
    if not isinstance(fields, dict):
        raise ValueError("fields must contain each swept field with its values")
    preset_name = str(body.get("preset", ""))
    preset = load_preset(preset_name).to_dict()
    experiment = read_experiment(body.get("experiment", {})).to_dict()
    # A different name is not a change of a setting.
    renamed_experiment = experiment | {"name": preset["name"]}
    changes = {
        path: value
        for path, value in _list_changes(preset, renamed_experiment)
        if not _is_within(path, fields)
    }
    seed = read_body_number(body, "seed", 0)
    tree = {"experiment": preset_name, "runs": runs_per_point, "seed": seed}
    if changes:
        tree["set"] = changes
    tree["fields"] = fields
    sweep = validate_sweep(tree, SWEEP_FILE_NAME)
    n_points = math.prod(len(values) for values in sweep.lists.values())
    # The number of runs is checked first, because the points of a large sweep take time to make.
    check_sweep_runs(runs_per_point * n_points)
    points = expand_sweep(sweep, Path(SWEEP_FILE_NAME))
    plan = SweepPlan(sweep, points, toml=tomlkit.dumps(tree))
    check_sweep(plan.points, runs_per_point, plan.disk_bytes)
    return plan


def _list_changes(base: Any, tree: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """Yield the path and the new value of each field in which a tree differs from a base.

    Raise ValueError for a change that a sweep's file cannot contain.
    """
    if _has_tables(tree) and _has_tables(base) and len(tree) == len(base):
        # Two lists of tables are compared table by table, with the index as a key.
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
