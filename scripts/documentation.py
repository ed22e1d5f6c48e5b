"""Build the documentation site: `python -m scripts.documentation [FOLDER] [NOTEBOOKS]`.

`make docs` writes the site to site/. The pages are Markdown files of this repository. Sphinx reads
them under their paths, so that a link between two files becomes a link between two pages.
`scripts.reference` generates further pages from the code, and `scripts.llms` generates llms.txt.
`scripts.glossary` links the terms of the glossary. Every warning of Sphinx is an error, for example
a dead link or a page that is in no section. NOTEBOOKS is the folder to which `scripts.notebooks`
has written the executed notebooks.
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

from baldwinlab._version import __version__
from baldwinlab.core.errors import BaldwinLabError, RefusedError
from baldwinlab.core.extras import missing_extra_error
from baldwinlab.experiment import Experiment
from baldwinlab.lab.export import render_live_page
from baldwinlab.papers.presets import load
from scripts import reference
from scripts.llms import llms_text

ROOT: Final = Path(__file__).parents[1]
NAVIGATION: Final = ROOT / "docs" / "navigation.toml"
STYLE: Final = ROOT / "docs" / "site.css"
ICON: Final = ROOT / "baldwinlab" / "lab" / "static" / "icon.svg"
LINKED_FILES: Final = (
    ROOT / "CITATION.cff",
    *sorted((ROOT / "examples" / "cluster").iterdir()),
)
"""Files that pages link and that are not pages. The site offers these files for download."""
SPHINX_MARK: Final = ".buildinfo"
"""A file in every folder that Sphinx wrote."""

SPHINX_SETTINGS: Final = {
    "project": "baldwinlab",
    "html_title": f"baldwinlab {__version__}",
    "extensions": ["myst_parser", "scripts.glossary"],
    "myst_heading_anchors": 6,
    "myst_enable_extensions": ["attrs_block"],
    "nitpicky": True,
    # Sphinx would replace the two dashes of an option by a long dash.
    "smartquotes": False,
    # The language of code blocks that name none.
    "highlight_language": "text",
    "html_theme": "furo",
    "html_copy_source": False,
    # The search fetches pages for its summaries. A browser refuses this for files on disk.
    "html_show_search_summary": False,
    "html_show_copyright": False,
    "html_static_path": [str(STYLE)],
    "html_css_files": [STYLE.name],
    "html_favicon": str(ICON),
}


def build(out: Path, notebooks: Path | None = None) -> bool:
    """Build the site in a folder.

    Parameters
    ----------
    out
        Folder of the site.
        The folder is replaced if the build succeeds, and does not change if the build fails.
    notebooks
        Folder with one HTML page per executed notebook, or None.

    Returns
    -------
    bool
        Whether Sphinx built the site without a warning.

    Raises
    ------
    RefusedError
        If `out` contains files that are not a site, or if the extra `docs` is not installed.
    """
    if out.exists() and any(out.iterdir()) and not (out / SPHINX_MARK).exists():
        raise RefusedError(
            f"{out}: the folder contains files that are not a site. "
            "Give another or an empty folder."
        )
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder) / "source"
        files = Path(folder) / "files"
        site = Path(folder) / "site"
        navigation = tomllib.loads(NAVIGATION.read_text("utf-8"))
        write_sources(source, navigation)
        _write(files / "llms.txt", assistant_summary(source, navigation))
        add_laboratories(source, files, navigation["laboratories"])
        for page in sorted(notebooks.glob("*.html")) if notebooks else ():
            add_notebook(source, files, page)
        succeeded = run_sphinx(source, site, html_extra_path=[str(files)])
        if succeeded:
            shutil.rmtree(out, ignore_errors=True)
            shutil.copytree(site, out)
        return succeeded


def run_sphinx(source: Path, out: Path, **settings: Any) -> bool:
    """Convert a folder of Markdown to HTML and return whether there was no warning.

    Raises
    ------
    RefusedError
        If the extra `docs` is not installed.
    """
    try:
        # Only the extra `docs` installs Sphinx.
        from sphinx.application import Sphinx
        from sphinx.util.docutils import docutils_namespace
    except ImportError:
        raise missing_extra_error("docs", "the site") from None
    with tempfile.TemporaryDirectory() as doctrees, docutils_namespace():
        app = Sphinx(
            source,
            None,
            out,
            doctrees,
            "html",
            SPHINX_SETTINGS | settings,
            None,
            sys.stderr,
            warningiserror=True,
        )
        app.build(force_all=True)
    return app.statuscode == 0


def write_sources(source: Path, navigation: dict[str, Any]) -> None:
    """Write all pages and pictures to the folder that Sphinx reads."""
    generated = reference.pages()
    for path, text in generated.items():
        _write(source / path, text)
    # Sphinx also gets the pages that are in no section, and reports each as an error.
    for file in (ROOT / "docs").rglob("*.md"):
        _write(source / file.relative_to(ROOT), page_text(file))
    contents = []
    for title, pages in sections(navigation, generated).items():
        for page in pages:
            if _document(page) not in generated:
                _write(source / _document(page), page_text(ROOT / page))
        contents.append(_toctree(title, pages))
    _write(source / "index.md", (ROOT / "README.md").read_text("utf-8") + "\n".join(contents))
    files = [
        *(ROOT / "docs" / "pictures").iterdir(),
        *(ROOT / "baldwinlab" / "papers").glob("*/*.png"),
        *LINKED_FILES,
    ]
    for file in files:
        copy = source / file.relative_to(ROOT)
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(file, copy)


def assistant_summary(source: Path, navigation: dict[str, Any]) -> str:
    """Return llms.txt for the pages in the folder that Sphinx reads."""
    paths = {
        title: [_document(page) for page in pages]
        for title, pages in sections(navigation, reference.pages()).items()
    }
    texts = {
        path: (source / path).read_text("utf-8") for section in paths.values() for path in section
    }
    return llms_text(texts, paths)


def sections(navigation: dict[str, Any], generated: dict[str, str]) -> dict[str, list[str]]:
    """Return the pages of each section, by its title.

    A page whose full path is in the navigation is in the section of this path.
    A pattern adds the other pages that it matches.
    """
    patterns = [pattern for section in navigation["sections"] for pattern in section["pages"]]
    assigned = {pattern for pattern in patterns if "*" not in pattern}
    result: dict[str, list[str]] = {}
    for section in navigation["sections"]:
        pages: list[str] = []
        for pattern in section["pages"]:
            matches = [pattern] if "*" not in pattern else matching_pages(pattern, generated)
            pages += [page for page in matches if page == pattern or page not in assigned]
            assigned.update(matches)
        result[section["title"]] = pages
    return result


def matching_pages(pattern: str, generated: dict[str, str]) -> list[str]:
    """Return the pages that a pattern matches: in the order of years for papers, else by name."""
    files = {path.relative_to(ROOT).as_posix() for path in ROOT.glob(pattern)}
    files |= {page for page in generated if Path(page).match(pattern)}
    # The generated page of an example has the path of the example with the suffix .md.
    files -= {f"{file}.md" for file in files}
    years = list(paper_labels())
    return sorted(files, key=lambda path: (years.index(path) if path in years else -1, path))


def paper_labels() -> dict[str, str]:
    """Return the label of each paper in the navigation, by the path of its page and by year."""
    return {
        (paper.folder / "README.md").relative_to(ROOT).as_posix(): reference.short_citation(paper)
        for paper in reference.papers_by_year()
    }


def page_text(path: Path) -> str:
    """Return a page as Markdown.

    A notebook is converted: its code cells become code blocks.
    The tables that the page asks for are inserted.
    """
    text = path.read_text("utf-8")
    if path.suffix == ".py":
        return "\n".join(_cells(text))
    text = re.sub(r"^```\{code-cell\}.*\n(:.*\n)*", "```python\n", text, flags=re.MULTILINE)
    return reference.insert_tables(text)


def _cells(text: str) -> Iterator[str]:
    for cell in re.split(r"^# %%", text, flags=re.MULTILINE)[1:]:
        head, _, body = cell.partition("\n")
        if "[markdown]" in head:
            yield re.sub(r"^# ?", "", body, flags=re.MULTILINE)
        elif body.strip():
            yield f"```python\n{body.strip()}\n```\n"


def add_laboratories(source: Path, files: Path, laboratories: list[dict[str, Any]]) -> None:
    """Insert a running laboratory after the introduction of each page that declares one."""
    for laboratory in laboratories:
        page = source / laboratory["page"]
        presets = [load(name) for name in laboratory["experiments"]]
        stem = page.relative_to(source).with_suffix("").as_posix().lower()
        name = f"laboratories/{re.sub('[^a-z0-9]+', '-', stem)}.html"
        (files / name).parent.mkdir(parents=True, exist_ok=True)
        (files / name).write_bytes(render_live_page(presets))
        folder = files / Path(laboratory["page"]).parent
        address = os.path.relpath(files / name, folder).replace(os.sep, "/")
        introduction, heading, rest = page.read_text("utf-8").partition("\n## ")
        _write(page, f"{introduction}\n{_frame(address, presets[0])}\n{heading}{rest}")


def add_notebook(source: Path, files: Path, executed: Path) -> None:
    """Add the page of an executed notebook, and link it at the top of the page of its text."""
    html = re.sub(r'href="(\.\./[^"]+)\.md', r'href="\1.html', executed.read_text("utf-8"))
    _write(files / "executed" / executed.name, html)
    page = source / "notebooks" / f"{executed.stem}.md"
    link = (
        f'<p><a href="../executed/{executed.name}">This notebook with its results</a>: '
        "curves, tables and animations.</p>"
    )
    before, heading, rest = page.read_text("utf-8").partition("\n# ")
    title, _, text = rest.partition("\n")
    _write(page, f"{before}{heading}{title}\n\n{link}\n{text}")


def _frame(address: str, first: Experiment) -> str:
    title = f"Evolution of {first.name}"
    return (
        f'<div class="laboratory"><iframe src="{address}" title="{title}" loading="lazy">'
        "</iframe>\n"
        "<p>Evolution runs in your browser. Press <em>Start</em> for a complete run. "
        f'<a href="{address}">Open the laboratory as a page</a>.</p></div>\n'
    )


def _toctree(title: str, pages: list[str]) -> str:
    labels = paper_labels()
    lines = [
        f"{labels[page]} <{_document(page)[:-3]}>" if page in labels else _document(page)[:-3]
        for page in pages
    ]
    return "\n".join([f"\n```{{toctree}}\n:hidden:\n:caption: {title}\n", *lines, "```\n"])


def _document(page: str) -> str:
    """Return the path of the Markdown of a page."""
    return page if page.endswith(".md") else f"{page}.md"


def _write(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, "utf-8")


if __name__ == "__main__":
    try:
        arguments = [Path(argument) for argument in sys.argv[1:3]]
        sys.exit(not build(*(arguments or [ROOT / "site"])))
    except (BaldwinLabError, OSError) as error:
        sys.exit(str(error))
