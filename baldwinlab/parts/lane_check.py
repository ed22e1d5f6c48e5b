"""Static check that a per-agent hook does not read or write other agents.

The arrays of agents are [row, lane]. A per-agent hook may read and write the column of its agent,
by `get` and `put`, or by an index that ends with the lane. In hooks with the arguments (world,
agent), the lane is `world * model.agents + agent`. A hook may read arrays of its world by an index
that begins with `world`.

The check follows calls of functions in the same file. `baldwinlab check` tests other cases at run
time.
"""

from __future__ import annotations

import ast
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any, Final

from baldwinlab.core.errors import PartError

# Names of the per-agent hooks.
PER_AGENT_HOOKS: Final = (
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
    "compute_change",
    "change_synapse",
)
# Arguments of hooks, and fields of `Training`, that are arrays of agents.
AGENT_ARRAYS: Final = (
    "weights",
    "activations",
    "errors",
    "targets",
    "genes",
)
# Fields of `state` that are not arrays of agents.
SHARED_FIELDS: Final = (
    "generation",
    "rule",
    "network",
    "body",
    "lookup",
    "senses",
    "features",
)
# Attributes of an array that read no entries.
ARRAY_PROPERTIES: Final = ("shape", "dtype", "ndim")
# Expressions of the lane in hooks with the arguments (world, agent).
LANE_EXPRESSIONS: Final = ("world * model.agents + agent", "agent + world * model.agents")
# Arguments that a hook must not assign.
FIXED_ARGUMENTS: Final = ("lane", "world", "agent")

Roles = Mapping[str, str]
"""Role by name: "state", "part", "training", "array", "lane", "world" or "agent". The array NAME of
the part has the name "part.NAME"."""
Functions = Mapping[str, ast.FunctionDef]
"""Functions of a file by name."""


def require_lane_isolation(hooks: Mapping[str, Callable[..., Any]], arrays: Iterable[str]) -> None:
    """Raise PartError for the first expression in hooks that reads or writes other agents."""
    part_roles = {f"part.{array}": "array" for array in arrays}
    for name, function in hooks.items():
        definition = find_definition(function) if name in PER_AGENT_HOOKS else None
        if definition is None:
            continue
        arguments = [argument.arg for argument in definition.args.args]
        roles = {name: "array" if name in AGENT_ARRAYS else name for name in arguments}
        accesses = _find_accesses(
            definition, roles | part_roles, _functions_of_file(function), frozenset()
        )
        for node in accesses:
            file = function.__code__.co_filename
            statement = ast.unparse(node).splitlines()[0]
            raise PartError(
                f"{function.__qualname__} reads or writes other agents "
                f"({file}:{node.lineno}: {statement}); a per-agent hook must use `get` and `put` "
                "with its own lane; to read other agents, use a per-world hook, such as "
                "observe_others"
            )


def find_definition(function: Callable[..., Any]) -> ast.FunctionDef | None:
    """Return the syntax tree of a function, or None without its source."""
    # This line can be that of a decorator.
    line = function.__code__.co_firstlineno
    for node in ast.walk(_syntax_tree(function)):
        if isinstance(node, ast.FunctionDef) and node.name == function.__name__:
            decorator_lines = [decorator.lineno for decorator in node.decorator_list]
            first = min([node.lineno, *decorator_lines])
            if first <= line <= (node.end_lineno or first):
                return node
    return None


def _functions_of_file(function: Callable[..., Any]) -> dict[str, ast.FunctionDef]:
    """Return the functions at the top level of the file that defines a function, by name."""
    nodes = _syntax_tree(function).body
    return {node.name: node for node in nodes if isinstance(node, ast.FunctionDef)}


def _syntax_tree(function: Callable[..., Any]) -> ast.Module:
    text = getattr(sys.modules.get(function.__module__), "__source__", None)
    if text is None:
        try:
            text = Path(function.__code__.co_filename).read_text("utf-8")
        except (OSError, UnicodeDecodeError):
            text = ""
    return _parse(text)


@cache
def _parse(text: str) -> ast.Module:
    return ast.parse(text)


