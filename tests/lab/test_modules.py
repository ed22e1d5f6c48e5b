"""The page's modules import downwards: none of them, by whatever way, imports itself."""

from __future__ import annotations

import re
from graphlib import TopologicalSorter
from pathlib import Path

from baldwinlab.lab.single_page import STATIC

IMPORTED = re.compile(r"""(?:from\s+|import\s*\(\s*|import\s+)["']\./([\w./]+\.js)["']""")


COMMENT = re.compile(
    r"/\*.*?\*/", re.DOTALL
)  # where a type may be named that is imported by nobody


def imports(path: Path) -> set[str]:
    return set(IMPORTED.findall(COMMENT.sub("", path.read_text("utf-8"))))


def test_no_module_of_the_page_imports_itself_by_a_detour() -> None:
    graph = {path.name: imports(path) for path in STATIC.glob("*.js")}
    assert graph["main.js"] >= {"address.js", "view_world.js"}
    TopologicalSorter(graph).prepare()  # raises CycleError, which names the circle


def test_every_module_that_is_imported_is_there() -> None:
    for path in STATIC.glob("*.js"):
        for name in imports(path):
            assert (STATIC / name).is_file(), f"{path.name} imports {name}"
