"""The plan of a comparison from the page: its conditions, its size and its expected duration."""

from __future__ import annotations

import math
import shlex
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any, Final, NamedTuple

import tomlkit

from baldwinlab.engine.threads import available_cores
from baldwinlab.experiment import Experiment, ExperimentError, assign
from baldwinlab.experiment import validate as read_experiment
from baldwinlab.experiment.conditions import CONDITIONS, SWEEP, Factors, StudyKind
from baldwinlab.experiment.unused_settings import require_effect
from baldwinlab.lab import Lab, read_body_number
from baldwinlab.lab.sources.limits import check_comparison, check_comparison_runs
from baldwinlab.lab.sources.presets import load_preset
from baldwinlab.models.miniworld.backends.choice import CPU
from baldwinlab.models.miniworld.backends.cpu import BLOCK_WORLDS
from baldwinlab.papers.worlds import find_factors
from baldwinlab.simulation import memory
from baldwinlab.simulation.compilation import compile_experiments
from baldwinlab.simulation.simulate import simulate_histories
from baldwinlab.studies.run import count_agent_steps
from baldwinlab.studies.sweeps import validate_sweep
from baldwinlab.studies.sweeps.design import SWEEP_FILE_NAME, expand_sweep

# Number of workers. One core stays free for the page.
WORKERS: Final = max(1, available_cores() - 1)
# Approximate time to write the record of one run.
SECONDS_PER_RECORD: Final = 0.05
MAX_CACHED_MEASUREMENTS: Final = 16
# The fields of a request for a plan.
FIELDS: Final = ("presets", "preset", "experiment", "fields", "runs", "seed")
_measurement_lock = threading.Lock()


class ComparisonPlan(NamedTuple):
    """A valid comparison of presets, or of the values of one or two fields (a sweep)."""

    kind: StudyKind  # `CONDITIONS` for presets, `SWEEP` for values.
    experiments: Sequence[Experiment]  # The compared presets, or the points of the sweep.
    runs: int  # Number of runs of each experiment.
    seed: int
    subject: str  # The compared objects, for example "3 presets" or "learning.rate".
    command: str  # The command that runs the same study.
    toml: str = ""  # The content of the sweep's file, which `command` reads. "" for presets.
    # The settings that the form changes in all presets, such as "lifetime.steps=100".
    changes: Sequence[str] = ()

    @property
    def factors(self) -> dict[str, Factors]:
        """Return the learner and the map of each preset by name. Points of a sweep have none."""
        if self.kind == SWEEP:
            return {experiment.name: Factors() for experiment in self.experiments}
        return find_factors(self.experiments)

    @property
    def n_runs(self) -> int:
        """Return the number of runs of all experiments together."""
        return len(self.experiments) * self.runs

    @property
    def agent_steps(self) -> int:
        """Return the number of agent-steps of all runs together."""
        return sum(self.runs * count_agent_steps(experiment) for experiment in self.experiments)

    @property
    def disk_bytes(self) -> int:
        """Return the disk space of all runs, in bytes."""
        runs_by_experiment = [(experiment, self.runs) for experiment in self.experiments]
        return memory.estimate_runs(runs_by_experiment, WORKERS, CPU.worlds).disk

    def estimate_seconds(self) -> float:
        """Estimate the duration on this machine, from one simulated generation of each model."""
        # The CPU backend simulates this number of runs in one block.
        n_worlds = min(self.runs, BLOCK_WORLDS)
        seconds_per_step: dict[str, float] = {}
        seconds = SECONDS_PER_RECORD * self.n_runs
        for experiment in self.experiments:
            if experiment.model not in seconds_per_step:
                n_steps = n_worlds * experiment.agent_steps
                measured = _measure_generation(experiment, n_worlds)
                seconds_per_step[experiment.model] = measured / n_steps
            n_steps = self.runs * count_agent_steps(experiment)
            seconds += seconds_per_step[experiment.model] * n_steps
        return seconds / min(WORKERS, self.n_runs)

    def describe_too_few_runs(self) -> str:
        """Return sentences if the runs are too few for any verdict, else ""."""
        # This import takes time.
        from baldwinlab.api.publish.comparisons import MAX_COMPARED_POINTS, describe_planned

        if self.kind == SWEEP and len(self.experiments) > MAX_COMPARED_POINTS:
            return ""
        note = describe_planned(self.factors, self.runs, "Set the number of runs to {runs}.")
        return f"No verdict is possible. {note}" if note else ""


@lru_cache(maxsize=MAX_CACHED_MEASUREMENTS)
def _measure_generation(experiment: Experiment, n_runs: int) -> float:
    single_generation = experiment.replace(evolution={"generations": 1})
    # Two measurements at the same time would slow each other down.
    with _measurement_lock:
        compile_experiments([experiment])
        start_time = time.perf_counter()
        simulate_histories(single_generation, seed=0, runs=range(n_runs))
        return time.perf_counter() - start_time


def make_comparison_plan(body: Mapping[str, Any]) -> ComparisonPlan:
    """Return the plan of a comparison. Raise ValueError for an invalid or too large comparison.

    `body`: the body of the request. It has `runs`, `seed`, a `preset` and the `experiment` that a
    form made from this preset. It also has the compared `presets`, or `fields`: the values of each
    compared field. Without an `experiment`, presets are compared without changes.
    """
    runs = read_body_number(body, "runs", 1)
    seed = read_body_number(body, "seed", 0)
    make = _plan_presets if "presets" in body else _plan_values
    plan = make(body, runs, seed)
    check_comparison(plan.experiments, runs, plan.disk_bytes)
    return plan


