"""Sections of an HTML page, and the page made from them."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from functools import cache
from os.path import relpath
from pathlib import Path
from typing import Any, Final, NamedTuple
from urllib.parse import quote

from jinja2 import Environment, PackageLoader, StrictUndefined

from baldwinlab.analysis import palette
from baldwinlab.analysis.report import content, phrases, tables
from baldwinlab.analysis.results import numbers, table
from baldwinlab.core.file_writing import write_atomically
from baldwinlab.core.files import is_local

FIGURE_PATTERN: Final = re.compile(r'<figure id="([^"]+)"')
REFERENCE_PATTERN: Final = re.compile(r'(<a href="#(figure-[^"]+)">)Figure</a>')
HEADING_PATTERN: Final = re.compile(r'<h2 id="([^"]+)">(.+?)</h2>')
CONTENTS_PLACEHOLDER: Final = "<!-- contents -->"
# In a figure without links to lifetimes.
WATCH_PLACEHOLDER: Final = "<!-- watch -->"
TEMPLATE_FILTERS: Final[dict[str, Callable[..., Any]]] = {
    "number": numbers.format_number,
    "p_value": numbers.format_p_value,
    "effect": table.format_effect,
    "comparison": phrases.describe_comparison,
    "finding": phrases.describe_finding,
    "badge": tables.badge,
    "verdict": tables.show_verdict,
    "contrasts_table": tables.tabulate_contrasts,
    "summary": table.summarize_contrasts,
    "method": table.describe_method,
    "weakest": content.find_weakest_findings,
}


class Section(NamedTuple):
    """A section of a report, with its own heading."""

    anchor: str
    title: str
    # HTML.
    body: str
    # The summary of the section at the top of the report.
    summary: str = ""
    # A remark that the section adds to the claims of the study.
    claims_note: str = ""


class ReportSummary(NamedTuple):
    """Sentences and a table at the top of a report, below its first figure."""

    sentences: Sequence[str]
    # HTML.
    table: str


def render(template: str, **values: Any) -> str:
    """Fill a template of the package.

    `template`: path below the package, for example ``report/page.html``. The template may use
    `TEMPLATE_FILTERS` and the macros of ``report/macros.html``.
    """
    return _make_environment().get_template(template).render(**values)


# An environment keeps the compiled templates.
@cache
def _make_environment() -> Environment:
    environment = Environment(
        loader=PackageLoader("baldwinlab.analysis", ""),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= TEMPLATE_FILTERS
    environment.globals["colours"] = palette.report_css()
    return environment


def write_page(
    title: str, lead: str, sections: Sequence[Section], out: Path, figures: Path
) -> Path:
    """Write a self-contained HTML page."""
    page = render("report/page.html", title=title, lead=lead, sections=sections)
    return write_atomically(out, complete_page(page, out, figures).encode())


def complete_page(page: str, out: Path, figures: Path, watch: str = "") -> str:
    """Return a page with its contents, numbered figures, and links to files and lifetimes.

    `out`: file that the page will be written to. Links are relative to it. `watch`: HTML of the
    links to lifetimes in figures that have none.
    """
    figure_names = FIGURE_PATTERN.findall(page)
    figure_numbers = {name: number for number, name in enumerate(figure_names, 1)}

    def number_reference(match: re.Match[str]) -> str:
        opening_tag, figure_name = match.groups()
        return f"{opening_tag}Figure\N{NO-BREAK SPACE}{figure_numbers[figure_name]}</a>"

    page = REFERENCE_PATTERN.sub(number_reference, page)
    if is_local(out) and is_local(figures):
        folder = quote(Path(relpath(figures, out.parent)).as_posix())
        page = page.replace('href="figures/', f'href="{folder}/')
    page = page.replace(WATCH_PLACEHOLDER, watch)
    return page.replace(CONTENTS_PLACEHOLDER, _list_contents(page))


def _list_contents(page: str) -> str:
    entries = [
        f'<li><a href="#{anchor}">{title}</a></li>'
        for anchor, title in HEADING_PATTERN.findall(page)
    ]
    if len(entries) < 2:
        return ""
    return (
        '<nav class="contents" aria-label="Contents">'
        '<button type="button" popovertarget="contents">Contents</button>'
        f'<ol id="contents" popover>{"".join(entries)}</ol></nav>'
    )
