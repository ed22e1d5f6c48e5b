"""Static check that a per-agent hook does not read or write other agents.

The arrays of agents are [row, lane]. A per-agent hook may reach its own column: by `get` and
`put`, or by an index that ends with its lane. In hooks that take (world, agent) the lane is
`world * model.agents + agent`. It may read arrays of its world by an index that begins with
`world`.

The check follows calls of functions in the same file. `baldwinlab check` tests at run time what the
source does not show.
"""

from __future__ import annotations

import ast
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any, Final

from baldwinlab.core.errors import PartError

PER_AGENT: Final = (
    "sense",
    "measure",
    "choose_action",
    "move",
    "forward",
    "backward",
    "links",
    "load_genes",
    "init_agent",
    "learn",
)
# Arguments that are arrays of agents.
OWN: Final = (
    "weights",
    "activations",
    "errors",
    "targets",
    "genes",
)
# Fields of `state` that are not arrays of agents.
OF_ALL: Final = (
    "generation",
    "rule",
    "network",
    "body",
    "lookup",
    "senses",
    "features",
)
HARMLESS: Final = ("shape", "dtype", "ndim")
LANE: Final = ("world * model.agents + agent", "agent + world * model.agents")
FIXED: Final = ("lane", "world", "agent")

Roles = Mapping[str, str]
"""Role of each name: "state", "part", "array", "lane", "world" or "agent".

`part.NAME` is the name of an array of the part.
"""


def require_own_column(hooks: Mapping[str, Callable[..., Any]], arrays: Iterable[str]) -> None:
    """Check the source of the hooks of a part.

    Parameters
    ----------
    hooks : Mapping[str, Callable]
        Hooks by name.
    arrays : iterable of str
        Names of the arrays of the part.

    Raises
    ------
    PartError
        If a per-agent hook certainly reads or writes another agent.
    """
    for name, function in hooks.items():
        found = definition(function) if name in PER_AGENT else None
        if found is None:
            continue
        roles = {each.arg: "array" if each.arg in OWN else each.arg for each in found.args.args}
        roles |= {f"part.{array}": "array" for array in arrays}
        for node in _looks(found, roles, _functions_beside(function), frozenset()):
            place = f"{function.__code__.co_filename}:{node.lineno}: {ast.unparse(node).splitlines()[0]}"
            raise PartError(
                f"{function.__qualname__} looks at other agents ({place}); a per-agent hook reaches its own column alone, by "
                "get and put with its own lane: what needs a look at others belongs in a per-world hook, such as observe_others"
            )


def definition(function: Callable[..., Any]) -> ast.FunctionDef | None:
    """Return the syntax tree of a function, or None without source."""
    line = function.__code__.co_firstlineno
    for node in ast.walk(_tree(function)):
        if isinstance(node, ast.FunctionDef) and node.name == function.__name__:
            first = min([node.lineno, *(each.lineno for each in node.decorator_list)])
            if first <= line <= (node.end_lineno or first):
                return node
    return None


def _functions_beside(function: Callable[..., Any]) -> dict[str, ast.FunctionDef]:
    return {node.name: node for node in _tree(function).body if isinstance(node, ast.FunctionDef)}


def _tree(function: Callable[..., Any]) -> ast.Module:
    text = getattr(sys.modules.get(function.__module__), "__source__", None)
    if text is None:
        try:
            text = Path(function.__code__.co_filename).read_text("utf-8")
        except (OSError, UnicodeDecodeError):
            text = ""
    return _parsed(text)


@cache
def _parsed(text: str) -> ast.Module:
    return ast.parse(text)


def _looks(
    function: ast.FunctionDef,
    given: Roles,
    beside: Mapping[str, ast.FunctionDef],
    seen: frozenset[str],
) -> Iterator[Any]:
    """Yield the expressions in a function that reach other agents."""
    roles = dict(given)
    for name, value, node in _bindings(function):
        what = _what(value, roles)
        if roles.get(name) in FIXED and what != roles[name]:
            yield node
        roles[name] = what
    for node in ast.walk(function):
        if isinstance(node, ast.Subscript) and _what(node.value, roles) == "array":
            of_world = (
                isinstance(node.slice, ast.Tuple) and _what(node.slice.elts[0], roles) == "world"
            )
            own = isinstance(node.slice, ast.Tuple) and _what(node.slice.elts[-1], roles) == "lane"
            if not own and (isinstance(node.ctx, ast.Store) or not of_world):
                yield node
        elif (
            isinstance(node, ast.Attribute)
            and _what(node.value, roles) == "array"
            and node.attr not in HARMLESS
        ):
            yield node
        elif isinstance(node, ast.Call):
            yield from _in_call(node, roles, beside, seen)


def _in_call(
    node: ast.Call, roles: Roles, beside: Mapping[str, ast.FunctionDef], seen: frozenset[str]
) -> Iterator[Any]:
    name = node.func.id if isinstance(node.func, ast.Name) else ""
    whats = [_what(argument, roles) for argument in node.args]
    if name in ("get", "put") and len(whats) > 2 and whats[0] == "array":
        if whats[2] != "lane" and not (name == "get" and whats[1] == "world"):
            yield node
    elif name in ("forward", "backward") and "array" in whats and whats[-1] != "lane":
        yield node
    elif name in beside and name not in seen:
        inside = dict(zip((each.arg for each in beside[name].args.args), whats, strict=False))
        of_part = {name: what for name, what in roles.items() if "." in name}
        yield from _looks(beside[name], inside | of_part, beside, seen | {name})


def _bindings(function: ast.FunctionDef) -> Iterator[tuple[str, ast.expr | None, ast.AST]]:
    """Yield each name that a function assigns, with the assigned expression if there is one."""
    for node in ast.walk(function):
        targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", None)]
        for target in targets:
            value = node.value if isinstance(node, ast.Assign) else None
            many = isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple)
            pairs = zip(target.elts, value.elts, strict=False) if many else [(target, value)]  # type: ignore[union-attr]
            yield from ((each.id, own, node) for each, own in pairs if isinstance(each, ast.Name))


def _what(value: ast.expr | None, roles: Roles) -> str:
    """Return the role of an expression, or ""."""
    if isinstance(value, ast.Name):
        return roles.get(value.id, "")
    if isinstance(value, ast.Attribute):
        holder = _what(value.value, roles)
        if holder == "part":
            return roles.get(f"part.{value.attr}", "")
        return "array" if holder == "state" and value.attr not in OF_ALL else ""
    return "lane" if isinstance(value, ast.BinOp) and ast.unparse(value) in LANE else ""
