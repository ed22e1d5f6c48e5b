"""The form of an exported page: JSON schema, rules between two fields, and refused settings.

A page contains compiled modules. The memory layout of a module (`ModuleLayout`) contains the path
of each setting that the module reads at run time. Any other setting is a constant in the module.
The page can therefore change only the settings of the layout. An experiment with another setting
that differs from the constant is refused, because the browser engine would ignore this setting.
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
from baldwinlab.experiment.registry import BUILT_IN
from baldwinlab.lab.sources.experiment_form import make_schema
from baldwinlab.models.miniworld.backends.browser_layout import COMMON_INHERITANCES, ModuleLayout
from baldwinlab.models.miniworld.backends.wasm_modules import (
    RULES,
    built_in_experiments,
    module_name,
)
from baldwinlab.parts.networks import Network

CONTROL: Final = "learning.control"
# The settings that select a module of the package.
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

    A list of tables, such as `world.food`, is included if the module reads fields of the tables.
    """
    module_experiment = _find_module_experiment(experiment)
    selecting_paths = MODULE_SETTINGS if module_experiment is not experiment else ()
    plan = _plan_layout(module_experiment) or _plan_layout(Experiment())
    return PAGE_SETTINGS.union(selecting_paths, _list_paths(plan))


def _find_module_experiment(experiment: Experiment) -> Experiment:
    """Return the experiment of a module: with added parts, the experiment itself."""
    if any(added_choices(experiment)):
        return experiment
    modules = built_in_experiments()
    name = module_name(experiment)
    # No module has the control "yoked", and none has a control of the rule "none".
    without_control = experiment.replace(learning={"control": "none"})
    return modules[name if name in modules else module_name(without_control)]


@lru_cache(maxsize=16)
def _plan_layout(experiment: Experiment) -> Any:
    """Return the memory layout of an experiment's module, or None if no module is possible."""
    with suppress(RefusedError):
        return ModuleLayout(experiment).plan()
    return None


def _list_paths(plan: Any) -> Iterator[str]:
    if isinstance(plan, dict):
        yield from (plan[key] for key in ("path", "table") if isinstance(plan.get(key), str))
        plan = list(plan.values())
    if isinstance(plan, list):
        for entry in plan:
            yield from _list_paths(entry)


def _list_ignored_settings(experiment: Experiment) -> Iterator[str]:
    """Yield the settings that change results, but that neither the module nor the page reads."""
    module_experiment = _find_module_experiment(experiment)
    is_custom = module_experiment is experiment
    # A setting with the value of `base` is not ignored, because the module has this constant.
    base = Experiment() if is_custom else module_experiment
    base_values = dict(iterate_settings(base.to_dict()))
    known_settings = LABELS.union(MODULE_SETTINGS, list_read_settings(experiment)) - {CONTROL}
    for path, value in iterate_settings(experiment.to_dict()):
        if path in known_settings or value == base_values.get(path):
            continue
        # A module of added parts has the values in the tables of these parts as constants.
        is_compiled = is_custom and (
            path not in base_values or _is_compiled(experiment, path, base_values[path])
        )
        if not is_compiled:
            yield path


def _is_compiled(experiment: Experiment, path: str, default: Any) -> bool:
    """Return whether a module of added parts contains the value of a setting as a constant."""
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


# Checks of the page: the number at `path` must be less than the number at `than`, multiplied by
# `share` if given. With `equal`, it can also be equal. The classes of experiments check the same.
FIELD_RULES: Final = (
    {
        "path": "world.start.x",
        "than": "world.width",
        "message": "agents are born on the map, so the value must be less than",
    },
    {
        "path": "world.start.y",
        "than": "world.height",
        "message": "agents are born on the map, so the value must be less than",
    },
    *(
        {
            "path": path,
            "than": f"world.{span}",
            "share": 0.5,
            "equal": True,
            "message": "the value must be at most half of the map,",
        }
        for path in ("world.start.radius", "senses.visual_radius", "contact.reach")
        for span in ("width", "height")
    ),
    *(
        {
            "path": f"world.food.*.{axis}.0",
            "than": f"world.food.*.{axis}.1",
            "message": "the first edge must be less than the second edge,",
        }
        for axis in ("x", "y")
    ),
    *(
        {
            "path": f"world.food.*.{axis}.1",
            "than": f"world.{span}",
            "equal": True,
            "message": "food is on the map, so the value must be at most",
        }
        for axis, span in (("x", "width"), ("y", "height"))
    ),
)


def list_choosable_parts(experiment: Experiment) -> dict[str, list[str]]:
    """Return the names of the parts that a user of the page can choose, by the path of the field.

    The compiled modules of the page contain these parts.
    """
    custom_selection = experiment.evolution.selection
    selections = list(BUILT_IN["selection"])
    if custom_selection not in selections:
        selections.append(custom_selection)
    parts_by_path = {"evolution.selection": selections}
    if experiment.evolution.inheritance in COMMON_INHERITANCES:
        parts_by_path["evolution.inheritance"] = list(COMMON_INHERITANCES)
    if not any(added_choices(experiment)):
        parts_by_path["learning.rule"] = list(BUILT_IN["learning rule"])
        # A module contains the code of a control, so a control is chosen like a part.
        parts_by_path[CONTROL] = list(dict.fromkeys(control for _, control in RULES))
    return parts_by_path


def make_form_schema(experiment: Experiment) -> Any:
    """Return the JSON schema of the form, with constants for fields that the page cannot change."""
    schema = make_schema(type(experiment))
    choosable_parts = list_choosable_parts(experiment)
    tree = experiment.to_dict()
    editable_paths = {"name", *choosable_parts, *list_read_settings(experiment)}
    fixed_paths = [path for path, _ in iterate_settings(tree) if path not in editable_paths]
    if any(added_choices(experiment)):
        fixed_paths += ["name", *_list_compiled_fields(experiment)]
    for path, part_names in choosable_parts.items():
        properties, name = find_field(schema, path)
        properties[name] |= {"enum": part_names}
    # A dictionary contains each path once.
    for path in dict.fromkeys(fixed_paths):
        properties, name = find_field(schema, path)
        value: Any = tree
        for key in path.split("."):
            value = value[key]
        properties[name] = {"const": value}
    return schema


def find_field(schema: Any, path: str) -> Any:
    """Return the mutable `properties` that contain the field at a path, and the field's name."""
    node = schema
    *tables, name = path.split(".")
    for table in tables:
        child = node["properties"][table]
        node = schema["$defs"][child["$ref"].rpartition("/")[2]] if "$ref" in child else child
    return node["properties"], name


def _list_compiled_fields(experiment: Experiment) -> Iterator[str]:
    """Yield the fields that are constants in a module of added parts."""
    network = type(experiment.part("network.kind"))
    # The page can check the size of a network only for the default layers.
    if network.layers is not Network.layers or network.has_graph_genomes:
        yield "network.hidden"
    for path, value in iterate_settings(experiment.to_dict()):
        if isinstance(value, int | float) and not isinstance(value, bool):
            changed = _change_value(experiment, path, value)
            # A field that is a constant in the module changes the layout.
            if changed is not None and _plan_layout(changed) != _plan_layout(experiment):
                yield path


def _change_value(experiment: Experiment, path: str, value: float) -> Experiment | None:
    """Return the experiment with another valid number at a path, or None if all are invalid."""
    for candidate in (value / 2, value * 2, value + 1, value - 1):
        change = int(candidate) if isinstance(value, int) else candidate
        with suppress(ExperimentError):
            return experiment.replace(**nest_settings({path: change}))
    return None
