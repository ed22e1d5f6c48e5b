"""Tests of the imports of the page's modules, which have no cycle."""

from __future__ import annotations

import posixpath
import re
from graphlib import TopologicalSorter
from pathlib import Path

from baldwinlab.lab.single_page import STATIC_FOLDER

IMPORTED = re.compile(r"""(?:from\s+|import\s*\(\s*|import\s+)["'](\.\.?/[\w./]+\.js)["']""")


# A comment can name the module of a type without an import.
COMMENT = re.compile(r"/\*.*?\*/", re.DOTALL)


def imports(path: Path) -> set[str]:
    """Return the paths of the imported modules, relative to the folder of all modules."""
    paths = IMPORTED.findall(COMMENT.sub("", path.read_text("utf-8")))
    folder = path.parent.relative_to(STATIC_FOLDER).as_posix()
    return {posixpath.normpath(posixpath.join(folder, name)) for name in paths}


def modules() -> list[Path]:
    return [path for path in STATIC_FOLDER.rglob("*.js") if path.parent.name != "vendor"]


def test_the_imports_of_the_page_have_no_cycle() -> None:
    graph = {path.relative_to(STATIC_FOLDER).as_posix(): imports(path) for path in modules()}
    assert graph["main.js"] >= {"core/address.js", "world/view_world.js"}
    # Raises CycleError, which names the modules of the cycle.
    TopologicalSorter(graph).prepare()


def test_every_imported_module_exists() -> None:
    for path in modules():
        for name in imports(path):
            assert (STATIC_FOLDER / name).is_file(), f"{path.name} imports {name}"
