"""Generate llms.txt, a summary of the package and its documentation for coding assistants.

The format is that of https://llmstxt.org.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, Final

import baldwinlab
from baldwinlab.cli import COMMANDS
from baldwinlab.cli.options import app
from baldwinlab.experiment import Experiment, registry
from baldwinlab.experiment.class_builder import choosing_fields
from baldwinlab.parts.part import hook_names
from scripts import glossary, part_reference
from scripts.described import fields_of, parse_docstring, signature, value_type

ROOT: Final = Path(__file__).parents[1]


def llms_text(pages: Mapping[str, str], sections: Mapping[str, Iterable[str]]) -> str:
    """Return llms.txt.

    Parameters
    ----------
    pages
        Markdown of each page, by its path on the site.
    sections
        Paths of the pages of each section of the site, by title.
    """
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    blocks = [
        f"# baldwinlab\n\n> {project['description']}",
        "Install with `pip install .` in the folder of the source, "
        "and import with `import baldwinlab as bl`.",
        *(_links(title, paths, pages) for title, paths in sections.items()),
        _list("Commands", _commands()),
        _list("Python functions and classes", _python_names()),
        _list("Settings of an experiment", _settings()),
        _list("Built-in parts", _built_in_parts()),
        _list("Kinds of part and their hooks", _hooks()),
        f"## Rules for hooks\n\n{part_reference.RULES_FOR_HOOKS}",
        _list("Glossary", _terms()),
    ]
    return "\n\n".join(blocks) + "\n"


def _list(title: str, lines: Iterable[str]) -> str:
    return "\n".join([f"## {title}\n", *(f"- {line}" for line in lines)])


def _links(title: str, paths: Iterable[str], pages: Mapping[str, str]) -> str:
    lines = [
        f"[{page_title(pages[path])}]({path.removesuffix('.md')}.html): "
        f"{first_sentence(pages[path])}"
        for path in paths
    ]
    return _list(title, lines)


def page_title(text: str) -> str:
    """Return the title of a page."""
    heading = re.search(r"^# (.+)$", text, re.MULTILINE)
    return heading[1] if heading else ""


def first_sentence(text: str) -> str:
    """Return the first sentence of a page, without links."""
    body = re.sub(r"^(```|~~~).*?^\1\n", "", text, flags=re.MULTILINE | re.DOTALL)
    _, _, body = f"\n{body}".partition("\n# ")
    for paragraph in body.split("\n\n")[1:]:
        if re.match(r"[A-Z`*\[]", paragraph.strip()):
            plain = re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", " ".join(paragraph.split()))
            return re.split(r"(?<=[.:]) (?=[A-Z`])", plain)[0]
    return ""


def _commands() -> Iterable[str]:
    for name in COMMANDS:
        yield f"`baldwinlab {name}`: {_summary(app[name].help)}"


def _python_names() -> Iterable[str]:
    for name in sorted(baldwinlab.__all__, key=str.lower):
        value = getattr(baldwinlab, name)
        if callable(value):
            arguments = "" if isinstance(value, type) else " ".join(signature(value).split())
            yield f"`bl.{name}{arguments}`: {_summary(value.__doc__)}"


def _settings() -> Iterable[str]:
    for path, node in fields_of(Experiment):
        yield f"`{path}` ({value_type(node)}): {node.get('description', '')}"


def _built_in_parts() -> Iterable[str]:
    for path, kind, _ in choosing_fields(Experiment):
        for name in registry.package_parts(kind):
            part = registry.find_class(kind, name)
            yield f"`{path} = {name!r}`: {_summary(part.__doc__)}"


def _hooks() -> Iterable[str]:
    for kind in part_reference.kinds():
        yield f"`{kind.__name__}`: {_summary(kind.__doc__)}"
        for name in hook_names(kind):
            hook: Any = getattr(kind, name)
            arguments = " ".join(signature(hook).split())
            yield f"`{kind.__name__}.{name}{arguments}`: {_summary(hook.__doc__)}"


def _terms() -> Iterable[str]:
    text = glossary.FILE.read_text("utf-8")
    for term in glossary.terms():
        section = text.partition(f"## {term}\n")[2].partition("\n## ")[0]
        plain = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", section)
        yield f"{term}: {' '.join(plain.split())}"


def _summary(docstring: str | None) -> str:
    """Return the first paragraph of a docstring on one line."""
    text = parse_docstring(docstring).text.partition("\n\n")[0]
    return " ".join(text.split())
