"""List the names that installed libraries use of NumPy, and that the installed NumPy has not.

    python -m scripts.removed_names [FOLDER]

A library can permit a version of NumPy that has removed a name. FOLDER is a folder of libraries, by
default that of the running Python. The status is 1 if a name is missing.
"""

from __future__ import annotations

import ast
import importlib.util
import operator
import sys
import sysconfig
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Final

import numpy as np

VERSION: Final = tuple(map(int, np.__version__.split(".")[:2]))
COMPARISONS: Final[dict[type[ast.cmpop], Callable[[Any, Any], bool]]] = {
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
}


def has_name(name: str) -> bool:
    """Return whether NumPy has an attribute or a module of this name."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return hasattr(np, name) or importlib.util.find_spec(f"numpy.{name}") is not None


def list_branches(node: ast.If | ast.IfExp) -> list[ast.AST]:
    """Return the branches that can run with the installed NumPy. A guard without a number has none.

    `numpy_version >= (2, 0)` is evaluated. Other conditions about versions and attributes are not.
    """
    condition = ast.unparse(node.test)
    body = node.body if isinstance(node.body, list) else [node.body]
    alternative = node.orelse if isinstance(node.orelse, list) else [node.orelse]
    match node.test:
        case ast.Compare(left=left, ops=[comparison], comparators=[ast.Tuple() as version]) if (
            "version" in ast.unparse(left).lower() and type(comparison) in COMPARISONS
        ):
            is_met = COMPARISONS[type(comparison)](VERSION, ast.literal_eval(version)[:2])
            return list(body if is_met else alternative)
    is_guard = any(word in condition.lower() for word in ("version", "hasattr", "np_", "numpy"))
    return [] if is_guard else [node.test, *body, *alternative]


def find_names(node: ast.AST, aliases: set[str]) -> Iterator[tuple[str, int]]:
    """Yield the names of NumPy that the code uses, with their lines, without handled errors."""
    if isinstance(node, ast.If | ast.IfExp):
        children = list_branches(node)
    elif isinstance(node, ast.Try) and node.handlers:
        children = [*node.orelse, *node.finalbody]
    else:
        children = list(ast.iter_child_nodes(node))
    if isinstance(node, ast.ImportFrom) and node.module == "numpy" and not node.level:
        yield from ((alias.name, node.lineno) for alias in node.names if alias.name != "*")
    match node:
        case ast.Attribute(value=ast.Name(id=alias), ctx=ast.Load()) if alias in aliases:
            yield node.attr, node.lineno
    for child in children:
        yield from find_names(child, aliases)


def find_missing_names(code: str) -> list[tuple[str, int]]:
    """Return the names of NumPy that the code uses and that the installed NumPy has not."""
    tree = ast.parse(code)
    aliases = {
        alias.asname or "numpy"
        for node in ast.walk(tree)
        if isinstance(node, ast.Import)
        for alias in node.names
        if alias.name == "numpy"
    }
    return [(name, line) for name, line in find_names(tree, aliases) if not has_name(name)]


def main(folder: Path) -> int:
    """Print each use of a missing name in a folder of libraries, and return the exit status."""
    count = 0
    for path in sorted(folder.rglob("*.py")):
        code = path.read_text("utf-8", errors="replace")
        if "numpy" not in code or {"tests", "testing"} & set(path.parts):
            continue
        try:
            missing = find_missing_names(code)
        except (SyntaxError, RecursionError):
            continue
        for name, line in missing:
            count += 1
            print(f"{path.relative_to(folder)}:{line}: numpy.{name} is not in {np.__version__}")
    return int(count > 0)


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1] if sys.argv[1:] else sysconfig.get_path("purelib"))))
