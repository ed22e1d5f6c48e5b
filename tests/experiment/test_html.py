"""How a notebook shows an experiment."""

from __future__ import annotations

import tomllib
from typing import Any

from baldwinlab.experiment import BaseExperiment, validate
from baldwinlab.experiment.html import html, rows
from baldwinlab.experiment.toml import to_toml
from baldwinlab.papers.presets import load


def leaves(tree: Any, path: str = "") -> set[str]:
    """The dotted paths of all fields in a tree of values; lists of tables are numbered."""
    if isinstance(tree, list) and tree and isinstance(tree[0], dict):
        tree = {str(number): entry for number, entry in enumerate(tree)}
    if not isinstance(tree, dict):
        return {path.removesuffix(".")}
    return set().union(*(leaves(value, f"{path}{name}.") for name, value in tree.items()))


def test_every_field_has_a_row_with_its_value_and_its_meaning() -> None:
    experiment = load("evo+self-taught/B")
    found = {row.path: row for row in rows(experiment)}
    assert set(found) == leaves(tomllib.loads(to_toml(experiment))) | {"learning.steps"}
    assert found["learning.steps"].value == "not set"  # for which TOML has no word
    assert found["learning.rate"][1:] == ("0.01", "0.01", "Learning rate, per step.")
    assert all(row.meaning for row in found.values() if row.path not in ("name", "model"))


def test_what_differs_from_its_default_stands_first_and_bold() -> None:
    experiment = load("evo/A").replace(network={"biases": True}, lifetime={"steps": 200})
    first, _, folded = experiment._repr_html_().partition("<details>")
    assert [row.path for row in rows(experiment) if row.differs] == [
        *("name", "world.food.0.x", "world.food.0.y", "network.biases", "lifetime.steps")
    ]
    for told in (
        "4 of its 42 fields differ",
        "<code>lifetime.steps</code>",
        "<strong>200</strong>",
        ">5000<",
    ):
        assert told in first
    assert "learning.rate" not in first
    assert "learning.rate" in folded
    assert "all fields are at their defaults" in validate({})._repr_html_()


def test_defaults_are_those_of_the_model_and_of_its_parts() -> None:
    guessing = load("guessing").replace(hinton_nowlan={"trials": 10})
    assert [row.path for row in rows(guessing) if row.differs] == ["name", "hinton_nowlan.trials"]
    assert {row.default for row in rows(guessing) if row.path == "population.size"} == {"1000"}
    rewarded = load("evo/A").replace(learning={"rule": "crbp"})
    assert "learning.crbp.punishment" in {row.path for row in rows(rewarded) if not row.differs}


def test_an_experiment_whose_part_is_not_here_is_shown_as_it_stands() -> None:
    tree = load("evo/A").to_dict()
    tree["learning"] |= {"rule": "<b>mine", "mine": {"pace": "<script>"}}
    tree["learning"]["<b>mine"] = tree["learning"].pop("mine")
    experiment: BaseExperiment = validate(tree, lenient=True)
    page = experiment._repr_html_()
    assert "<script>" not in page
    assert "&lt;b&gt;mine" in page
    assert "pace" in page


def test_a_notebook_gets_the_table_of_any_experiment() -> None:
    for name in ("evo/A", "guessing"):
        experiment = load(name)
        assert experiment._repr_html_() == html(experiment, name, experiment.model)
