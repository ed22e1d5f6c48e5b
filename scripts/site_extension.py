"""An extension of Sphinx for the site.

It adds tables from the code, navigation and live laboratories. It shortens generated signatures.
"""

from __future__ import annotations

import inspect
import json
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, MutableSequence, Sequence
from pathlib import Path
from typing import Any, Final

import numpy.typing as npt
from docutils import nodes
from pydantic import BaseModel
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective
from sphinx.util.typing import stringify_annotation

from baldwinlab.analysis import typeface
from baldwinlab.cli.export import FORMATS
from baldwinlab.core import variables
from baldwinlab.core.variables import Variable
from baldwinlab.experiment import Experiment, registry
from baldwinlab.experiment.class_builder import choosing_fields
from baldwinlab.lab.pages.export import render_live_page
from baldwinlab.lab.sources.experiment_form import make_schema
from baldwinlab.papers.presets import load
from baldwinlab.studies.assays.catalog import load_assays

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
RESULT_CLASSES: Final = {
    "baldwinlab.Study",
    "baldwinlab.api.agents.AgentNetwork",
    "baldwinlab.api.checks.findings.CheckFinding",
    "baldwinlab.api.checks.reference.Agent",
    "baldwinlab.api.checks.reference.Item",
    "baldwinlab.api.checks.reference.Naive",
    "baldwinlab.api.compete.Competition",
    "baldwinlab.api.freezer.FrozenFile",
    "baldwinlab.api.integrations.optimizers.Evaluation",
    "baldwinlab.api.integrations.optimizers.Problem",
    "baldwinlab.models.miniworld.state.MiniWorldModel",
    "baldwinlab.models.miniworld.state.State",
    "baldwinlab.parts.Generation",
    "baldwinlab.parts.Lifetimes",
    "baldwinlab.parts.LineOfSight",
    "baldwinlab.parts.Mating",
    "baldwinlab.parts.Brood",
    "baldwinlab.parts.Synapse",
}
"""Classes whose objects only the package creates, so that the site shows no arguments."""
ARRAY_LIKE: Final = stringify_annotation(npt.ArrayLike, "smart")
ARRAY_TYPE: Final = re.compile(r"~?numpy\.ndarray\[.*?, ~?numpy\.dtype\[(.*?)\]\]")
DOCSTRING_ATTRIBUTE: Final = re.compile(r"(\w+(?:, \w+)*)( : .+)?")
PAGE_PATH: Final = re.compile(r"`?\bdocs/([\w/-]+)\.md`?")


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
        values = node.get("enum", [node.get("const")])
        return "one of " + ", ".join(f"`{value}`" for value in values)
    limits = [
        f"{sign}\N{NO-BREAK SPACE}{_format_limit(node[limit])}"
        for limit, sign in LIMITS.items()
        if limit in node
    ]
    item = node.get("prefixItems", [node.get("items")])[0]
    items = [f"of {value_type(item)}"] if item else []
    return ", ".join([" ".join([TYPES[node["type"]], *items]), *limits])


def _format_limit(limit: float) -> str:
    return f"{int(limit):,}" if limit == int(limit) else str(limit)


def format_parts(kind: str) -> str:
    """Return the built-in parts of a kind, with their settings and the variables of models."""
    paths = {kind_name: path for path, kind_name, _ in choosing_fields(Experiment)}
    path = paths.get(kind, "model")
    folder = path.rpartition(".")[0]
    parts = {
        name: registry.find_class(kind, name)
        for name in sorted(registry.package_parts(kind))
        if name != "miniworld"
    }
    rows: list[tuple[str, ...]] = [(f"`{name}`", _describe(part)) for name, part in parts.items()]
    heads: tuple[str, ...] = (kind, "effect")
    if kind == "model":
        heads = (*heads, "amount of learning")
        amounts = map(_format_amount, parts.values())
        rows = [(*row, amount) for row, amount in zip(rows, amounts, strict=True)]
    fields = [
        field
        for name, part in parts.items()
        for field in list_fields(part, f"{folder}.{registry.table_name(name)}".removeprefix("."))
    ]
    settings = f"\nSettings of these parts:\n\n{format_fields(fields)}" if fields else ""
    variable_rows = [
        (f"`{name}`", f"`{variable}`", entry.unit or "1", entry.meaning)
        for name, part in parts.items()
        for variable, entry in (part.records.items() if kind == "model" else ())
    ]
    variable_heads = ("model", "variable", "unit", "meaning")
    table = format_table(variable_heads, variable_rows) if variable_rows else ""
    recorded = f"\nRecorded variables of these models:\n\n{table}" if table else ""
    return f"Setting: `{path}`.\n\n{format_table(heads, rows)}{settings}{recorded}"


