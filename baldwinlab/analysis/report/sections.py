"""Parts of a page: a template, filled; and the page that parts make."""

from __future__ import annotations

import re
from collections.abc import Sequence
from os.path import relpath
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import quote

from jinja2 import Environment, PackageLoader, StrictUndefined

from baldwinlab.analysis.figures import palette
from baldwinlab.analysis.report import content
from baldwinlab.analysis.report import phrases as words
from baldwinlab.core.files import is_local, write_atomically

FIGURE = re.compile(r'<figure id="([^"]+)"')
REFERENCE = re.compile(r'(<a href="#(figure-[^"]+)">)Figure</a>')
HEADING = re.compile(r'<h2 id="([^"]+)">(.+?)</h2>')
CONTENTS = "<!-- contents -->"


class Section(NamedTuple):
    """A part of a report with a heading of its own."""

    anchor: str
    title: str
    body: str  # HTML
    short: str = ""  # what a reader in a hurry is told of it
    of_claims: str = ""  # what is said of it where the claims of the study stand


class InShort(NamedTuple):
    """What stands at the head of a report, round the figure that sums up many conditions."""

    sentences: Sequence[str]
    table: str  # HTML


def render(template: str, **values: Any) -> str:
    """A template of the package, such as report/page.html, filled. It may use the filters of `words`, and report/macros.html."""
    loader = PackageLoader("baldwinlab.analysis", "")
    environment = Environment(
        loader=loader,
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    numbers = (
        words.number,
        words.signed,
        words.probability,
        words.span,
        words.interval,
        words.effect,
    )
    phrases = (words.compared, words.measure, words.sentence, words.from_paper)
    environment.filters |= {
        phrase.__name__: phrase for phrase in (*numbers, *phrases, content.shown)
    }
    environment.globals |= {"measures": words.MEASURES, "colours": palette.report_css()}
    return environment.get_template(template).render(**values)


def write_page(
    title: str, lead: str, sections: Sequence[Section], out: Path, figures: Path
) -> Path:
    """Write a self-contained page of these sections under a title and a lead (plain text). Raises OSError.

    `figures` is the folder in which their figures are kept.
    """
    page = render("report/page.html", title=title, lead=lead, sections=sections)
    return write_atomically(out, finished(page, out, figures).encode())


def finished(page: str, out: Path, figures: Path) -> str:
    """A page with its contents, its figures numbered in their order, and links to the files of these as they lie from `out`."""
    numbers = {name: number for number, name in enumerate(FIGURE.findall(page), 1)}
    page = REFERENCE.sub(
        lambda found: f"{found[1]}Figure\N{NO-BREAK SPACE}{numbers[found[2]]}</a>", page
    )
    entries = "".join(
        f'<li><a href="#{anchor}">{title}</a></li>' for anchor, title in HEADING.findall(page)
    )
    if is_local(out) and is_local(figures):
        place = quote(Path(relpath(figures, out.parent)).as_posix())
        page = page.replace('href="figures/', f'href="{place}/')
    return page.replace(
        CONTENTS,
        f'<nav class="contents" aria-label="Contents"><ol>{entries}</ol></nav>' if entries else "",
    )
