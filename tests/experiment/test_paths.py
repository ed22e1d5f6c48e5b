"""A setting has the same path and value wherever a user gives it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import baldwinlab as bl
from baldwinlab.experiment import Experiment, ExperimentError, assign, look_up, merge, validate
from baldwinlab.experiment.fields import to_plain_data
from baldwinlab.experiment.paths import combine_settings, nest_settings
from baldwinlab.experiment.schedule import parse_changes
from baldwinlab.experiment.toml import format_assignments, from_toml, to_toml
from baldwinlab.lab.sources.experiment_form import find_errors
from baldwinlab.studies.sweeps import validate_sweep
from baldwinlab.studies.sweeps.design import expand_sweep

EXPERIMENT = bl.load("evo+self-taught/A")
REGIONS = [{"count": 3, "x": [10, 20], "y": [30.5, 40.0]}]
# Each spelling, also with values of NumPy, with the path and value of the setting.
SPELLINGS: dict[str, tuple[Mapping[str, Any], str, Any]] = {
    "a path": ({"motor.noise": 0.25}, "motor.noise", 0.25),
    "tables": ({"motor": {"noise": 0.25}}, "motor.noise", 0.25),
    "a part": ({"learning.rule": "hebb"}, "learning.rule", "hebb"),
    "an index": ({"world.food.0.count": 7}, "world.food.0.count", 7),
    "an index in tables": ({"world": {"food": {"0": {"count": 7}}}}, "world.food.0.count", 7),
    "a list of numbers": ({"world.food.0.x": [1, 2.5]}, "world.food.0.x", [1.0, 2.5]),
    "a list of tables": ({"world.food": REGIONS}, "world.food.0.y", [30.5, 40.0]),
    "a float of NumPy": ({"motor.noise": np.float32(0.25)}, "motor.noise", 0.25),
    "an integer of NumPy": ({"world.food.0.count": np.int32(7)}, "world.food.0.count", 7),
    "an array": ({"world.food.0.x": np.array([1, 2.5])}, "world.food.0.x", [1.0, 2.5]),
    "a list of NumPy numbers": ({"world.food.0.x": [np.int8(1), 3]}, "world.food.0.x", [1.0, 3.0]),
    "a tuple": ({"world.food.0.x": (1, 2.5)}, "world.food.0.x", [1.0, 2.5]),
    "a text": ({"learning.rule": np.str_("hebb")}, "learning.rule", "hebb"),
}


def set_in_python(settings: Mapping[str, Any]) -> Experiment:
    changed: Experiment = assign(EXPERIMENT, format_assignments(settings))
    return changed


def replace(settings: Mapping[str, Any]) -> Experiment:
    return EXPERIMENT.replace(**nest_settings(settings))


def schedule_in_python(settings: Mapping[str, Any]) -> Experiment:
    return EXPERIMENT.replace(schedule=[{"generation": 5, **settings}]).at(5)


def schedule_by_command(settings: Mapping[str, Any]) -> Experiment:
    changes = parse_changes(["5", *format_assignments(settings)])
    return EXPERIMENT.replace(schedule=changes).at(5)


def schedule_in_file(settings: Mapping[str, Any]) -> Experiment:
    scheduled = EXPERIMENT.replace(schedule=[{"generation": 5, **settings}])
    return from_toml(to_toml(scheduled), "file.toml").at(5)


def fix_in_sweep(settings: Mapping[str, Any]) -> Experiment:
    return make_first_point({"set": settings, "fields": {"learning.rate": [0.5]}})


def sweep_setting(settings: Mapping[str, Any]) -> Experiment:
    values = dict(assignment_pairs(settings))
    return make_first_point({"fields": {path: [value] for path, value in values.items()}})


def assignment_pairs(settings: Mapping[str, Any]) -> list[tuple[str, Any]]:
    (change,) = EXPERIMENT.replace(schedule=[{"generation": 5, **settings}]).schedule
    return list(change.settings.items())


def make_first_point(plan: dict[str, Any]) -> Experiment:
    tree = to_plain_data({"experiment": "evo+self-taught/A"} | plan)
    return expand_sweep(validate_sweep(tree, "sweep"), Path("sweep"))[0]


def merge_variant(settings: Mapping[str, Any]) -> Experiment:
    """Return the experiment of a variant of a paper, as a multiverse has it."""
    experiment: Experiment = validate(merge(EXPERIMENT.to_dict(), nest_settings(settings)))
    return experiment


def set_of_species(settings: Mapping[str, Any]) -> Experiment:
    shared = {path: value for path, value in settings.items() if path.startswith("world")}
    unshared = {path: value for path, value in settings.items() if path not in shared}
    species = [{"name": "first", "size": 20} | unshared]
    experiment = EXPERIMENT.replace(population={"species": species}, **nest_settings(shared))
    return experiment.species_experiments()[0]


def submit_form(settings: Mapping[str, Any]) -> Experiment:
    """Return the experiment of a form of the lab, which sends a complete tree."""
    tree = to_plain_data(set_in_python(settings))
    assert not find_errors(tree)
    experiment: Experiment = validate(tree)
    return experiment


ENTRIES: list[Callable[[Mapping[str, Any]], Experiment]] = [
    set_in_python,
    replace,
    schedule_in_python,
    schedule_by_command,
    schedule_in_file,
    fix_in_sweep,
    sweep_setting,
    merge_variant,
    set_of_species,
    submit_form,
]


@pytest.mark.parametrize("entry", ENTRIES, ids=lambda entry: entry.__name__)
@pytest.mark.parametrize("spelling", SPELLINGS)
def test_each_spelling_of_a_setting_works_at_each_entry(
    spelling: str, entry: Callable[[Mapping[str, Any]], Experiment]
) -> None:
    settings, path, expected = SPELLINGS[spelling]
    value, _ = look_up(entry(settings), path)
    assert to_plain_data(value) == expected


@pytest.mark.parametrize("entry", [replace, set_in_python, merge_variant])
def test_a_truth_value_of_numpy_is_true(entry: Callable[[Mapping[str, Any]], Experiment]) -> None:
    assert entry({"learning.evolved_rate": np.True_}).learning.evolved_rate is True


@pytest.mark.parametrize("entry", [replace, schedule_in_python, set_in_python])
@pytest.mark.parametrize("index", ["4", "-1", "first"])
def test_an_index_that_a_list_lacks_is_refused(
    entry: Callable[[Mapping[str, Any]], Experiment], index: str
) -> None:
    with pytest.raises(ExperimentError, match=rf"world\.food\.{index}.*there are: 0"):
        entry({f"world.food.{index}.count": 7})


@pytest.mark.parametrize("value", [None, 1j, object(), {1, 2}])
def test_a_value_that_no_setting_can_have_is_refused(value: object) -> None:
    with pytest.raises(ExperimentError, match=r"motor\.noise = .*must be a number"):
        set_in_python({"motor.noise": value})


def test_a_later_change_of_an_entry_changes_an_earlier_list() -> None:
    changes: list[dict[str, Any]] = [{"a.0.b": 1}, {"a": [{"b": 2, "c": 3}]}, {"a.0.b": 4}]
    assert combine_settings(changes) == {"a": [{"b": 4, "c": 3}]}
    assert changes[1] == {"a": [{"b": 2, "c": 3}]}


def test_a_list_that_is_given_ends_the_scheduled_changes_of_its_entries() -> None:
    changes = [{"generation": 5, "world.food.0.count": 7, "motor.noise": 0.5}]
    changed = EXPERIMENT.replace(schedule=changes).replace(world={"food": REGIONS})
    assert [change.settings for change in changed.schedule] == [{"motor.noise": 0.5}]


def test_a_table_in_a_schedule_is_checked_as_its_settings() -> None:
    change = {"generation": 5, "evolution": {"generations": 3}}
    with pytest.raises(ExperimentError, match=r"evolution\.generations cannot change"):
        EXPERIMENT.replace(schedule=[change])
