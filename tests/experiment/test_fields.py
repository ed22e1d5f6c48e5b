"""A notebook shows the settings of an experiment as HTML tables."""

from __future__ import annotations

import tomllib
from typing import Any

from baldwinlab.experiment import BaseExperiment, validate
from baldwinlab.experiment.fields import iterate_rows
from baldwinlab.experiment.toml import to_toml
from baldwinlab.papers.presets import load


def field_paths(tree: Any, path: str = "") -> set[str]:
    """Return the dotted paths of all fields in a tree of values. Lists of tables are numbered."""
    if isinstance(tree, list) and tree and isinstance(tree[0], dict):
        tree = {str(number): entry for number, entry in enumerate(tree)}
    if not isinstance(tree, dict):
        return {path.removesuffix(".")}
    return set().union(*(field_paths(value, f"{path}{name}.") for name, value in tree.items()))


def test_every_field_has_a_row_with_its_value_and_meaning() -> None:
    experiment = load("evo+self-taught/B")
    rows_by_path = {row.path: row for row in iterate_rows(experiment)}
    assert set(rows_by_path) == field_paths(tomllib.loads(to_toml(experiment))) | {
        "learning.steps",
        "eats.items",
        "record.every",
    }
    # TOML has no null value.
    assert rows_by_path["learning.steps"].value == "not set"
    assert rows_by_path["learning.rate"][1:] == ("0.01", "0.01", "Learning rate, per step.")
    assert all(row.meaning for row in rows_by_path.values() if row.path not in ("name", "model"))


def test_changed_fields_are_listed_first_and_bold() -> None:
    experiment = load("evo/A").replace(network={"biases": True}, lifetime={"steps": 200})
    first, _, folded = experiment._repr_html_().partition("<details>")
    assert [row.path for row in iterate_rows(experiment) if row.differs] == [
        *("name", "world.food.0.x", "world.food.0.y", "network.biases", "lifetime.steps")
    ]
    # The title shows name and model.
    n_fields = len([*iterate_rows(experiment)]) - 2
    for text in (
        "<strong>evo/A</strong>, an experiment of the model miniworld",
        f"4 of its {n_fields} fields differ",
        "<code>lifetime.steps</code>",
        "<strong>200</strong>",
        ">5000<",
    ):
        assert text in first
    assert "learning.rate" not in first
    assert "learning.rate" in folded
    assert "all fields are at their defaults" in validate({})._repr_html_()


def test_defaults_come_from_the_model_and_its_parts() -> None:
    guessing = load("guessing").replace(hinton_nowlan={"trials": 10})
    assert [row.path for row in iterate_rows(guessing) if row.differs] == [
        "name",
        "hinton_nowlan.trials",
    ]
    assert {row.default for row in iterate_rows(guessing) if row.path == "population.size"} == {
        "1000"
    }
    rewarded = load("evo/A").replace(learning={"rule": "crbp"})
    assert "learning.crbp.punishment" in {
        row.path for row in iterate_rows(rewarded) if not row.differs
    }


def test_an_experiment_with_a_missing_part_is_shown_with_its_values() -> None:
    tree = load("evo/A").to_dict()
    tree["learning"] |= {"rule": "<b>mine", "mine": {"pace": "<script>"}}
    tree["learning"]["<b>mine"] = tree["learning"].pop("mine")
    experiment: BaseExperiment = validate(tree, lenient=True)
    page = experiment._repr_html_()
    assert "<script>" not in page
    assert "&lt;b&gt;mine" in page
    assert "pace" in page
