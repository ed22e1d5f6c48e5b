"""Pages in one file, with the lab's modules, styles and data. They need no server and no extra."""

from __future__ import annotations

import base64
import posixpath
import re
import zlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any
from urllib.parse import quote

from jinja2 import Environment, PackageLoader, StrictUndefined

from baldwinlab._version import __version__
from baldwinlab.analysis import palette, typeface

STATIC_FOLDER = Path(__file__).parents[1] / "static"
_IMPORTED_PATH = re.compile(r'(?<=from ")(?P<path>\.\.?/[\w./]+\.js)(?=")')


def render_page(template: str, first_module: str, styles: Sequence[str], **data: Any) -> bytes:
    """Render a template to one HTML file.

    The file contains a module with all modules that it imports, and the given style sheets.
    """
    environment = make_environment()
    # Without sorting, a form shows the fields in the order of the experiment.
    environment.policies["json.dumps_kwargs"] = {"sort_keys": False}
    style_sheets = "".join((STATIC_FOLDER / name).read_text("utf-8") for name in styles)
    modules = {
        name: f"data:text/javascript;charset=utf-8,{quote(code)}"
        for name, code in collect_modules(first_module).items()
    }
    page = environment.get_template(template).render(
        styles=typeface.font_css() + palette.lab_css() + style_sheets, modules=modules, **data
    )
    return page.encode()


def render_replay_page(panels: Sequence[Mapping[str, Any]], step: int) -> bytes:
    """Return a page that replays recorded lifetimes from a step, next to each other."""
    return render_page(
        "replay.html",
        "replay/replay_page.js",
        ("base.css", "replay/replay.css"),
        title=" and ".join(panel["title"] for panel in panels),
        replay={"version": __version__, "step": step, "panels": panels},
    )


def make_environment() -> Environment:
    """Return the environment of the lab's templates."""
    return Environment(
        loader=PackageLoader("baldwinlab.lab.pages"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )


def collect_modules(first_module: str) -> dict[str, str]:
    """Return the code of a JavaScript module and of all modules that it imports, by name.

    The imports use names such as "lab/world/world_view.js" instead of relative paths, because the
    code of a page in one file has no folder.
    """
    modules: dict[str, str] = {}
    pending = [first_module]
    while pending:
        name = pending.pop()
        if f"lab/{name}" not in modules:
            folder = posixpath.dirname(name)
            code = (STATIC_FOLDER / name).read_text("utf-8")
            names = {
                path: posixpath.normpath(posixpath.join(folder, path))
                for path in _IMPORTED_PATH.findall(code)
            }
            for path, imported in names.items():
                code = code.replace(f'from "{path}"', f'from "lab/{imported}"')
            modules[f"lab/{name}"] = code
            pending += names.values()
    return modules


def compress(content: bytes) -> str:
    """Return compressed bytes as base64. Browsers decompress them with the format "deflate-raw"."""
    # Negative window bits select raw deflate, without a header.
    compressor = zlib.compressobj(
        level=zlib.Z_BEST_COMPRESSION, method=zlib.DEFLATED, wbits=-zlib.MAX_WBITS
    )
    deflated = compressor.compress(content) + compressor.flush()
    return base64.b64encode(deflated).decode()
