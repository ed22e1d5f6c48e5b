"""What a sweep that a page asks for is: its file, its points, how large it is and about how long it takes here."""

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
from baldwinlab.experiment import validate as experiment_of
from baldwinlab.lab.limits import check_sweep, check_swept_runs
from baldwinlab.lab.query import whole_number
from baldwinlab.lab.studies import load_preset
from baldwinlab.models.miniworld.backends.choice import CPU
from baldwinlab.simulation import memory
from baldwinlab.simulation.compilation import available_cores, compile_experiments
from baldwinlab.simulation.simulate import simulate_histories
from baldwinlab.studies.run import agent_steps_of_run
from baldwinlab.studies.sweeps.design import FILE, experiments
from baldwinlab.studies.sweeps.file import Sweep, validate

WORKERS: Final = max(1, available_cores() - 1)  # a core is left to the page
STORING: Final = 0.05  # seconds to write a run, about
_measuring = threading.Lock()


class Plan(NamedTuple):
    """A sweep that can be started."""

    sweep: Sweep
    points: list[Experiment]
    toml: str  # its file

    @property
    def runs(self) -> int:
        """Of all points."""
        return len(self.points) * self.sweep.runs

    @property
    def agent_steps(self) -> int:
        return sum(self.sweep.runs * agent_steps_of_run(point) for point in self.points)

    @property
    def disk(self) -> int:
        """Bytes that its runs take."""
        return memory.estimate_runs(
            [(point, self.sweep.runs) for point in self.points], WORKERS, CPU.worlds
        ).disk

    def seconds(self) -> float:
        """About how long it takes here, by how long a generation of its first point takes, which is lived for that."""
        first, worlds = self.points[0], min(self.sweep.runs, CPU.worlds)
        generations = self.agent_steps / (worlds * first.steps * first.population.size)
        living = _seconds_of_generation(first, worlds) * generations + STORING * self.runs
        return living / min(WORKERS, self.runs)


@lru_cache(maxsize=16)
def _seconds_of_generation(experiment: Experiment, runs: int) -> float:
    with _measuring:
        compile_experiments([experiment])
        began = time.perf_counter()
        simulate_histories(experiment.replace(evolution={"generations": 1}), 0, range(runs))
        return time.perf_counter() - began


def plan_of(order: Mapping[str, Any]) -> Plan:
    """What a page asks for: a `preset`, the `experiment` made of it, runs, seed, and the values of each of the `fields` swept.

    Raises ValueError, with a sentence for the user, where that cannot be, or not from the page; MissingError for a preset.
    """
    preset, fields, runs = (
        str(order.get("preset", "")),
        order.get("fields"),
        whole_number(order, "runs", 1),
    )
    if not isinstance(fields, dict):
        raise ValueError("fields must name each field that is swept, with its values")
    there, here = (
        load_preset(preset).to_dict(),
        experiment_of(order.get("experiment", {})).to_dict(),
    )
    changed = {
        path: value
        for path, value in _changes(there, here | {"name": there["name"]})
        if not _within(path, fields)
    }
    tree = {"experiment": preset, "runs": runs, "seed": whole_number(order, "seed", 0)} | (
        {"set": changed} if changed else {}
    )
    sweep = validate(tree | {"fields": fields}, FILE)
    check_swept_runs(runs * math.prod(map(len, sweep.lists.values())))
    plan = Plan(sweep, experiments(sweep, Path(FILE)), tomlkit.dumps(tree | {"fields": fields}))
    check_sweep(plan.points, runs, plan.disk)
    return plan


def _changes(there: Any, here: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """What must be set in one tree for it to be another, by path. Raises ValueError for what a sweep's file cannot say."""
    if _tables(here) and _tables(there) and len(here) == len(there):
        there, here = (dict(enumerate(tree)) for tree in (there, here))
    if isinstance(here, dict):
        for key, value in here.items():
            yield from _changes(
                there.get(key) if isinstance(there, dict) else None,
                value,
                f"{path}.{key}" if path else key,
            )
    elif here != there:
        if here is None or _tables(here):
            raise ValueError(
                f"{path} has been changed in a way that a sweep's file cannot say; leave it as the preset has it"
            )
        yield path, here


def _tables(value: Any) -> bool:
    return isinstance(value, list) and any(isinstance(one, dict) for one in value)


def _within(path: str, fields: Mapping[str, Any]) -> bool:
    return any(path == field or path.startswith(f"{field}.") for field in fields)
