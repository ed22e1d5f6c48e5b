"""What a form of an experiment is made from: its fields as a JSON schema. What is here needs no extra."""

from __future__ import annotations

from typing import Any

from baldwinlab.experiment import BaseExperiment, registry


def schema_of(kind: type[BaseExperiment]) -> Any:
    """The JSON schema of experiments, in which each field that chooses parts says which there are."""
    return _with_choices(kind.model_json_schema())


def _with_choices(node: Any) -> Any:
    if isinstance(node, list):
        return [_with_choices(each) for each in node]
    if not isinstance(node, dict):
        return node
    known = {"enum": registry.names(node["x-chooses"])} if "x-chooses" in node else {}
    return {key: _with_choices(value) for key, value in node.items()} | known


def node_at(schema: Any, path: str) -> Any:
    """The table of the schema that has the field at a dotted path, to be changed there, and the field's name."""
    node, (*tables, last) = schema, path.split(".")
    for table in tables:
        below = node["properties"][table]
        node = schema["$defs"][below["$ref"].rpartition("/")[2]] if "$ref" in below else below
    return node["properties"], last
