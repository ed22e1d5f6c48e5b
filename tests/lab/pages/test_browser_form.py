"""Tests of the form of an exported page: constant, changeable and refused settings.

Each setting of MiniWorld is refused, or has the same effect as in Python.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from baldwinlab.core.errors import RefusedError
from baldwinlab.experiment import Experiment, ExperimentError, assign, registry
from baldwinlab.experiment.class_builder import choosing_fields
from baldwinlab.experiment.paths import iterate_settings, look_up, nest_settings
from baldwinlab.experiment.registry import BUILT_IN
from baldwinlab.lab.pages.browser_form import (
    LABELS,
    find_field,
    make_form_schema,
    require_browser_settings,
)
from baldwinlab.lab.pages.export import render_live_page
from baldwinlab.lab.sources.experiment_form import make_schema
from baldwinlab.models.miniworld.backends.browser_layout import ModuleLayout
from baldwinlab.models.miniworld.backends.wasm_modules import (
    MODULES_FOLDER,
    built_in_experiments,
    module_name,
)
from baldwinlab.papers.presets import load
from baldwinlab.parts import load_file
from baldwinlab.simulation.simulate import simulate
from tests.lab.node import NodeRun, check_bits, run_in_node

EXAMPLES = Path(__file__).parents[3] / "examples" / "parts"


def find_fields(tables: dict[str, Any], prefix: str) -> dict[str, Any]:
    """Return the fields of the first table whose name starts with a prefix."""
    fields: dict[str, Any] = next(
        table["properties"] for name, table in tables.items() if name.startswith(prefix)
    )
    return fields


def use_example_parts(*assignments: str) -> Experiment:
    """Return an experiment with the parts of three example files, changed by `assignments`."""
    for name in ("poison", "elman", "social"):
        load_file(EXAMPLES / f"{name}.py")
    settings = [
        'world.features=["poison"]',
        'senses.kinds=["food", "poison"]',
        "evolution.fitness=above-the-worst",
        "network.kind=elman",
        "learning.rule=social",
    ]
    experiment: Experiment = assign(load("evo/A"), [*settings, *assignments])
    return experiment


def test_fields_that_a_third_party_part_compiles_are_constant_on_the_page() -> None:
    tables = make_form_schema(use_example_parts())["$defs"]
    assert "const" in tables["NetworkSettings"]["properties"]["hidden"]
    poison = find_fields(tables, "Poison")
    assert all("const" in poison[name] for name in ("x", "y", "count", "cost"))
    assert "const" not in find_fields(tables, "Social")["least"]


def test_the_maximum_size_of_an_evolved_topology_is_constant_on_the_page() -> None:
    tables = make_form_schema(load("worlds-and-minds:evo/A", "neat"))["$defs"]
    assert "const" in find_fields(tables, "NetworkSettings")["hidden"]


def test_the_number_of_inputs_of_a_sense_is_constant_on_the_page() -> None:
    experiment = assign(load("evo/A"), ['senses.kinds=["food-rays"]'])
    rays = find_fields(make_form_schema(experiment)["$defs"], "FoodRays")
    assert "const" in rays["rays"]
    assert "const" not in rays["item_radius"]


# Other values of settings that are lists, or that are not set.
OTHER_VALUES: Mapping[str, Any] = {
    "world.food": [{"x": [90.0, 270.0], "y": [60.0, 240.0], "count": 70, "energy": 0.5}],
    "population.species": [{"name": "first", "size": 8}, {"name": "second", "size": 8}],
    "eats.items": [],
    "eats.prey": [{"species": "second"}],
    "network.hidden": [5, 4],
    "learning.steps": 30,
    "evolution.founders": [{"path": "founders.npy", "sha256": "0" * 64, "share": 1.0}],
    "record.every": 10,
    "schedule": [{"generation": 1, "world.width": 700.0}],
}
# Further settings of another value: without learning, a learning rate is refused.
FURTHER_VALUES: Mapping[str, Any] = {"learning.rule": {"learning.rate": 0.01}}
# Settings that only the engine in Python supports.
REFUSED_SETTINGS = {
    "population.species",
    "population.worlds",
    "eats.items",
    "eats.prey",
    "evolution.compete",
    "evolution.stop",
    "evolution.founders",
    "lifetime.repeats",
    "record.every",
    "schedule",
}
# Settings whose other values need a module that the package does not contain.
CUSTOM_MODULE_SETTINGS = {
    "world.features",
    "senses.kinds",
    "motor.body",
    "network.kind",
    "evolution.variation",
    "evolution.fitness",
}


def list_other_values(experiment: Experiment, path: str, value: Any) -> list[Any]:
    """Return other values of a setting, of which the first valid one is tried."""
    kinds = {choice: kind for choice, kind, _ in choosing_fields(type(experiment))}
    if path in OTHER_VALUES:
        return [OTHER_VALUES[path]]
    if path in kinds:
        # The compilation of the module of another part takes a minute.
        built_in_names = [name for name in BUILT_IN[kinds[path]] if name != value]
        return built_in_names or [*registry.names(kinds[path])] * (path == "evolution.stop")
    if isinstance(value, bool):
        return [not value]
    if isinstance(value, int):
        return [value // 2, value * 2, value + 1]
    if isinstance(value, float):
        return [value / 2, value * 2, value + 0.5]
    properties, name = find_field(make_schema(type(experiment)), path)
    return [choice for choice in properties[name].get("enum", ()) if choice != value]


def change_setting(experiment: Experiment, path: str, value: Any) -> Experiment | None:
    """Return the experiment with another valid value of a setting, or None if there is none."""
    for new_value in list_other_values(experiment, path, value):
        with suppress(ExperimentError):
            settings = {path: new_value, **FURTHER_VALUES.get(path, {})}
            changed = experiment.replace(**nest_settings(settings))
            if changed != experiment:
                return changed
    return None


def make_base(rule: str = "self-taught") -> Experiment:
    """Return a small experiment whose agents are born among the food, so that they eat."""
    return load("evo/A").replace(
        population={"size": 16},
        lifetime={"steps": 60},
        world={"start": {"x": 450.0}},
        evolution={"generations": 3},
        learning={"rule": rule, "rate": 0.1},
    )


def change_each_setting() -> dict[str, Experiment]:
    """Return an experiment with another value of a setting, for each setting of MiniWorld."""
    base = make_base()
    bases = [base.replace(evolution={"selection": name}) for name in BUILT_IN["selection"]]
    experiments = {}
    for experiment in bases:
        for path, value in iterate_settings(experiment.to_dict()):
            is_new = path not in experiments and path not in LABELS
            if is_new and (changed := change_setting(experiment, path, value)):
                experiments[path] = changed
    return experiments


def test_each_setting_is_refused_or_has_the_same_effect_as_in_python(tmp_path: Path) -> None:
    changed = change_each_setting()
    accepted = {}
    for path, experiment in changed.items():
        with suppress(RefusedError):
            require_browser_settings(experiment)
            accepted[path] = experiment
    assert set(changed) - set(accepted) == REFUSED_SETTINGS
    plans = {name: ModuleLayout(program).plan() for name, program in built_in_experiments().items()}
    runs = {}
    for path, experiment in accepted.items():
        name = module_name(experiment)
        runs[path] = NodeRun(experiment, MODULES_FOLDER / f"{name}.wasm", plans[name])
    results = run_in_node(tmp_path, runs)
    for path, experiment in accepted.items():
        check_bits(results[path], simulate(experiment, seed=5, run=1), path)


def test_each_setting_of_miniworld_is_tried() -> None:
    paths = {path for path, _ in iterate_settings(Experiment().to_dict())}
    assert paths - set(change_each_setting()) == {"model", *LABELS, *CUSTOM_MODULE_SETTINGS}


@pytest.mark.parametrize("setting", ["eats.items=[]", 'eats.items=["food"]'])
def test_a_page_whose_agents_do_not_eat_all_items_is_refused(setting: str) -> None:
    experiment = assign(load("evo+self-taught/A"), [setting])
    with pytest.raises(RefusedError, match=r"cannot run in a browser: eats\.items = \["):
        render_live_page([experiment])
    with pytest.raises(RefusedError, match=r"only the engine in Python has state\.population"):
        ModuleLayout(experiment).plan()


@pytest.mark.parametrize("path", sorted({*REFUSED_SETTINGS, "learning.control"}))
def test_a_setting_that_only_python_supports_is_refused_with_custom_parts(path: str) -> None:
    load_file(EXAMPLES / "social.py")
    experiment = make_base("social")
    require_browser_settings(experiment)
    changed = change_setting(experiment, path, look_up(experiment, path)[0])
    assert changed is not None
    with pytest.raises(RefusedError, match=f"cannot run in a browser: {path} = "):
        require_browser_settings(changed)


def test_settings_that_the_module_of_custom_parts_contains_are_accepted() -> None:
    require_browser_settings(use_example_parts("network.hidden=[7]", "lifetime.update=sequential"))
