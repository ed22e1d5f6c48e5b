"""The form of an exported page: its JSON schema, and rules between two fields.

The page can change only settings that its compiled modules read at run time.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from typing import Any, Final

from baldwinlab.experiment import Experiment, ExperimentError
from baldwinlab.experiment.added_parts import added_choices
from baldwinlab.experiment.paths import iterate_settings
from baldwinlab.experiment.registry import BUILT_IN
from baldwinlab.lab.pages.browser_settings import CONTROL, list_read_settings
from baldwinlab.lab.sources.experiment_form import make_schema
from baldwinlab.models.miniworld.backends.browser_layout import COMMON_INHERITANCES, ModuleLayout
from baldwinlab.models.miniworld.backends.wasm_modules import RULES
from baldwinlab.parts.networks import Network

# Checks between two fields, as in the classes of experiments: one number is less than another.
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
    """Return the parts that the page lets a user choose, by the path of the field.

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
        # The hooks of a control are compiled into a module, as those of a part.
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
    # A path can be listed twice.
    for path in dict.fromkeys(fixed_paths):
        properties, name = find_field(schema, path)
        value: Any = tree
        for key in path.split("."):
            value = value[key]
        properties[name] = {"const": value}
    return schema


def find_field(schema: Any, path: str) -> Any:
    """Return the mutable `properties` that contain the field at a dotted path, and its name."""
    node = schema
    *tables, name = path.split(".")
    for table in tables:
        child = node["properties"][table]
        node = schema["$defs"][child["$ref"].rpartition("/")[2]] if "$ref" in child else child
    return node["properties"], name


def _list_compiled_fields(experiment: Experiment) -> Iterator[str]:
    """Yield the fields whose values are constants in the module of a third-party part."""
    network = type(experiment.part("network.kind"))
    # Only the part itself can check the size of a network that is a graph.
    if network.layers is not Network.layers or network.has_graph_genomes:
        yield "network.hidden"
    layout = _format_layout(experiment)
    for path, value in _list_numbers(experiment.to_dict()):
        changed_experiment = _change_value(experiment, path, value)
        if changed_experiment is not None and _format_layout(changed_experiment) != layout:
            yield path


def _format_layout(experiment: Experiment) -> str:
    """Return the memory layout, which contains constants and references to fields."""
    return repr(ModuleLayout(experiment).plan())


def _list_numbers(tree: dict[str, Any]) -> Iterator[tuple[str, float]]:
    """Yield the path and the value of each number of an experiment."""
    for path, value in iterate_settings(tree):
        if isinstance(value, int | float) and not isinstance(value, bool):
            yield path, value


def _change_value(experiment: Experiment, path: str, value: float) -> Experiment | None:
    """Return the experiment with another valid number at a path, or None if there is none."""
    candidates = (value / 2, value * 2, value + 1, value - 1)
    for candidate in candidates:
        # The number, in the tables of its path.
        change: Any = int(candidate) if isinstance(value, int) else candidate
        for key in reversed(path.split(".")):
            change = {key: change}
        with suppress(ExperimentError):
            return experiment.replace(**change)
    return None
