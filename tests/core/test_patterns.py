"""Messages about the form of a name are words, not regular expressions."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from pydantic import BaseModel

from baldwinlab import ExperimentError
from baldwinlab.core import patterns
from baldwinlab.experiment import Experiment, validate


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
        assert patterns.describe_pattern(pattern).startswith("must be"), pattern


def test_an_unknown_pattern_is_explained_by_the_description_of_its_setting() -> None:
    rule = patterns.describe_pattern("^[a-c]$", "Allele, a to c.")
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
