"""Executes the notebooks and writes each as a page with what its cells gave: `python -m scripts.notebooks OUT`.

Pages need no other file and ask nobody for anything. The notebooks live in a folder of their own, which is gone afterwards.
Needs the extra `notebook` and nbconvert.
"""

from __future__ import annotations

import argparse
import re
import shutil
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

import jupytext
from jinja2 import Environment, FileSystemLoader, StrictUndefined
from nbclient import NotebookClient
from nbconvert import HTMLExporter
from pygments.formatters import HtmlFormatter
from traitlets.config import Config

from baldwinlab.analysis.figures import palette

NOTEBOOKS: Final = Path(__file__).parents[1] / "notebooks"
LONGEST: Final = 600  # seconds that a cell may take
SECRET: Final = {
    "transport_encryption": "auto"
}  # else a kernel warns that others on this machine could listen to it
LIGHT, DARK = "default", "github-dark"  # how Pygments colours code


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=Path, help="the folder for the pages")
    out = parser.parse_args().out
    out.mkdir(parents=True, exist_ok=True)
    for path in paths():
        with TemporaryDirectory() as folder:
            (out / f"{path.stem}.html").write_text(page(executed(path, Path(folder))), "utf-8")
        print(f"{out / path.stem}.html")


def paths() -> list[Path]:
    """The notebooks; the page that lists them is none."""
    return sorted(path for path in NOTEBOOKS.glob("*.md") if path.name != "README.md")


def executed(path: Path, folder: Path) -> Any:
    """A notebook with its outputs; what it writes lies in a folder. Raises nbclient's CellExecutionError where a cell fails."""
    copy = shutil.copy(path, folder)
    notebook = jupytext.read(copy)
    place = {"metadata": {"path": str(folder)}}
    return NotebookClient(
        notebook, timeout=LONGEST, resources=place, config=Config(KernelManager=SECRET)
    ).execute()


def page(notebook: Any) -> str:
    """An executed notebook as HTML. Links to other notebooks lead to their pages."""
    exporter = HTMLExporter(
        template_name="basic",
        exclude_input_prompt=True,
        exclude_output_prompt=True,
        exclude_anchor_links=True,
    )
    body, _ = exporter.from_notebook_node(notebook)
    for path in paths():
        body = body.replace(f'href="{path.name}"', f'href="{path.stem}.html"')
    environment = Environment(
        loader=FileSystemLoader(Path(__file__).parent), autoescape=True, undefined=StrictUndefined
    )
    title = re.findall(
        r"^# (.+)$", "\n".join(cell.source for cell in notebook.cells), re.MULTILINE
    )[0]
    light, dark = (
        HtmlFormatter(style=style).get_style_defs(".highlight") for style in (LIGHT, DARK)
    )
    return environment.get_template("notebook.html").render(
        title=title, colours=palette.report_css(), light=light, dark=dark, body=body
    )


if __name__ == "__main__":
    main()
