"""Schemas, signatures and docstrings as Markdown: what `reference` makes its pages of."""

from __future__ import annotations

import inspect
import json
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any

from baldwinlab.lab.schema import schema_of
from baldwinlab.variables import Variable


def table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Of the class `meanings`, in the words of MyST: its last column tells something, and needs room."""
    lines = [heads, ["---"] * len(heads), *rows]
    return "{.meanings}\n" + "".join(
        f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in line)} |\n" for line in lines
    )


def fields_of(kind: Any, path: str = "") -> list[tuple[str, Any]]:
    """Dotted path and schema of every field of a class, table by table; N stands for the number of a table in a list."""
    schema = schema_of(kind)
    return list(_fields(schema, schema.get("$defs", {}), path))


def _fields(
    schema: Mapping[str, Any], tables: Mapping[str, Any], path: str
) -> Iterator[tuple[str, Any]]:
    for name, node in schema.get("properties", {}).items():
        below, here = node.get("items", node), f"{path}.{name}" if path else name
        if "$ref" in below:
            yield from _fields(
                tables[below["$ref"].rpartition("/")[2]],
                tables,
                here if below is node else f"{here}.N",
            )
        else:
            yield here, node


def table_of_fields(fields: Iterable[tuple[str, Any]]) -> str:
    rows = [
        (f"`{path}`", value(node), _default(node), node.get("description", ""))
        for path, node in fields
    ]
    return (
        table(("field", "type and limits", "default", "meaning, with its unit"), rows)
        if rows
        else ""
    )


def _default(node: Mapping[str, Any]) -> str:
    if node.get("default") is not None:
        return f"`{json.dumps(node['default'])}`"
    return "none" if "default" in node else "must be given"


def value(node: Mapping[str, Any]) -> str:
    """Type and limits of what a field takes, in words."""
    if "anyOf" in node:
        return " or ".join(value(one) for one in node["anyOf"] if one["type"] != "null")
    if "enum" in node:
        return "one of " + ", ".join(f"`{each}`" for each in node["enum"])
    if "const" in node:
        return f"`{node['const']}`"
    if node["type"] == "array":
        inside = node.get("prefixItems", [node.get("items")])
        least, most = node.get("minItems", 0), node.get("maxItems")
        number = f" of {most}" if least == most else f" of {least} to {most}" if most else ""
        return f"list{number}: {value(inside[0])}"
    words = {
        "integer": "whole number",
        "number": "number",
        "boolean": "true or false",
        "string": "text",
    }[node["type"]]
    signs = {"minimum": "≥", "exclusiveMinimum": ">", "maximum": "≤", "exclusiveMaximum": "<"}
    return ", ".join(
        [words, *(f"{sign} {node[limit]:,}" for limit, sign in signs.items() if limit in node)]
    )


def table_of_variables(declared: Mapping[str, Variable]) -> str:
    rows = [
        (f"`{name}`", ", ".join(one.dims), f"`{one.dtype.__name__}`", one.unit, one.meaning)
        for name, one in declared.items()
    ]
    return table(("variable", "dimensions", "type", "unit", "meaning"), rows)


def name(name: str, what: Any, level: str = "##") -> str:
    """What a name stands for: its signature and docstring, and those of its methods."""
    text = f"{level} {name.replace('_', chr(92) + '_')}\n\n"
    if inspect.isclass(what) and issubclass(what, Exception):
        return f"{text}An exception, derived from `{what.__bases__[0].__name__}`. {prose(what.__doc__)}\n"
    if inspect.isclass(what):
        methods = [
            (each, method)
            for each, method in inspect.getmembers_static(what, inspect.isfunction)
            if _is_own(method)
        ]
        return f"{text}{prose(what.__doc__)}\n" + "".join(
            f"\n{level}# {name}.{each}\n\n{function(method, each)}" for each, method in methods
        )
    if not callable(what):
        return f"{text}`{what!r}`\n"
    if not what.__module__.startswith("baldwinlab"):
        return f"{text}That of {what.__module__.partition('.')[0]}.\n"
    return text + function(what, name)


def _is_own(method: Callable[..., Any]) -> bool:
    return (
        bool(method.__doc__)
        and not method.__name__.startswith("_")
        and method.__module__.startswith("baldwinlab")
    )


def function(called: Callable[..., Any], name: str) -> str:
    return f"```py\n{name}{_signature(called)}\n```\n\n{prose(called.__doc__)}\n"


def _signature(called: Callable[..., Any]) -> str:
    """As it is written, an argument a line where it is long."""
    signature = inspect.signature(called)
    given = [one for one in signature.parameters.values() if one.name != "self"]
    told = [_argument(one) for one in given]
    keywords = [one.kind is one.KEYWORD_ONLY for one in given]
    if True in keywords:
        told.insert(keywords.index(True), "*")
    returned = signature.return_annotation
    result = "" if returned is inspect.Signature.empty else f" -> {_annotation(returned)}"
    line = f"({', '.join(told)}){result}"
    return (
        line if len(line) < 80 else "(\n" + "".join(f"    {one},\n" for one in told) + f"){result}"
    )


def _argument(one: inspect.Parameter) -> str:
    stars = "**" if one.kind is one.VAR_KEYWORD else "*" if one.kind is one.VAR_POSITIONAL else ""
    annotation = "" if one.annotation is one.empty else f": {_annotation(one.annotation)}"
    default = (
        ""
        if one.default is one.empty
        else f" = {one.default!r}"
        if annotation
        else f"={one.default!r}"
    )
    return f"{stars}{one.name}{annotation}{default}"


def _annotation(of: Any) -> str:
    return of if isinstance(of, str) else getattr(of, "__name__", str(of))


def prose(docstring: str | None) -> str:
    """A docstring as Markdown: its examples, and lists whose second column is aligned, stay as they are written.

    A section of numpydoc, such as "Parameters", becomes a list of its entries under a title in bold.
    """
    text, *sections = re.split(
        r"^(\w[\w ]*)\n-{3,}$", inspect.cleandoc(docstring or ""), flags=re.MULTILINE
    )
    told = []
    for paragraph in re.split(r"\n\s*\n", text.strip()):
        aligned = re.search(r"^\w\S*(, \S+)?  +\S", paragraph, re.MULTILINE)
        fence = "pycon" if paragraph.startswith(">>>") else "text" if aligned else ""
        told.append(f"```{fence}\n{paragraph}\n```" if fence else paragraph)
    told += [
        f"**{title}**\n\n{_entries(body)}"
        for title, body in zip(sections[::2], sections[1::2], strict=True)
    ]
    return "\n\n".join(told)


def _entries(section: str) -> str:
    """The entries of a section of numpydoc, a line each: names, and the indented lines that describe them."""
    listed: list[str] = []
    for line in filter(str.strip, section.splitlines()):
        if line.startswith(" ") and listed:
            listed[-1] += f" {line.strip()}"
        else:
            names = ", ".join(f"`{name}`" for name in line.split(", "))
            listed.append(f"- {names}:")
    return "\n".join(listed)


def capital(words: str) -> str:
    return words[:1].upper() + words[1:]
