"""Build the documentation's site: `python -m scripts.documentation [FOLDER] [NOTEBOOKS]`, by `make docs` into site/.

Its pages are Markdown files of this repository, laid out for Sphinx as they lie here, so that a link between two files is one
between two pages; with what `reference` makes of the code, and laboratories that run in the page. Any warning of Sphinx's, such
as of a link that leads nowhere or a page that stands in no section, is a fault. NOTEBOOKS is where
`scripts.notebooks` has written the notebooks with what their cells gave.
"""

from __future__ import annotations

import os
import re
import shutil
import sys
import tempfile
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

from baldwinlab.errors import BaldwinLabError, RefusedError
from baldwinlab.experiment import Experiment
from baldwinlab.extras import missing_extra
from baldwinlab.lab.export import live_page
from baldwinlab.presets import load
from baldwinlab.version import __version__
from scripts import reference

ROOT: Final = Path(__file__).parents[1]
TREE: Final = ROOT / "docs" / "navigation.toml"
STYLE: Final = ROOT / "docs" / "site.css"
ICON: Final = ROOT / "baldwinlab" / "lab" / "static" / "icon.svg"
MADE: Final = ".buildinfo"  # which Sphinx leaves in what it makes

SPHINX: Final = {
    "project": "baldwinlab",
    "html_title": f"baldwinlab {__version__}",
    "extensions": ["myst_parser"],
    "myst_heading_anchors": 6,
    "myst_enable_extensions": ["attrs_block"],
    "nitpicky": True,
    "smartquotes": False,  # a command's -- stays what it is
    "highlight_language": "text",  # of indented blocks
    "html_theme": "furo",
    "html_copy_source": False,
    "html_show_search_summary": False,  # for which a browser would fetch pages, as it must not from file://
    "html_show_copyright": False,
    "html_static_path": [str(STYLE)],
    "html_css_files": [STYLE.name],
    "html_favicon": str(ICON),
}


def build(out: Path, notebooks: Path | None = None) -> bool:
    """Make the site in a folder, anew; whether all is well, else the folder stays as it was.

    `notebooks` holds pages of executed notebooks.

    Raises RefusedError for a folder that holds anything else, and where the extra `docs` is missing.
    """
    if out.exists() and any(out.iterdir()) and not (out / MADE).exists():
        raise RefusedError(
            f"{out}: holds something else than the site; give another folder, or an empty one"
        )
    with tempfile.TemporaryDirectory() as folder:
        source, files, made = (Path(folder) / name for name in ("source", "files", "site"))
        tree = tomllib.loads(TREE.read_text("utf-8"))
        lay_out(source, tree)
        add_laboratories(source, files, tree["laboratories"])
        for page in sorted(notebooks.glob("*.html")) if notebooks else ():
            add_notebook(source, files, page)
        well = is_made(source, made, html_extra_path=[str(files)])
        if well:
            shutil.rmtree(out, ignore_errors=True)
            shutil.copytree(made, out)
        return well


def is_made(source: Path, out: Path, **settings: Any) -> bool:
    """Make HTML of a folder of Markdown; whether there was nothing to complain of.

    Raises RefusedError where the extra is missing.
    """
    try:
        from sphinx.application import Sphinx  # here, because only the extra has it
        from sphinx.util.docutils import docutils_namespace
    except ImportError:
        raise missing_extra("docs", "the site") from None
    with tempfile.TemporaryDirectory() as trees, docutils_namespace():
        app = Sphinx(
            source,
            None,
            out,
            trees,
            "html",
            SPHINX | settings,
            None,
            sys.stderr,
            warningiserror=True,
        )
        app.build(force_all=True)
    return app.statuscode == 0


def lay_out(source: Path, tree: dict[str, Any]) -> None:
    """All pages with what they show, in a folder, as they lie here."""
    made = reference.pages()
    for path, text in made.items():
        _write(source / path, text)
    for file in (ROOT / "docs").glob(
        "*.md"
    ):  # those of no section, too, so that Sphinx complains of them
        _write(source / file.relative_to(ROOT), file.read_text("utf-8"))
    contents = []
    for section in tree["sections"]:
        pages = [page for pattern in section["pages"] for page in expanded(pattern, made)]
        for page in pages:
            if _document(page) not in made:
                _write(source / _document(page), markdown_of(ROOT / page))
        contents.append(_toctree(section["title"], pages))
    _write(source / "index.md", (ROOT / "README.md").read_text("utf-8") + "\n".join(contents))
    for picture in [
        *(ROOT / "docs" / "pictures").iterdir(),
        *(ROOT / "baldwinlab" / "papers").glob("*/*.png"),
    ]:
        copy = source / picture.relative_to(ROOT)
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(picture, copy)