def _format_amount(model: Any) -> str:
    """Return the setting with the amount of learning, or "" without one."""
    name = model.learning_amount
    return f"`{registry.table_name(model.name)}.{name}`" if name else ""


def _describe(part: Any) -> str:
    """Return the docstring of a part without its sections, on one line."""
    docstring = inspect.getdoc(part) or ""
    return " ".join(re.split(r"^\w[\w ]*\n-{3,}$", docstring, flags=re.MULTILINE)[0].split())


def format_variables() -> str:
    """Return the sections of recorded variables, with dimensions, type, unit and meaning."""
    tables: list[tuple[str, str, Mapping[str, Variable]]] = [
        ("Run", "", variables.RUN_VARIABLES),
        ("Record", "", variables.RECORD_VARIABLES),
        ("Trace", "", variables.TRACE_VARIABLES),
        *(
            (f"Assay {name}", assay.question, assay.variables)
            for name, assay in load_assays().items()
        ),
    ]
    text = ""
    heads = ("variable", "dimensions", "type", "unit", "meaning")
    for title, description, table in tables:
        rows = [
            (f"`{name}`", ", ".join(entry.dims), entry.dtype.__name__, entry.unit, entry.meaning)
            for name, entry in table.items()
        ]
        text += f"## {title}\n\n{description}\n\n{format_table(heads, rows)}\n"
    order = variables.WEIGHT_ORDER
    return f"{text}## Order of the weights\n\n{order[0].upper()}{order[1:]}.\n"


def format_exports() -> str:
    """Return the table of export formats: content, options of the command, extra."""
    rows = [
        (
            f"`{format.name}`",
            format.content,
            ", ".join(f"`--{option.name}`" for option in format.options),
            f"`{format.extra}`" if format.extra else "",
        )
        for format in FORMATS.values()
    ]
    return format_table(("format", "content", "options", "extra"), rows)


class Reference(SphinxDirective):
    """A table from the code. Its name is that of the directive, its content the argument."""

    has_content = True

    def run(self) -> list[nodes.Node]:
        """Parse the Markdown of the table."""
        text = TABLES[self.name](" ".join(self.content))
        return self.parse_text_to_nodes(text, allow_section_headings=True)


TABLES: Final[Mapping[str, Callable[[str], str]]] = {
    "exports": lambda _: format_exports(),
    "parts": format_parts,
    "settings": lambda _: format_fields(list_fields(Experiment)),
    "variables": lambda _: format_variables(),
}


def skip_member(
    app: Sphinx, what: str, name: str, member: Any, skip: bool, options: Any
) -> bool | None:
    """Omit the configuration of pydantic, and fields that the list of attributes describes."""
    is_listed = (getattr(member, "__doc__", None) or "").startswith("Alias for field number")
    return True if name == "model_config" or is_listed else None


def shorten_signature(
    app: Sphinx,
    what: str,
    name: str,
    value: Any,
    options: Any,
    signature: str | None,
    annotation: str | None,
) -> tuple[str, str] | None:
    """Return a signature with short types, or none for a class that only the package creates."""
    if name in RESULT_CLASSES:
        return "", ""
    if inspect.isclass(value) and issubclass(value, BaseModel):
        # The settings have types and defaults.
        fields = value.model_fields.items()
        names = [name if field.is_required() else f"{name}=..." for name, field in fields]
        return f"(*, {', '.join(names)})" if names else "", ""
    if not signature:
        return None
    return _shorten_types(signature), _shorten_types(annotation or "")