def describe_plan(lab: Lab, body: Mapping[str, Any]) -> dict[str, Any]:
    """Return the entries of a plan for the page, or {"problem": MESSAGE} if the plan is invalid."""
    try:
        plan = make_comparison_plan(body)
    except ValueError as error:
        # The page requests a plan while the user types, so an invalid one gets a normal response.
        return {"problem": str(error)}
    return {
        "conditions": len(plan.experiments),
        "runs": plan.n_runs,
        "workers": min(WORKERS, plan.n_runs),
        "disk": plan.disk_bytes,
        "seconds": plan.estimate_seconds(),
        "command": plan.command,
        "toml": plan.toml,
        "changes": list(plan.changes),
        "note": plan.describe_too_few_runs(),
    }


def _plan_presets(body: Mapping[str, Any], runs: int, seed: int) -> ComparisonPlan:
    names = body["presets"]
    is_list = isinstance(names, list) and all(isinstance(name, str) for name in names)
    if not is_list or len(set(names)) < max(2, len(names)):
        raise ValueError("presets must be a list of two or more different names")
    check_comparison_runs(runs * len(names))
    originals = [load_preset(name) for name in names]
    changes = [_format_change(*change) for change in _list_form_changes(body)]
    experiments = [_apply_changes(original, changes) for original in originals]
    try:
        require_effect(experiments, originals)
    except ExperimentError as error:
        raise ValueError(f"no ticked preset uses this change of the form: {error}") from None
    arguments = [*names, "--runs", str(runs), "--seed", str(seed)]
    if changes:
        arguments += ["--set", *changes]
    command = shlex.join(["baldwinlab", "run", *arguments])
    subject = f"{len(names)} presets"
    return ComparisonPlan(CONDITIONS, experiments, runs, seed, subject, command, changes=changes)


def _apply_changes(preset: Experiment, changes: Sequence[str]) -> Experiment:
    """Return a preset with the changes of the form. Raise ValueError if the preset lacks one."""
    try:
        changed: Experiment = assign(preset, changes)
    except ExperimentError as error:
        raise ValueError(
            f"the changes of the form do not apply to {preset.name}: {error}; undo the change in"
            f" the form, or untick {preset.name}"
        ) from None
    return changed


def _format_change(path: str, value: Any) -> str:
    """Return a change as an assignment. Raise ValueError if the new value is None."""
    if value is None:
        raise ValueError(f"{path} has no value in the form; use the value of the preset")
    return f"{path}={_format_toml(value)}"


def _format_toml(value: Any) -> str:
    """Return a value as TOML on one line."""
    if _has_tables(value):
        return f"[{', '.join(map(_format_toml, value))}]"
    if isinstance(value, dict):
        # TOML has no null value, so an entry without a value is left out.
        entries = [
            f"{key} = {_format_toml(item)}" for key, item in value.items() if item is not None
        ]
        return f"{{{', '.join(entries)}}}"
    return str(tomlkit.item(value).as_string())


def _list_form_changes(body: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """Yield the path and the value of each setting of the form that differs from its preset."""
    if "experiment" not in body:
        return
    preset = load_preset(str(body.get("preset", ""))).to_dict()
    experiment = read_experiment(body["experiment"]).to_dict()
    # A different name is not a change of a setting.
    yield from _list_changes(preset, experiment | {"name": preset["name"]})


def _plan_values(body: Mapping[str, Any], runs: int, seed: int) -> ComparisonPlan:
    fields = body.get("fields")
    if not isinstance(fields, dict):
        raise ValueError("fields must contain each compared field with its values")
    changes = {
        path: value for path, value in _list_form_changes(body) if not _is_within(path, fields)
    }
    for path, value in changes.items():
        if value is None or _has_tables(value):
            raise ValueError(
                f"{path} has a change that the file of a sweep cannot contain; use the value of"
                " the preset"
            )
    tree = {"experiment": str(body.get("preset", "")), "runs": runs, "seed": seed}
    if changes:
        tree["set"] = changes
    tree["fields"] = fields
    sweep = validate_sweep(tree, SWEEP_FILE_NAME)
    n_points = math.prod(len(values) for values in sweep.lists.values())
    # The number of runs is checked first, because the points of a large sweep take time to make.
    check_comparison_runs(runs * n_points)
    points = expand_sweep(sweep, Path(SWEEP_FILE_NAME))
    command = f"baldwinlab sweep {SWEEP_FILE_NAME}"
    subject = " and ".join(fields)
    return ComparisonPlan(SWEEP, points, runs, seed, subject, command, tomlkit.dumps(tree))


def _list_changes(base: Any, tree: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """Yield the path and the new value of each field of `tree` that differs in `base`."""
    if _has_tables(tree) and _has_tables(base) and len(tree) == len(base):
        # Two lists of tables are compared table by table, with the index as a key.
        base = dict(enumerate(base))
        tree = dict(enumerate(tree))
    if isinstance(tree, dict):
        for key, value in tree.items():
            base_value = base.get(key) if isinstance(base, dict) else None
            yield from _list_changes(base_value, value, f"{path}.{key}" if path else key)
    elif tree != base:
        yield path, tree


def _has_tables(value: Any) -> bool:
    return isinstance(value, list) and any(isinstance(item, dict) for item in value)


def _is_within(path: str, fields: Mapping[str, Any]) -> bool:
    return any(path == field or path.startswith(f"{field}.") for field in fields)
