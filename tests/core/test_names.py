"""Errors about a name state its form in words, and list all or the five most similar names."""

from __future__ import annotations

from collections.abc import Iterator
from importlib import import_module
from pkgutil import walk_packages

import pytest
from pydantic import BaseModel

from baldwinlab import papers
from baldwinlab.core.names import (
    MAX_LISTED,
    MAX_SIMILAR,
    describe_pattern,
    find_case_collision,
    find_name_fault,
    list_names,
    suggest,
)
from baldwinlab.experiment import Experiment, ExperimentError, validate
from baldwinlab.papers.presets import factors, load


def list_subclasses(model: type[BaseModel]) -> Iterator[type[BaseModel]]:
    for subclass in model.__subclasses__():
        yield subclass
        yield from list_subclasses(subclass)


def list_patterns(schema: object) -> Iterator[str]:
    """Yield the patterns of the fields of a JSON schema."""
    if isinstance(schema, dict):
        if isinstance(schema.get("pattern"), str):
            yield schema["pattern"]
        for value in schema.values():
            yield from list_patterns(value)
    elif isinstance(schema, list):
        for value in schema:
            yield from list_patterns(value)


def test_each_pattern_of_a_table_has_words() -> None:
    # The list of subclasses contains only those of imported modules.
    for module in walk_packages(papers.__path__, f"{papers.__name__}."):
        import_module(module.name)
    # Other tests choose many parts, and each choice makes classes with the same fields.
    tables = {
        fields: table
        for table in list_subclasses(BaseModel)
        if table.__module__.startswith("baldwinlab")
        and "pattern" in (fields := str(table.model_fields))
    }
    used_patterns = {
        pattern for table in tables.values() for pattern in list_patterns(table.model_json_schema())
    }
    assert used_patterns
    for pattern in used_patterns:
        assert describe_pattern(pattern).startswith("must be"), pattern


def test_an_unknown_pattern_is_explained_by_the_description_of_its_setting() -> None:
    rule = describe_pattern("^[a-c]$", "Allele, a to c.")
    assert rule == "has another form than this setting allows: Allele, a to c."


@pytest.mark.parametrize(
    ("tree", "message"),
    [
        (
            {"name": "a b"},
            "name = 'a b': must be letters, digits, + _ . and -, with / between parts that begin "
            "with a letter or a digit",
        ),
        (
            {"population": {"species": [{"name": "a/b", "size": 3}]}},
            "population.species.0.name = 'a/b': must be letters, digits, + _ . and -, and begin "
            "with a letter or a digit",
        ),
    ],
)
def test_the_message_about_a_name_states_the_allowed_characters(
    tree: dict[str, object], message: str
) -> None:
    with pytest.raises(ExperimentError) as caught:
        validate(Experiment().to_dict() | tree)
    assert str(caught.value) == message


def test_a_short_list_of_names_is_complete() -> None:
    names = ("rank", "roulette")
    assert suggest("rnk", names) == " (did you mean 'rank'?); there are rank, roulette"
    assert suggest("tournament", []) == "; there are none"


def test_a_long_list_of_names_is_reduced_to_the_five_most_similar() -> None:
    names = [f"point-{number:04d}" for number in range(10_000)]
    listed = list_names("point-0042x", names)
    assert listed.startswith("the most similar of 10000 names are point-0042, ")
    assert listed.count("point-") == MAX_SIMILAR < MAX_LISTED


def test_a_name_without_similar_names_lists_some_names() -> None:
    assert list_names("?", [str(number) for number in range(21)]).count(",") == MAX_SIMILAR - 1


@pytest.mark.parametrize("name", ["evo+selftaught/B", "evolution/A", "gessing", "?"])
def test_an_unknown_preset_lists_at_most_five_of_all_presets(name: str) -> None:
    with pytest.raises(ExperimentError) as refusal:
        load(name)
    (listed,) = (
        part for part in str(refusal.value).split("; ") if part.startswith("the most similar of ")
    )
    assert listed.count(",") == MAX_SIMILAR - 1
    assert len(str(refusal.value)) < 300 < len(str(factors()))


FAULTS = {
    "Windows reserves": ["con", "CON", "evo/aux", "nul.toml", "com1/A", "Lpt9", "prn"],
    "as a missing value": ["NA", "N/A", "None/A", "evo/null", "nan"],
    "Windows removes the dot or space": ["x.", "x./A", "evo/A ", "x. "],
}
VALID_NAMES = ["evo/A", "console", "com", "com10", "a.con", "x.y", "evo/con-1", "none", "evo+NA/A"]


def test_a_name_that_windows_or_the_reader_of_a_table_changes_has_a_fault() -> None:
    for fault, names in FAULTS.items():
        assert [name for name in names if fault not in find_name_fault(name)] == []
    assert [name for name in VALID_NAMES if find_name_fault(name) != ""] == []


def test_names_collide_if_only_capital_letters_differ() -> None:
    assert find_case_collision(["evo/A", "evo/B", "Evo/a"]) == ("evo/A", "Evo/a")
    assert find_case_collision(["evo/A", "evo/B", "evo/A"]) is None
