"""A per-agent hook looks at no other agent: what can be said of that from its source, before anything runs.

An agent's arrays are [row, lane]. A per-agent hook may reach the column of its own, by `get` and `put` or by an index that ends
with its lane; in hooks that take (world, agent) the lane is `world * model.agents + agent`. What belongs to the world may be
read, by an index that begins with `world`. Functions of the same file that a hook calls are followed. What the source leaves
open, `baldwinlab check` tries.
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
OWN: Final = (
    "weights",
    "activations",
    "errors",
    "targets",
    "genes",
)  # arguments that are agents' arrays
OF_ALL: Final = (
    "generation",
    "rule",
    "network",
    "body",
    "recall",
    "senses",
    "features",
)  # no agent's
HARMLESS: Final = ("shape", "dtype", "ndim")
LANE: Final = ("world * model.agents + agent", "agent + world * model.agents")
FIXED: Final = ("lane", "world", "agent")

Roles = Mapping[str, str]
"""What names stand for: "state", "part", "array", "lane", "world", "agent"; and `part.NAME` for the part's own arrays."""


def require_own_column(hooks: Mapping[str, Callable[..., Any]], arrays: Iterable[str]) -> None:
    """Raises PartError where one of a part's own hooks, by name, certainly looks at another agent. `arrays` are the part's."""
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
    """The source of a function, if it can be had."""
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
    """The expressions in a function by which it looks at others."""
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
    """Names that a function gives values to, each with the value where it is an expression of its own."""
    for node in ast.walk(function):
        targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", None)]
        for target in targets:
            value = node.value if isinstance(node, ast.Assign) else None
            many = isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple)
            pairs = zip(target.elts, value.elts, strict=False) if many else [(target, value)]  # type: ignore[union-attr]
            yield from ((each.id, own, node) for each, own in pairs if isinstance(each, ast.Name))


def _what(value: ast.expr | None, roles: Roles) -> str:
    """What an expression stands for; "" for anything else."""
    if isinstance(value, ast.Name):
        return roles.get(value.id, "")
    if isinstance(value, ast.Attribute):
        holder = _what(value.value, roles)
        if holder == "part":
            return roles.get(f"part.{value.attr}", "")
        return "array" if holder == "state" and value.attr not in OF_ALL else ""
    return "lane" if isinstance(value, ast.BinOp) and ast.unparse(value) in LANE else ""
