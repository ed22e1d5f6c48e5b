"""An extension of Sphinx for the site: tables from the code, navigation and live laboratories."""

from __future__ import annotations

import inspect
import json
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

from baldwinlab.core import variables
from baldwinlab.core.assay_variables import ASSAY_VARIABLES
from baldwinlab.core.variables import Variable
from baldwinlab.experiment import Experiment, registry
from baldwinlab.experiment.class_builder import choosing_fields
from baldwinlab.lab.export import render_live_page
from baldwinlab.lab.schema import make_schema
from baldwinlab.papers.presets import load

NAVIGATION: Final = Path(__file__).parents[1] / "docs" / "navigation.txt"
LABORATORIES: Final = {
    "docs/tutorials/first-study": ["evo+self-taught/A"],
    "baldwinlab/papers/le_2019/README": ["evo+self-taught/B", "evo/B", "self-taught/B"],
}
"""Presets of the laboratory that runs inside a page."""

TYPES: Final = {
    "integer": "whole number",
    "number": "number",
    "boolean": "true or false",
    "string": "text",
    "array": "list",
    "object": "table",
}
LIMITS: Final = {
    "minimum": "≥",
    "exclusiveMinimum": ">",
    "maximum": "≤",
    "exclusiveMaximum": "<",
}


def format_table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a Markdown table."""
    lines = [heads, ["---"] * len(heads), *rows]
    cells = (" | ".join(cell.replace("|", "\\|") for cell in line) for line in lines)
    return "".join(f"| {line} |\n" for line in cells)


def list_fields(model: Any, path: str = "") -> list[tuple[str, Any]]:
    """Return the dotted path and the JSON schema of each field of a class.

    N is the number of a table in a list.
    """
    schema = make_schema(model)
    return list(_walk_fields(schema, schema.get("$defs", {}), path))


def _walk_fields(
    schema: Mapping[str, Any], tables: Mapping[str, Any], path: str
) -> Iterator[tuple[str, Any]]:
    for name, node in schema.get("properties", {}).items():
        items = node.get("items", node)
        field_path = f"{path}.{name}" if path else name
        if "$ref" in items:
            nested = tables[items["$ref"].rpartition("/")[2]]
            yield from _walk_fields(nested, tables, field_path + ".N" * (items is not node))
        else:
            yield field_path, node


def format_fields(fields: Iterable[tuple[str, Any]]) -> str:
    """Return a table of settings: path, type and limits, default, meaning."""
    rows = [
        (f"`{path}`", value_type(node), _default(node), node.get("description", ""))
        for path, node in fields
    ]
    heads = ("setting", "type and limits", "default", "meaning and unit")
    return format_table(heads, rows) if rows else ""


def _default(node: Mapping[str, Any]) -> str:
    if node.get("default") is None:
        return "none" if "default" in node else "required"
    return f"`{json.dumps(node['default'])}`"


def value_type(node: Mapping[str, Any]) -> str:
    """Return the type and the limits of a setting as text."""
    options = [option for option in node.get("anyOf", ()) if option.get("type") != "null"]
    if options:
        return " or ".join(map(value_type, options))
    if "enum" in node or "const" in node:
        return "one of " + ", ".join(
            f"`{value}`" for value in node.get("enum", [node.get("const")])
        )
    limits = [f"{sign} {node[limit]:,}" for limit, sign in LIMITS.items() if limit in node]
    item = node.get("prefixItems", [node.get("items")])[0]
    items = [f"of {value_type(item)}"] if item else []
    return ", ".join([" ".join([TYPES[node["type"]], *items]), *limits])


def format_parts(kind: str) -> str:
    """Return the built-in parts of a kind, with their settings."""
    paths = {kind_name: path for path, kind_name, _ in choosing_fields(Experiment)}
    path = paths.get(kind, "model")
    folder = path.rpartition(".")[0]
    parts = {
        name: registry.find_class(kind, name)
        for name in sorted(registry.package_parts(kind))
        if name != "miniworld"
    }
    rows = [(f"`{name}`", _describe(part)) for name, part in parts.items()]
    fields = [
        field
        for name, part in parts.items()
        for field in list_fields(part, f"{folder}.{registry.table_name(name)}".removeprefix("."))
    ]
    settings = f"\nSettings of these parts:\n\n{format_fields(fields)}" if fields else ""
    return f"Setting: `{path}`.\n\n{format_table((kind, 'effect'), rows)}{settings}"


def _describe(part: Any) -> str:
    """Return the docstring of a part without its sections, on one line."""
    docstring = inspect.getdoc(part) or ""
    return " ".join(re.split(r"^\w[\w ]*\n-{3,}$", docstring, flags=re.MULTILINE)[0].split())


def format_variables() -> str:
    """Return the tables of recorded variables: dimensions, type, unit, meaning."""
    tables: dict[str, Mapping[str, Variable]] = {
        "Run": variables.RUN_VARIABLES,
        "Record": variables.RECORD_VARIABLES,
        "Trace": variables.TRACE_VARIABLES,
        **{f"Assay {name}": measured for name, measured in ASSAY_VARIABLES.items()},
    }
    text = f"Order of the weights: {variables.WEIGHT_ORDER}.\n"
    for title, table in tables.items():
        rows = [
            (f"`{name}`", ", ".join(entry.dims), entry.dtype.__name__, entry.unit, entry.meaning)
            for name, entry in table.items()
        ]
        heads = ("variable", "dimensions", "type", "unit", "meaning")
        text += f"\n**{title}**\n\n{format_table(heads, rows)}"
    return text


class Reference(SphinxDirective):
    """A table from the code. Its name is that of the directive, its content the argument."""

    has_content = True

    def run(self) -> list[nodes.Node]:
        """Parse the Markdown of the table."""
        if self.name == "parts":
            text = format_parts(" ".join(self.content))
        elif self.name == "variables":
            text = format_variables()
        else:
            text = format_fields(list_fields(Experiment))
        return self.parse_text_to_nodes(text)


def extend_page(app: Sphinx, page: str, source: list[str]) -> None:
    """Add what a page has only on the site: navigation, a laboratory, results of a notebook."""
    if page == "README":
        source[0] += "\n" + NAVIGATION.read_text("utf-8")
    name = page.rpartition("/")[2]
    up = "../" * page.count("/")
    if page in LABORATORIES:
        frame = f'<iframe src="{up}{laboratory_path(page)}" title="Evolution" loading="lazy">'
        html = f'<div class="laboratory">{frame}</iframe></div>'
        source[0] = source[0].replace("\n## ", f"\n{html}\n\n## ", 1)
    if page.startswith("notebooks/") and name != "README":
        link = f'<p><a href="../executed/{name}.html">This notebook with its results</a></p>'
        source[0] = re.sub(r"(?m)(^# .+\n)", rf"\1\n{link}\n", source[0], count=1)


def laboratory_path(page: str) -> str:
    """Return the path of a laboratory on the site."""
    return f"laboratories/{page.lower().replace('/', '-')}.html"


def write_laboratories(app: Sphinx, error: Exception | None) -> None:
    """Write the laboratories of all pages."""
    for page, presets in LABORATORIES.items():
        path = Path(app.outdir, laboratory_path(page))
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(render_live_page([load(preset) for preset in presets]))


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the extension with Sphinx."""
    for name in ("parts", "settings", "variables"):
        app.add_directive(name, Reference)
    app.connect("source-read", extend_page)
    app.connect("build-finished", write_laboratories)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
