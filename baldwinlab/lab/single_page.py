"""Pages in one file: the lab's own modules and styles, and data, with no server. What is here needs no extra."""

from __future__ import annotations

import base64
import re
import zlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any
from urllib.parse import quote

from jinja2 import Environment, PackageLoader, StrictUndefined

from baldwinlab.analysis.figures import palette

STATIC = Path(__file__).parent / "static"
_IMPORT = re.compile(r'(?<=from ")\./(?P<name>[\w./]+\.js)(?=")')


def page(template: str, first: str, styles: Sequence[str], **data: Any) -> bytes:
    """The page of a template, with a module and all that it imports, and styles, by the names of their files."""
    loader = PackageLoader("baldwinlab.lab")
    environment = Environment(
        loader=loader,
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.policies["json.dumps_kwargs"] = {
        "sort_keys": False
    }  # fields stand in a form as they stand in the experiment
    made = environment.get_template(template).render(
        styles=palette.lab_css() + "".join((STATIC / name).read_text("utf-8") for name in styles),
        modules={
            name: f"data:text/javascript;charset=utf-8,{quote(code)}"
            for name, code in modules(first).items()
        },
        **data,
    )
    return made.encode()


def modules(first: str) -> dict[str, str]:
    """A module of the page and all that it imports, by names that do not depend on where a page lies, as "lab/world.js"."""
    found: dict[str, str] = {}
    waiting = [first]
    while waiting:
        name = waiting.pop()
        if f"lab/{name}" not in found:
            code = (STATIC / name).read_text("utf-8")
            found[f"lab/{name}"] = _IMPORT.sub(r"lab/\g<name>", code)
            waiting += [imported["name"] for imported in _IMPORT.finditer(code)]
    return found


def packed(content: bytes) -> str:
    """Deflated, with no header, as a browser's "deflate-raw" reads it, in base64."""
    deflate = zlib.compressobj(9, zlib.DEFLATED, -zlib.MAX_WBITS)
    return base64.b64encode(deflate.compress(content) + deflate.flush()).decode()
