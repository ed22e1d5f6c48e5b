"""Tests of the form of an exported page, where compiled settings are constant."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from baldwinlab.experiment import assign
from baldwinlab.lab.pages.browser_form import make_form_schema
from baldwinlab.papers.presets import load
from baldwinlab.parts import load_file

EXAMPLES = Path(__file__).parents[3] / "examples" / "parts"


def find_fields(tables: dict[str, Any], prefix: str) -> dict[str, Any]:
    """Return the fields of the first table whose name starts with a prefix."""
    fields: dict[str, Any] = next(
        table["properties"] for name, table in tables.items() if name.startswith(prefix)
    )
    return fields


def test_fields_that_a_third_party_part_compiles_are_constant_on_the_page() -> None:
    for name in ("poison", "elman", "social"):
        load_file(EXAMPLES / f"{name}.py")
    settings = [
        'world.features=["poison"]',
        'senses.kinds=["food", "poison"]',
        "evolution.fitness=above-the-worst",
    ]
    experiment = assign(load("evo/A"), [*settings, "network.kind=elman", "learning.rule=social"])
    tables = make_form_schema(experiment)["$defs"]
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
