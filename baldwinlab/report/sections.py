"""Parts of a page: a template, filled; and the page that parts make."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from jinja2 import Environment, PackageLoader, StrictUndefined

from baldwinlab import palette
from baldwinlab.files import write_atomically
from baldwinlab.report import content, words


class Section(NamedTuple):
    """A part of a report with a heading of its own."""

    anchor: str
    title: str
    body: str  # HTML


def render(template: str, **values: Any) -> str:
    """A template of the package, such as report/page.html, filled. It may use the filters of `words`, and report/macros.html."""
    loader = PackageLoader("baldwinlab", "")
    environment = Environment(loader=loader, autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    numbers = (words.number, words.signed, words.probability, words.span, words.interval, words.effect)
    phrases = (words.compared, words.higher, words.sentence, words.from_paper)
    environment.filters |= {phrase.__name__: phrase for phrase in (*numbers, *phrases, content.shown)}
    environment.globals |= {"measures": words.MEASURES, "colours": palette.report_css()}
    return environment.get_template(template).render(**values)


def write_page(title: str, lead: str, sections: Sequence[Section], out: Path) -> Path:
    """Write a self-contained page of these sections under a title and a lead (plain text). Raises OSError."""
    return write_atomically(out, render("report/page.html", title=title, lead=lead, sections=sections).encode())
