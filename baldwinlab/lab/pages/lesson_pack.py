"""The teaching pack: lessons, worksheets, answers, and two pages that simulate.

The texts are the Markdown files of docs/teaching. An installed package contains copies.
"""

from __future__ import annotations

import posixpath
import re
from collections.abc import Iterator, Mapping
from itertools import count, pairwise
from pathlib import Path
from typing import Final, NamedTuple

from markdown_it import MarkdownIt
from markdown_it.token import Token

from baldwinlab.analysis import palette, typeface
from baldwinlab.lab.pages.explorable import render_explorable
from baldwinlab.lab.pages.export import render_live_page
from baldwinlab.lab.pages.single_page import make_environment
from baldwinlab.papers import presets

# The presets of the laboratory. The lessons and the worksheets name them.
PRESETS: Final = (
    "evo+self-taught/A",
    "evo/A",
    "evo+self-taught/B",
    "evo/B",
    "evo+random-targets/B",
    "evo+drift/B",
    "evo+motor-noise/B",
)
ESSAY_FILE: Final = "baldwin.html"
LABORATORY_FILE: Final = "learners.html"
STUDENTS_FOLDER: Final = "students"
N_LESSONS: Final = 4
LESSONS: Final = tuple(f"lesson-{number}" for number in range(1, N_LESSONS + 1))
# The texts of the lecturer are outside the folder that students get.
LECTURER_TEXTS: Final = ("index", "answers")
STUDENT_TEXTS: Final = (*LESSONS, "questions")
# The folder of the texts in a clone of the repository.
CLONED_TEXTS: Final = Path(__file__).parents[3] / "docs" / "teaching"


class Text(NamedTuple):
    """A Markdown text of the pack."""

    title: str
    body: str  # Markdown without the title.


def render_lesson_pack() -> dict[str, bytes]:
    """Return the content of each file by its path. The lecturer begins with `index.html`."""
    texts = {name: _read_text(name) for name in (*LECTURER_TEXTS, *STUDENT_TEXTS)}
    titles = [texts[name].title for name in LESSONS]
    pages = {
        f"{STUDENTS_FOLDER}/{ESSAY_FILE}": render_explorable(),
        f"{STUDENTS_FOLDER}/{LABORATORY_FILE}": render_live_page(
            [presets.load(name) for name in PRESETS]
        ),
        f"{STUDENTS_FOLDER}/index.html": _render("students.html", lessons=titles),
    }
    overview = {"index.html": "All pages"}
    for name, text in texts.items():
        path = _find_path(name)
        if name in LESSONS:
            lesson, worksheet = _split_lesson(text)
            worksheet_path = _find_path(name.replace("lesson", "worksheet"))
            links = overview | {posixpath.basename(worksheet_path): "Worksheet to print"}
            pages[path] = _render_text(path, lesson, links)
            pages[worksheet_path] = _render_text(
                worksheet_path, worksheet, overview, is_worksheet=True
            )
        else:
            pages[path] = _render_text(path, text, {} if name == "index" else overview)
    return pages


def find_texts() -> Path:
    """Return the folder of the Markdown texts: in an installed package, or in a clone."""
    installed_texts = Path(__file__).parent / "teaching"
    return installed_texts if installed_texts.is_dir() else CLONED_TEXTS


def _read_text(name: str) -> Text:
    title, _, body = (find_texts() / f"{name}.md").read_text("utf-8").partition("\n")
    return Text(title.removeprefix("# "), body)


def _find_path(name: str) -> str:
    return f"{name}.html" if name in LECTURER_TEXTS else f"{STUDENTS_FOLDER}/{name}.html"


def _split_lesson(text: Text) -> tuple[Text, Text]:
    """Return a lesson without its worksheet, and the worksheet."""
    lesson, _, worksheet = text.body.partition("\n## Worksheet\n")
    # The last line of the file is a link to the next page. It belongs to the lesson.
    worksheet, _, next_page = worksheet.rstrip().rpartition("\n")
    return (
        Text(text.title, f"{lesson}\n{next_page}\n"),
        Text(f"Worksheet. {text.title}", worksheet),
    )


def _render_text(
    path: str, text: Text, links: Mapping[str, str], *, is_worksheet: bool = False
) -> bytes:
    markdown = MarkdownIt("commonmark").enable("table")
    tokens = markdown.parse(text.body)
    folder = posixpath.dirname(path)
    for token in tokens:
        if token.children:
            token.children = list(_link_pages(token.children, folder))
    _mark_headings(tokens)
    return _render(
        "lesson.html",
        title=text.title,
        content=_wrap_tables(markdown.renderer.render(tokens, markdown.options, {})),
        links=links,
        is_worksheet=is_worksheet,
    )


def _wrap_tables(html: str) -> str:
    """Put each table into a region that scrolls. Screen readers read the region's name."""
    numbers = count(1)
    opened = re.sub(
        "<table>",
        lambda _: (
            '<div class="scroll" tabindex="0" role="region" '
            f'aria-label="Table {next(numbers)}"><table>'
        ),
        html,
    )
    return opened.replace("</table>", "</table></div>")


def _link_pages(tokens: list[Token], folder: str) -> Iterator[Token]:
    """Yield the tokens of a line. Links to pages of the pack get the address in the pack.

    A link to any other page becomes text. The name of a simulating page in code becomes a link.
    """
    is_linked = False
    for token in tokens:
        if token.type == "link_open":
            address = _find_address(str(token.attrs["href"]), folder)
            is_linked = address is not None
            if is_linked:
                token.attrs["href"] = address or ""
        if token.type in ("link_open", "link_close") and not is_linked:
            continue
        if token.type == "code_inline" and token.content in (ESSAY_FILE, LABORATORY_FILE):
            address = posixpath.relpath(f"{STUDENTS_FOLDER}/{token.content}", folder or ".")
            token = Token("html_inline", "", 0, content=f'<a href="{address}">{token.content}</a>')
        yield token


def _find_address(link: str, folder: str) -> str | None:
    """Return the address of a page of the pack, relative to `folder`; None for other pages."""
    target, _, anchor = link.partition("#")
    name = target.removesuffix(".md")
    if name not in (*LECTURER_TEXTS, *STUDENT_TEXTS):
        return None
    address = posixpath.relpath(_find_path(name), folder or ".")
    return f"{address}#{anchor}" if anchor else address


def _mark_headings(tokens: list[Token]) -> None:
    """Give each heading the id that links in the texts use, such as "the-two-phases"."""
    # The token after the opening of a heading is the text of the heading.
    for opening, line in pairwise(tokens):
        if opening.type == "heading_open":
            words = re.sub(r"[^\w\s-]", "", line.content.lower())
            opening.attrs["id"] = re.sub(r"\s", "-", words)


def _render(template: str, **data: object) -> bytes:
    page = make_environment().get_template(template)
    styles = typeface.font_css() + palette.report_css()
    text = page.render(styles=styles, essay=ESSAY_FILE, laboratory=LABORATORY_FILE, **data)
    return text.encode()