def _shorten_types(text: str) -> str:
    """Return a signature in which types of libraries have their short names."""
    text = text.replace(ARRAY_LIKE, "~numpy.typing.ArrayLike").replace("mappingproxy({})", "{}")
    # Sphinx writes an alias in a union as a call.
    text = re.sub(r"~?[\w.]*\bTypeAliasForwardRef\('(\w+)'\)", r"\1", text)
    text = re.sub(r"\b(?:np|npt|xr)\.", "", text)
    return ARRAY_TYPE.sub(r"~numpy.typing.NDArray[\1]", text)


def extend_docstring(
    app: Sphinx, what: str, name: str, value: Any, options: Any, lines: MutableSequence[str]
) -> None:
    """Link pages, add types and defaults of attributes, and change sections of modules.

    A heading in the docstring of a module would be a section that contains its functions. Its
    numbered references would be footnotes without a mark in the text.
    """
    lines[:] = [PAGE_PATH.sub(r":doc:`/docs/\1`", line) for line in lines]
    if what == "module":
        lines[:] = [re.sub(r"^\.\. \[\d+\]", "- ", line) for line in lines]
        for number in range(len(lines) - 1, 0, -1):
            if re.fullmatch("-{3,}", lines[number]):
                lines[number - 1 : number + 1] = [f".. rubric:: {lines[number - 1]}", ""]
    elif inspect.isclass(value) and "Attributes" in lines:
        start = lines.index("Attributes") + 2
        for number in range(start, len(lines)):
            if match := DOCSTRING_ATTRIBUTE.fullmatch(lines[number]):
                lines[number] = _describe_attribute(value, match)


def _describe_attribute(owner: type, match: re.Match[str]) -> str:
    """Return the line of an attribute in a docstring, with its default."""
    first_name = match[1].partition(",")[0]
    text = match[0]
    defaults = {**vars(owner), **getattr(owner, "_field_defaults", {})}
    if match[2] and first_name in defaults:
        default = defaults[first_name]
        if default is None or isinstance(default, (bool, int, float, str, tuple)):
            text += f", default {default!r}"
    return text


def format_commands(app: Sphinx, doctree: nodes.document) -> None:
    """Repair the page of the commands, whose plain text is parsed as reStructuredText.

    The usage has the name of the command twice, and an example is a quotation.
    """
    if app.env.docname != "docs/reference/commands":
        return
    for block in list(doctree.findall(nodes.literal_block)):
        usage = re.sub(r"^(baldwinlab \w+) \1", r"\1", block.astext())
        block.replace_self(nodes.literal_block(usage, usage, language="text"))
    for quotation in list(doctree.findall(nodes.block_quote)):
        example = "\n".join(paragraph.rawsource for paragraph in quotation)
        quotation.replace_self(nodes.literal_block(example, example, language="text"))


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


def write_fonts(app: Sphinx, error: Exception | None) -> None:
    """Write a style sheet that contains the fonts. A page on disk may not read files of fonts."""
    Path(app.outdir, "_static", "fonts.css").write_text(typeface.font_css(), encoding="utf-8")


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the extension with Sphinx."""
    for name in TABLES:
        app.add_directive(name, Reference)
    app.connect("source-read", extend_page)
    app.connect("autodoc-skip-member", skip_member)
    # Before numpydoc, which replaces the sections of a docstring.
    app.connect("autodoc-process-docstring", extend_docstring, priority=100)
    app.connect("autodoc-process-signature", shorten_signature)
    app.connect("doctree-read", format_commands)
    app.connect("build-finished", write_laboratories)
    app.connect("build-finished", write_fonts)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
