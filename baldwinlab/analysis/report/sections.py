"""Make HTML pages from sections with figures, and complete the contents and the links."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from os.path import relpath
from pathlib import Path
from typing import Any, Final, NamedTuple
from urllib.parse import quote, unquote

from jinja2 import Environment, PackageLoader, StrictUndefined, select_autoescape
from matplotlib.figure import Figure as Drawing

from baldwinlab.analysis import palette, typeface
from baldwinlab.analysis.figures.style import save_figure
from baldwinlab.analysis.report import content, tables
from baldwinlab.analysis.report.data import Link
from baldwinlab.analysis.results import headlines, numbers, table
from baldwinlab.analysis.results.numbers import to_csv
from baldwinlab.core.file_writing import write_atomically
from baldwinlab.core.files import is_local

FIGURE_PATTERN: Final = re.compile(r'<figure id="([^"]+)"')
REFERENCE_PATTERN: Final = re.compile(r'(<a href="#(figure-[^"]+)">)Figure</a>')
FILE_PATTERN: Final = re.compile(r'<a href="figures/([^"]+)">([^<]*</a> ?)')
HEADING_PATTERN: Final = re.compile(r'<h2 id="([^"]+)">(.+?)</h2>')
CONTENTS_PLACEHOLDER: Final = "<!-- contents -->"
# Text in a figure with commands but without links. `complete_page` replaces this text.
WATCH_PLACEHOLDER: Final = "<!-- watch -->"
TEMPLATE_FILTERS: Final[dict[str, Callable[..., Any]]] = {
    "number": numbers.format_number,
    "p_value": numbers.format_p_value,
    "effect": table.format_effect,
    "comparison": tables.describe_comparison,
    "finding": tables.describe_finding,
    "badge": tables.badge,
    "verdict": tables.show_verdict,
    "contrasts_table": tables.tabulate_contrasts,
    "summary": headlines.summarize_contrasts,
    "tests_table": tables.tabulate_tests,
    "method": table.describe_method,
    "weakest": content.find_weakest_findings,
}
# Widths of figures, in inches, that select a CSS class: below the first two, or above the last.
NARROW_WIDTH: Final = 4.0
SLIM_WIDTH: Final = 6.0
BROAD_WIDTH: Final = 8.0


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
    `TEMPLATE_FILTERS` and the macros of ``report/macros.html``. HTML is escaped, Markdown is not.
    """
    return _make_environment().get_template(template).render(**values)


# Cached, because an environment stores the compiled templates.
@cache
def _make_environment() -> Environment:
    environment = Environment(
        loader=PackageLoader("baldwinlab.analysis", ""),
        autoescape=select_autoescape(["html"]),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= TEMPLATE_FILTERS
    environment.globals["styles"] = (
        typeface.font_css() + palette.report_css() + palette.figure_css()
    )
    return environment


def write_page(
    title: str, lead: str, sections: Sequence[Section], out: Path, figures: Path, note: str = ""
) -> Path:
    """Write a self-contained HTML page to `out`, with links to files in the folder `figures`.

    `lead`: the answer. `note`: what the numbers of the answer are.
    """
    page = render("report/page.html", title=title, lead=lead, note=note, sections=sections)
    return write_atomically(out, complete_page(page, out, figures).encode())


def complete_page(page: str, out: Path, figures: Path, watch: str = "") -> str:
    """Return a page with its contents, numbered figures, and links to stored files and lifetimes.

    `out`: file that the page will be written to. Links are relative to this file. `watch`: HTML of
    the links to lifetimes, for figures with commands but without links.
    """
    figure_names = FIGURE_PATTERN.findall(page)
    figure_numbers = {name: number for number, name in enumerate(figure_names, 1)}

    def number_reference(match: re.Match[str]) -> str:
        opening_tag, figure_name = match.groups()
        return f"{opening_tag}Figure\N{NO-BREAK SPACE}{figure_numbers[figure_name]}</a>"

    page = REFERENCE_PATTERN.sub(number_reference, page)
    if is_local(out) and is_local(figures):
        folder = quote(Path(relpath(figures, out.parent)).as_posix())

        def link_file(match: re.Match[str]) -> str:
            name, rest = match.groups()
            # In a folder that cannot be written, the file does not exist.
            is_stored = (figures / unquote(name)).exists()
            return f'<a href="{folder}/{name}">{rest}' if is_stored else ""

        page = FILE_PATTERN.sub(link_file, page)
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


class ReportFigure(NamedTuple):
    """A figure with its caption and its data."""

    title: str
    caption: str
    # Alternative text for screen readers.
    alternative: str
    figure: Drawing
    # Rows of the figure's CSV file.
    table: Sequence[Mapping[str, Any]] = ()
    # Commands that compute the figure's data again, in the directory of the study.
    commands: Sequence[str] = ()
    # Lifetimes that the figure shows or summarizes.
    links: Sequence[Link] = ()
    # Name of the files without a suffix. In the report of a study, `report.figures` sets the name.
    name: str = ""
    is_setup: bool = False  # Whether the figure describes the model.


def save_and_inline(figure: ReportFigure, folder: Path) -> dict[str, Any]:
    """Save a figure as SVG, PDF, PNG and CSV, and return the values for ``report/macros.html``."""
    saved = save_figure(figure.figure, folder, figure.name)
    files = {kind: f"{figure.name}.{kind.lower()}" for kind in ("SVG", "PDF", "PNG")}
    if figure.table:
        files["CSV"] = f"{figure.name}.csv"
        columns = dict.fromkeys(column for row in figure.table for column in row)
        write_atomically(folder / files["CSV"], to_csv(list(columns), figure.table))
    return {
        "name": figure.name,
        "is_setup": figure.is_setup,
        "title": figure.title,
        "caption": figure.caption,
        "alternative": figure.alternative,
        "shape": _name_shape(figure.figure),
        "sizes": {"wide": saved.wide, "narrow": saved.narrow},
        "image": saved.image,
        "files": files,
        "commands": figure.commands,
        "links": figure.links,
    }


def _name_shape(figure: Drawing) -> str:
    """Return the CSS classes for the size of a figure in inches, such as "slim tall"."""
    width, height = figure.get_size_inches()
    if width < NARROW_WIDTH:
        return "narrow"
    classes = {"slim": width < SLIM_WIDTH, "broad": width > BROAD_WIDTH, "tall": height > width}
    return " ".join(name for name, applies in classes.items() if applies)
