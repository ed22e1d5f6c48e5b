"""Schemas, signatures and docstrings as Markdown, for `scripts.reference`."""

from __future__ import annotations

import inspect
import json
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any, Final, NamedTuple

from baldwinlab.core.variables import Variable
from baldwinlab.lab.schema import make_schema

TYPES: Final = {
    "integer": "whole number",
    "number": "number",
    "boolean": "true or false",
    "string": "text",
}
LIMITS: Final = {
    "minimum": "≥",
    "exclusiveMinimum": ">",
    "maximum": "≤",
    "exclusiveMaximum": "<",
}
STARS: Final[Mapping[Any, str]] = {
    inspect.Parameter.VAR_KEYWORD: "**",
    inspect.Parameter.VAR_POSITIONAL: "*",
}
SIGNATURE_WIDTH: Final = 80


class Entry(NamedTuple):
    """An entry of a numpydoc section."""

    names: tuple[str, ...]
    kind: str
    text: str


class Docstring(NamedTuple):
    """A numpydoc docstring: the text before the first section, and the sections by title."""

    text: str
    sections: dict[str, str]


def table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a Markdown table with the CSS class `meanings`, whose last column is the widest."""
    lines = [heads, ["---"] * len(heads), *rows]
    cells = (" | ".join(cell.replace("|", "\\|") for cell in line) for line in lines)
    return "{.meanings}\n" + "".join(f"| {line} |\n" for line in cells)


def fields_of(model: Any, path: str = "") -> list[tuple[str, Any]]:
    """Return the dotted path and the JSON schema of each field of a class.

    N is the number of a table in a list.
    """
    schema = make_schema(model)
    return list(_fields(schema, schema.get("$defs", {}), path))


def _fields(
    schema: Mapping[str, Any], tables: Mapping[str, Any], path: str
) -> Iterator[tuple[str, Any]]:
    for name, node in schema.get("properties", {}).items():
        items = node.get("items", node)
        field_path = f"{path}.{name}" if path else name
        if "$ref" in items:
            nested = tables[items["$ref"].rpartition("/")[2]]
            yield from _fields(nested, tables, field_path if items is node else f"{field_path}.N")
        else:
            yield field_path, node


def table_of_fields(fields: Iterable[tuple[str, Any]]) -> str:
    """Return a table of fields: path, type and limits, default, meaning."""
    rows = [
        (f"`{path}`", value_type(node), _default(node), node.get("description", ""))
        for path, node in fields
    ]
    heads = ("setting", "type and limits", "default", "meaning and unit")
    return table(heads, rows) if rows else ""


def _default(node: Mapping[str, Any]) -> str:
    if node.get("default") is not None:
        return f"`{json.dumps(node['default'])}`"
    return "none" if "default" in node else "required"


def value_type(node: Mapping[str, Any]) -> str:
    """Return the type and the limits of a field as text."""
    if "anyOf" in node:
        return " or ".join(
            value_type(option) for option in node["anyOf"] if option["type"] != "null"
        )
    if "enum" in node:
        return "one of " + ", ".join(f"`{value}`" for value in node["enum"])
    if "const" in node:
        return f"`{node['const']}`"
    if node["type"] == "array":
        return _array_type(node)
    limits = [f"{sign} {node[limit]:,}" for limit, sign in LIMITS.items() if limit in node]
    return ", ".join([TYPES[node["type"]], *limits])


def _array_type(node: Mapping[str, Any]) -> str:
    item = node.get("prefixItems", [node.get("items")])[0]
    minimum = node.get("minItems", 0)
    maximum = node.get("maxItems")
    length = ""
    if minimum == maximum:
        length = f" of {maximum}"
    elif maximum:
        length = f" of {minimum} to {maximum}"
    return f"list{length}: {value_type(item)}"


def table_of_variables(variables: Mapping[str, Variable]) -> str:
    """Return a table of variables: dimensions, type, unit, meaning."""
    rows = [
        (
            f"`{name}`",
            ", ".join(variable.dims),
            f"`{variable.dtype.__name__}`",
            variable.unit,
            variable.meaning,
        )
        for name, variable in variables.items()
    ]
    return table(("variable", "dimensions", "type", "unit", "meaning"), rows)


def format_name(name: str, value: Any, level: str = "##") -> str:
    """Return the documentation of a name: its signature and docstring, and those of its methods."""
    text = f"{level} {name.replace('_', chr(92) + '_')}\n\n"
    if inspect.isclass(value) and issubclass(value, Exception):
        base = value.__bases__[0].__name__
        return f"{text}An exception, derived from `{base}`. {prose(value.__doc__)}\n"
    if inspect.isclass(value):
        methods = [
            f"\n{level}# {name}.{method_name}\n\n{format_function(method, method_name)}"
            for method_name, method in inspect.getmembers_static(value, inspect.isfunction)
            if _is_documented_method(method)
        ]
        return f"{text}{prose(value.__doc__)}\n{''.join(methods)}"
    if not callable(value):
        return f"{text}`{value!r}`\n"
    if not value.__module__.startswith("baldwinlab"):
        return f"{text}The function of {value.__module__.partition('.')[0]}.\n"
    return text + format_function(value, name)


def _is_documented_method(method: Callable[..., Any]) -> bool:
    return (
        bool(method.__doc__)
        and not method.__name__.startswith("_")
        and method.__module__.startswith("baldwinlab")
    )


def format_function(function: Callable[..., Any], name: str) -> str:
    """Return the signature and the docstring of a function."""
    return f"```py\n{name}{signature(function)}\n```\n\n{prose(function.__doc__)}\n"


def signature(function: Callable[..., Any]) -> str:
    """Return the signature of a function, with one argument per line if it is long."""
    described = inspect.signature(function)
    parameters = [value for value in described.parameters.values() if value.name != "self"]
    arguments = [_argument(parameter) for parameter in parameters]
    keyword_only = [parameter.kind is parameter.KEYWORD_ONLY for parameter in parameters]
    if True in keyword_only:
        arguments.insert(keyword_only.index(True), "*")
    returned = described.return_annotation
    result = "" if returned is inspect.Signature.empty else f" -> {_annotation(returned)}"
    line = f"({', '.join(arguments)}){result}"
    if len(line) < SIGNATURE_WIDTH:
        return line
    return "(\n" + "".join(f"    {argument},\n" for argument in arguments) + f"){result}"


def _argument(parameter: inspect.Parameter) -> str:
    text = f"{STARS.get(parameter.kind, '')}{parameter.name}"
    has_annotation = parameter.annotation is not parameter.empty
    if has_annotation:
        text += f": {_annotation(parameter.annotation)}"
    if parameter.default is not parameter.empty:
        equals = " = " if has_annotation else "="
        text += f"{equals}{parameter.default!r}"
    return text


def _annotation(annotation: Any) -> str:
    if isinstance(annotation, str):
        return annotation
    return getattr(annotation, "__name__", str(annotation))


def parse_docstring(docstring: str | None) -> Docstring:
    """Split a docstring into its text and its numpydoc sections."""
    text, *sections = re.split(
        r"^(\w[\w ]*)\n-{3,}$", inspect.cleandoc(docstring or ""), flags=re.MULTILINE
    )
    pairs = zip(sections[::2], sections[1::2], strict=True)
    return Docstring(text.strip(), {title: body.strip("\n") for title, body in pairs})


def entries(section: str) -> list[Entry]:
    """Return the entries of a numpydoc section such as "Parameters"."""
    result: list[Entry] = []
    for line in filter(str.strip, section.splitlines()):
        if line.startswith(" ") and result:
            last = result[-1]
            result[-1] = last._replace(text=f"{last.text} {line.strip()}".strip())
        else:
            names, _, kind = line.partition(" : ")
            result.append(Entry(tuple(names.strip().split(", ")), kind.strip(), ""))
    return result


def described_attributes(described: Any) -> dict[str, Entry]:
    """Return the entries of the section "Attributes" of a class, by name."""
    section = parse_docstring(described.__doc__).sections.get("Attributes", "")
    return {name: entry for entry in entries(section) for name in entry.names}


def prose(docstring: str | None) -> str:
    """Return a docstring as Markdown.

    Examples, and lists with an aligned second column, become code blocks.
    A numpydoc section becomes a list under a title in bold type.
    """
    text, sections = parse_docstring(docstring)
    blocks = []
    for paragraph in re.split(r"\n\s*\n", text):
        aligned = re.search(r"^\w\S*(, \S+)?  +\S", paragraph, re.MULTILINE)
        fence = "text" if aligned else ""
        if paragraph.startswith(">>>"):
            fence = "pycon"
        blocks.append(f"```{fence}\n{paragraph}\n```" if fence else paragraph)
    blocks += [f"**{title}**\n\n{_format_section(title, body)}" for title, body in sections.items()]
    return "\n\n".join(blocks)


def _format_section(title: str, body: str) -> str:
    if title == "Examples":
        return f"```pycon\n{body}\n```"
    if title in ("References", "Notes"):
        return inspect.cleandoc(body)
    return "\n".join(_format_entry(entry) for entry in entries(body))


def _format_entry(entry: Entry) -> str:
    names = ", ".join(f"`{name}`" for name in entry.names)
    kind = f" ({entry.kind})" if entry.kind else ""
    return f"- {names}{kind}: {entry.text}" if entry.text else f"- {names}{kind}"


def capitalized(text: str) -> str:
    """Return the text with a capital first letter, and the rest unchanged."""
    return text[:1].upper() + text[1:]