def _find_accesses(
    function: ast.FunctionDef, known_roles: Roles, functions: Functions, visited: frozenset[str]
) -> Iterator[Any]:
    """Yield the expressions in a function that read or write other agents.

    `known_roles` are the roles of the arguments. `functions` are the functions of the file.
    Functions in `visited` are not searched again, so that a recursion ends.
    """
    roles = dict(known_roles)
    for name, value, node in _list_bindings(function):
        role = _role_of(value, roles)
        # A new value of `lane`, `world` or `agent` selects another agent.
        is_reassigned = roles.get(name) in FIXED_ARGUMENTS and role != roles[name]
        if is_reassigned:
            yield node
        roles[name] = role
    for node in ast.walk(function):
        if isinstance(node, ast.Subscript) and _role_of(node.value, roles) == "array":
            if not _is_index_allowed(node, roles):
                yield node
        elif isinstance(node, ast.Attribute) and _role_of(node.value, roles) == "array":
            if node.attr not in ARRAY_PROPERTIES:
                yield node
        elif isinstance(node, ast.Call):
            yield from _find_accesses_in_call(node, roles, functions, visited)


def _is_index_allowed(node: ast.Subscript, roles: Roles) -> bool:
    """Return whether an index selects the lane of the agent, or reads an array of its world."""
    if not isinstance(node.slice, ast.Tuple):
        return False
    indices = node.slice.elts
    is_of_world = _role_of(indices[0], roles) == "world"
    is_read = not isinstance(node.ctx, ast.Store)
    return _role_of(indices[-1], roles) == "lane" or (is_of_world and is_read)


def _find_accesses_in_call(
    node: ast.Call, roles: Roles, functions: Functions, visited: frozenset[str]
) -> Iterator[Any]:
    """Yield the expressions in a call, and in its function, that read or write other agents."""
    name = node.func.id if isinstance(node.func, ast.Name) else ""
    argument_roles = [_role_of(argument, roles) for argument in node.args]
    if name in ("get", "put") and len(argument_roles) > 2 and argument_roles[0] == "array":
        is_of_world = name == "get" and argument_roles[1] == "world"
        if argument_roles[2] != "lane" and not is_of_world:
            yield node
    elif _passes_wrong_lane(name, argument_roles):
        yield node
    elif name in functions and name not in visited:
        parameters = [parameter.arg for parameter in functions[name].args.args]
        inner_roles = dict(zip(parameters, argument_roles, strict=False))
        # Names with a dot are arrays of the part, which have the same role in all functions.
        inner_roles |= {key: role for key, role in roles.items() if "." in key}
        yield from _find_accesses(functions[name], inner_roles, functions, visited | {name})


def _passes_wrong_lane(function: str, argument_roles: Sequence[str]) -> bool:
    """Return whether a call of a network hook has another lane than that of the agent."""
    has_arrays = "array" in argument_roles or "training" in argument_roles
    return function in ("forward", "backward") and has_arrays and argument_roles[-1] != "lane"


def _list_bindings(function: ast.FunctionDef) -> Iterator[tuple[str, ast.expr | None, ast.AST]]:
    """Yield each name that a function assigns, with the assigned expression if there is one."""
    for node in ast.walk(function):
        targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", None)]
        value = node.value if isinstance(node, ast.Assign) else None
        for target in targets:
            pairs: Iterable[tuple[Any, ast.expr | None]] = [(target, value)]
            # `a, b = x, y` assigns x to a, and y to b.
            if isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple):
                pairs = zip(target.elts, value.elts, strict=False)
            for variable, assigned in pairs:
                if isinstance(variable, ast.Name):
                    yield variable.id, assigned, node


def _role_of(value: ast.expr | None, roles: Roles) -> str:
    """Return the role of an expression, or ""."""
    if isinstance(value, ast.Name):
        return roles.get(value.id, "")
    if isinstance(value, ast.Attribute):
        owner = _role_of(value.value, roles)
        if owner == "part":
            return roles.get(f"part.{value.attr}", "")
        if owner == "training":
            return "array" if value.attr in AGENT_ARRAYS else ""
        return "array" if owner == "state" and value.attr not in SHARED_FIELDS else ""
    if isinstance(value, ast.Call) and ast.unparse(value.func) == "Training":
        return "training"
    is_lane = isinstance(value, ast.BinOp) and ast.unparse(value) in LANE_EXPRESSIONS
    return "lane" if is_lane else ""
