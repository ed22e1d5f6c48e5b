"""The JSON schema from which the page makes the form of an experiment. Needs no extra."""

from __future__ import annotations

from typing import Any

from baldwinlab.experiment import BaseExperiment, registry


def make_schema(kind: type[BaseExperiment]) -> Any:
    """Return the JSON schema of an experiment class, with the names of all available parts."""
    return _with_part_names(kind.model_json_schema())


def _with_part_names(node: Any) -> Any:
    if isinstance(node, list):
        return [_with_part_names(item) for item in node]
    if not isinstance(node, dict):
        return node
    part_names = {"enum": registry.names(node["x-chooses"])} if "x-chooses" in node else {}
    return {key: _with_part_names(value) for key, value in node.items()} | part_names


def find_field(schema: Any, path: str) -> Any:
    """Return the mutable `properties` that contain the field at a dotted path, and its name."""
    node = schema
    *tables, name = path.split(".")
    for table in tables:
        child = node["properties"][table]
        node = schema["$defs"][child["$ref"].rpartition("/")[2]] if "$ref" in child else child
    return node["properties"], name
