"""Run the notebooks, and write each as a page with its results: `python -m scripts.notebooks OUT`.

A page needs no other file and no network. The notebooks run in a temporary folder.
The script needs the extra `notebook` and nbconvert.
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

from baldwinlab.analysis import palette, typeface

NOTEBOOKS: Final = Path(__file__).parents[1] / "notebooks"
# Maximum duration of a cell.
MAX_CELL_SECONDS: Final = 600
# Without encryption, a kernel warns that other users of the machine could read its messages.
ENCRYPTION: Final = {"transport_encryption": "auto"}
# Styles of Pygments.
LIGHT_STYLE = "default"
DARK_STYLE = "github-dark"


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
    """Return the notebooks, without the page that lists them."""
    return sorted(path for path in NOTEBOOKS.glob("*.md") if path.name != "README.md")


def executed(path: Path, folder: Path) -> Any:
    """Return a notebook with its outputs, run in a folder.

    Raises CellExecutionError of nbclient if a cell fails.
    """
    copy = shutil.copy(path, folder)
    notebook = jupytext.read(copy)
    resources = {"metadata": {"path": str(folder)}}
    config = Config(KernelManager=ENCRYPTION)
    client = NotebookClient(notebook, timeout=MAX_CELL_SECONDS, resources=resources, config=config)
    return client.execute()


def page(notebook: Any) -> str:
    """Return a notebook with outputs as HTML, with links to the pages of other notebooks."""
    exporter = HTMLExporter(
        template_name="basic",
        exclude_input_prompt=True,
        exclude_output_prompt=True,
        exclude_anchor_links=True,
    )
    body, _ = exporter.from_notebook_node(notebook)
    for path in paths():
        body = body.replace(f'href="{path.name}"', f'href="{path.stem}.html"')
    body = re.sub(r'href="(\.\./[^"]+)\.md', r'href="\1.html', body)
    environment = Environment(
        loader=FileSystemLoader(Path(__file__).parent), autoescape=True, undefined=StrictUndefined
    )
    text = "\n".join(cell.source for cell in notebook.cells)
    title = re.findall(r"^# (.+)$", text, re.MULTILINE)[0]
    styles = (HtmlFormatter(style=style) for style in (LIGHT_STYLE, DARK_STYLE))
    light, dark = (style.get_style_defs(".highlight") for style in styles)
    return environment.get_template("notebook.html").render(
        title=title,
        styles=typeface.font_css() + palette.report_css(),
        light=light,
        dark=dark,
        body=body,
    )


if __name__ == "__main__":
    main()
