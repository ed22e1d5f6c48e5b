"""Settings that the browser engine reads, and the refusal of settings that it would ignore.

The memory layout of a module (`ModuleLayout`) contains the path of each setting that its numbers
depend on. A setting without such a path has the value of the experiment from which the module was
compiled.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from functools import lru_cache
from typing import Any, Final

from baldwinlab.core.errors import RefusedError
from baldwinlab.experiment import Experiment, ExperimentError
from baldwinlab.experiment.added_parts import added_choices
from baldwinlab.experiment.class_builder import choosing_fields
from baldwinlab.experiment.fields import shorten
from baldwinlab.experiment.paths import iterate_settings, nest_settings
from baldwinlab.models.miniworld.backends.browser_layout import ModuleLayout
from baldwinlab.models.miniworld.backends.wasm_modules import built_in_experiments, module_name

CONTROL: Final = "learning.control"
# The package contains a compiled module for each combination of these settings.
MODULE_SETTINGS: Final = ("learning.rule", CONTROL, "lifetime.update")
# Settings that the code of the page reads.
PAGE_SETTINGS: Final = frozenset({"evolution.generations"})
# Settings that do not change the results of a run.
LABELS: Final = frozenset({"name", "record.genome_every"})


def require_browser_settings(experiment: Experiment) -> None:
    """Raise RefusedError if the browser engine would ignore a setting of an experiment."""
    values = dict(iterate_settings(experiment.to_dict()))
    for path in _list_ignored_settings(experiment):
        raise RefusedError(
            f"{experiment.name} cannot run in a browser: {path} = {shorten(repr(values[path]))} is"
            " set, which only the engine in Python supports; leave it out, or start a live run in"
            " `baldwinlab lab`"
        )


def list_read_settings(experiment: Experiment) -> frozenset[str]:
    """Return the paths of the settings that a page reads at run time, or that select a module.

    A list of tables, such as `world.food`, is included if the module reads its columns.
    """
    module_experiment = _find_module_experiment(experiment)
    selecting_paths = MODULE_SETTINGS if module_experiment is not experiment else ()
    plan = _plan_layout(module_experiment) or _plan_layout(Experiment())
    return PAGE_SETTINGS.union(selecting_paths, _list_paths(plan))


def _find_module_experiment(experiment: Experiment) -> Experiment:
    """Return the experiment from which the module of an experiment is compiled."""
    if any(added_choices(experiment)):
        return experiment
    modules = built_in_experiments()
    name = module_name(experiment)
    # No module has the yoked control. A rule that learns nothing has no control.
    without_control = experiment.replace(learning={"control": "none"})
    return modules[name if name in modules else module_name(without_control)]


@lru_cache(maxsize=16)
def _plan_layout(experiment: Experiment) -> Any:
    """Return the memory layout of the module of an experiment, or None if it has none."""
    with suppress(RefusedError):
        return ModuleLayout(experiment).plan()
    return None


def _list_paths(plan: Any) -> Iterator[str]:
    """Yield the paths of settings in a memory layout."""
    if isinstance(plan, dict):
        yield from (plan[key] for key in ("path", "table") if isinstance(plan.get(key), str))
        plan = list(plan.values())
    if isinstance(plan, list):
        for entry in plan:
            yield from _list_paths(entry)


def _list_ignored_settings(experiment: Experiment) -> Iterator[str]:
    """Yield the settings that neither the module nor the page reads, and that change results."""
    module_experiment = _find_module_experiment(experiment)
    is_custom = module_experiment is experiment
    base = Experiment() if is_custom else module_experiment
    base_values = dict(iterate_settings(base.to_dict()))
    known_settings = LABELS.union(MODULE_SETTINGS, list_read_settings(experiment)) - {CONTROL}
    for path, value in iterate_settings(experiment.to_dict()):
        if path in known_settings or value == base_values.get(path):
            continue
        # The module of custom parts contains the values of their tables.
        is_compiled = is_custom and (
            path not in base_values or _is_compiled(experiment, path, base_values[path])
        )
        if not is_compiled:
            yield path


def _is_compiled(experiment: Experiment, path: str, default: Any) -> bool:
    """Return whether the module of custom parts depends on a setting that it does not read."""
    if path == CONTROL:
        return False
    if path in {choice for choice, _, _ in choosing_fields(type(experiment))}:
        compiled_parts = {getattr(hook, "part", None) for hook in ModuleLayout(experiment).hooks()}
        return all(type(part) in compiled_parts for part in experiment.parts(path))
    try:
        other_experiment = experiment.replace(**nest_settings({path: default}))
    except ExperimentError:
        return False
    plan, other_plan = _plan_layout(experiment), _plan_layout(other_experiment)
    return plan != other_plan if plan else other_plan is None