def expanded(pattern: str, made: dict[str, str]) -> list[str]:
    """The files that a pattern of the tree means; papers by year."""
    if "*" not in pattern:
        return [pattern]
    found = sorted(path.relative_to(ROOT).as_posix() for path in ROOT.glob(pattern))
    years = list(papers())
    return sorted(found, key=lambda path: years.index(path) if path in years else -1)


def papers() -> dict[str, str]:
    """What each paper is called in the tree, by the path of its page and in the order of years."""
    return {
        (paper.folder / "README.md").relative_to(ROOT).as_posix(): reference.short(paper)
        for paper in reference.by_year()
    }


def markdown_of(path: Path) -> str:
    """A page as Markdown: a notebook's text is that of its cells, in percent format or MyST's."""
    text = path.read_text("utf-8")
    if path.suffix == ".py":
        return "\n".join(_cells(text))
    return re.sub(r"^```\{code-cell\}.*\n(:.*\n)*", "```python\n", text, flags=re.MULTILINE)


def _cells(text: str) -> Iterator[str]:
    for cell in re.split(r"^# %%", text, flags=re.MULTILINE)[1:]:
        head, _, body = cell.partition("\n")
        if "[markdown]" in head:
            yield re.sub(r"^# ?", "", body, flags=re.MULTILINE)
        elif body.strip():
            yield f"```python\n{body.strip()}\n```\n"


def add_laboratories(source: Path, files: Path, wanted: list[dict[str, Any]]) -> None:
    """Put a laboratory after the introduction of each page that is to have one."""
    for each in wanted:
        page, presets = source / each["page"], [load(name) for name in each["experiments"]]
        name = f"laboratories/{re.sub('[^a-z0-9]+', '-', page.relative_to(source).with_suffix('').as_posix().lower())}.html"
        (files / name).parent.mkdir(parents=True, exist_ok=True)
        (files / name).write_bytes(live_page(presets))
        address = os.path.relpath(files / name, files / Path(each["page"]).parent).replace(
            os.sep, "/"
        )
        introduction, heading, rest = page.read_text("utf-8").partition("\n## ")
        _write(page, f"{introduction}\n{_frame(address, presets[0])}\n{heading}{rest}")


def add_notebook(source: Path, files: Path, executed: Path) -> None:
    """Put the page of an executed notebook beside that of its text, whose first lines lead there."""
    there = re.sub(r'href="(\.\./[^"]+)\.md', r'href="\1.html', executed.read_text("utf-8"))
    _write(files / "executed" / executed.name, there)
    page = source / "notebooks" / f"{executed.stem}.md"
    link = f'<p><a href="../executed/{executed.name}">The same with what its cells give</a>: curves, tables, lives that play.</p>'
    title, heading, rest = page.read_text("utf-8").partition("\n# ")
    head, _, text = rest.partition("\n")
    _write(page, f"{title}{heading}{head}\n\n{link}\n{text}")


def _frame(address: str, first: Experiment) -> str:
    return (
        f'<div class="laboratory"><iframe src="{address}" title="{first.name} evolves" loading="lazy"></iframe>\n'
        f'<p>Press <em>start</em>: evolution runs here, in your browser. <a href="{address}">Open it by itself</a>.</p></div>\n'
    )


def _toctree(title: str, pages: list[str]) -> str:
    labels = papers()
    lines = [
        f"{labels[page]} <{_document(page)[:-3]}>" if page in labels else _document(page)[:-3]
        for page in pages
    ]
    return "\n".join([f"\n```{{toctree}}\n:hidden:\n:caption: {title}\n", *lines, "```\n"])


def _document(page: str) -> str:
    """The path of a page's Markdown."""
    return page if page.endswith(".md") else f"{page}.md"


def _write(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, "utf-8")


if __name__ == "__main__":
    try:
        given = [Path(argument) for argument in sys.argv[1:3]]
        sys.exit(not build(*(given or [ROOT / "site"])))
    except (BaldwinLabError, OSError) as error:
        sys.exit(str(error))
