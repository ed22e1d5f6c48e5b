"""Generate the reference pages of the kinds of part: hooks, arrays, oracles and helpers."""

from __future__ import annotations

import ast
import inspect
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, Final

from baldwinlab import parts
from baldwinlab.api.checks import oracle_data, signatures
from baldwinlab.api.checks.reference import Naive
from baldwinlab.engine import rng
from baldwinlab.engine.phases import Array
from baldwinlab.experiment import Experiment
from baldwinlab.experiment.class_builder import choosing_fields
from baldwinlab.models.miniworld import state
from baldwinlab.parts.part import Part, hook_names
from scripts.described import (
    capitalized,
    described_attributes,
    format_function,
    format_name,
    parse_docstring,
    prose,
    table,
)
from scripts.hook_calls import CALLS, STAGES, Call

FOLDER: Final = "docs/reference/parts"
PAGES_OF_BUILT_IN_PARTS: Final = {
    "sense": "senses-and-bodies.md",
    "body": "senses-and-bodies.md",
    "network": "networks.md",
    "learning rule": "learning-rules.md",
    "world feature": "worlds.md",
    "selection": "breeding.md",
    "variation": "breeding.md",
    "inheritance": "breeding.md",
    "fitness": "breeding.md",
    "stop": "breeding.md",
    "model": "models.md",
}
"""The kinds of part in the order of the site, with the pages of the built-in parts."""

SCOPES: Final = {
    "agent": "Per agent. The hook must not read or write the arrays of other agents.",
    "position": "Per agent, for one position of the map.",
    "world": "Per world. The hook may read all agents of its world.",
    "population": "Once for the population, on the CPU.",
    "child": "Per child, on the CPU.",
}
OWNERS: Final = {
    "agent": "[{rows}, lane]",
    "lane": "[lane, {rows}]",
    "world": "[world, {rows}]",
    "batch": "[{rows}]",
}
RULES_FOR_HOOKS: Final = """\
- **First argument.** `part` is a NamedTuple with the numeric fields of the part, its `derived` values and its `arrays`.
- **Other agents.** A per-agent hook must not read or write the arrays of other agents. A per-world hook may.
- **Lanes.** `lane` is the column of one agent, or a SIMD block of neighboring columns.
  Read and write with `get(array, row, lane)` and `put(array, row, lane, value)`.
- **Comparisons.** For a SIMD block, a comparison returns a mask.
  Combine masks with `&`, `|` and `negated(mask)`, and use them with `choose(mask, a, b)` and `any_of(mask)`.
  `if`, `and`, `or` and `not` do not work with masks.
- **Arithmetic.** Use float32: write `np.float32(0.5)`, because `0.5` makes the result float64.
  Use `+`, `-`, `*`, `/`, comparisons, `choose` and `abs`.
  Do not use `np.exp`, `np.sin` or `**`: their results differ between machines.
- **Memory.** A hook allocates nothing. Declare scratch arrays in `arrays`.
- **Initial content.** An array of a part without `fill` is undefined at the start of each lifetime.
  Write each entry before you read it: in `init_world`, `load_genes`, `init_agent`, or earlier in the same step.
  An array with `fill=VALUE` is set once, when the memory is allocated.
  The outputs of hooks that reproduce are NaN or -1 before the call, and an entry that remains unwritten is an error.
- **Random numbers.** Draw them with `philox`, see [random numbers](random-numbers.md).

`baldwinlab check FILE` tests these rules.
To find code that reads undefined memory, run it twice, with the environment variable `BALDWINLAB_POISON` set to 1 and to 2.
The results must be identical."""

INHERITED_NAMES: Final = ("kind", "name", "Compiled")
"""Class variables that a part does not declare, because the class statement sets them."""


def pages() -> dict[str, str]:
    """Return the Markdown of every page about parts, by its path on the site."""
    return {
        f"{FOLDER}/index.md": overview(),
        **{f"{FOLDER}/{_stem(kind)}.md": kind_page(kind) for kind in kinds()},
        f"{FOLDER}/model-and-state.md": model_and_state(),
        f"{FOLDER}/random-numbers.md": random_numbers(),
        f"{FOLDER}/oracles.md": oracles(),
        f"{FOLDER}/helpers.md": helpers(),
    }


def kinds() -> list[type[Part]]:
    """Return the classes of the kinds of part, in the order of the site."""
    order = list(PAGES_OF_BUILT_IN_PARTS)
    classes = {value for value in vars(parts).values() if _is_kind(value)}
    return sorted(classes, key=lambda kind: order.index(kind.kind))


def _is_kind(value: Any) -> bool:
    return isinstance(value, type) and Part in value.__bases__


def _stem(kind: type[Part]) -> str:
    return kind.kind.replace(" ", "-")


def _setting(kind: type[Part]) -> str:
    paths = {kind_name: path for path, kind_name, _ in choosing_fields(Experiment)}
    return paths.get(kind.kind, "model")


def overview() -> str:
    """Return the page about all kinds: declarations, order of calls, rules for hooks."""
    rows = [
        (
            f"[{kind.__name__}]({_stem(kind)}.md)",
            f"`{_setting(kind)}`",
            ", ".join(f"`{name}`" for name in hook_names(kind)) or _python_hooks(kind),
            f"[{kind.kind}](../{PAGES_OF_BUILT_IN_PARTS[kind.kind]})",
        )
        for kind in kinds()
    ]
    return f"""# Kinds of part

A part is one piece of a model.
Each kind of part is a class of `baldwinlab.parts`.
A custom part is a class that is derived from one of them, in a separate file.
[Your own learning rule](../../tutorials/learning-rule.md) is a tutorial.
[Write a part](../../how-to/write-a-part.md) and [write a model](../../how-to/write-a-model.md) show examples.

{table(("kind", "setting", "hooks", "built-in parts"), rows)}
A hook is a static method of a part.
Numba compiles the hooks, except those of a model, which is plain Python.
A part defines the hooks that it needs; the class of its kind has a default for each.
The names and the order of the arguments are those of the kind.

Pages about all kinds:

- [Arrays and fields of `model` and `state`](model-and-state.md)
- [Random numbers](random-numbers.md)
- [Oracles](oracles.md), which test a part
- [Helpers](helpers.md), the functions and classes that a part may use

## Declarations of every part

{_declarations(Part)}
## Order of calls

{_order_of_calls(CALLS)}
With `lifetime.update = "sequential"`, each agent executes the complete step in turn.
`end_step` is then called after the last agent.
`Network.links` is called only to draw a network.

## Rules for hooks

{RULES_FOR_HOOKS}
"""


def _python_hooks(kind: type[Part]) -> str:
    return ", ".join(f"`{name}`" for name in _python_methods(kind))


def _python_methods(kind: type[Part]) -> list[str]:
    """Return the names of the documented methods and properties that a part may replace."""

    def is_method(value: Any) -> bool:
        return inspect.isfunction(value) or isinstance(value, property | classmethod)

    public = {name: value for name, value in vars(kind).items() if not name.startswith("_")}
    return [name for name, value in public.items() if is_method(value) and inspect.getdoc(value)]


def _order_of_calls(calls: Iterable[Call]) -> str:
    text = ""
    selected = list(calls)
    for stage, title in STAGES.items():
        rows = [_row_of_call(call) for call in selected if call.stage == stage]
        if rows:
            numbered = [(str(number), *row) for number, row in enumerate(rows, 1)]
            heads = ("", "call", "scope", "may write", "condition")
            text += f"**{title}**\n\n{table(heads, numbered)}\n"
    return text


def _row_of_call(call: Call) -> tuple[str, str, str, str]:
    if not call.kind:
        return call.scope, "engine", "", ""
    return f"`{call.kind}.{call.hook}`", f"per {call.scope}", call.writes, call.condition


def kind_page(kind: type[Part]) -> str:
    """Return the page of a kind of part: its declarations, hooks, methods and oracle."""
    calls = [call for call in CALLS if call.kind == kind.__name__]
    order = f"\n## Order of calls\n\n{_order_of_calls(calls)}" if calls else ""
    return f"""# {kind.__name__}

{_text(kind)}

- Setting: `{_setting(kind)}`
- Built-in parts: [{kind.kind}](../{PAGES_OF_BUILT_IN_PARTS[kind.kind]})
- All kinds: [Kinds of part](index.md)

## Declarations

{_declarations(kind)}{order}
{"".join(_hook_section(kind, name) for name in hook_names(kind))}{_methods(kind)}{_oracle(kind)}"""


def _text(described: Any) -> str:
    return prose(parse_docstring(described.__doc__).text)


def declared_names(kind: type[Part]) -> list[str]:
    """Return the class variables that a part of a kind may declare."""
    hooks = set(hook_names(kind)) if kind is not Part else set()
    return [
        name
        for name in inspect.get_annotations(kind)
        if name not in INHERITED_NAMES and name not in hooks and not name.startswith("_")
    ]


def _declarations(kind: type[Part]) -> str:
    described = described_attributes(kind)
    rows = [
        (f"`{name}`", _type_of(kind, name), _default_of(kind, name), described[name].text)
        for name in declared_names(kind)
        if name in described
    ]
    return table(("name", "type", "default", "meaning"), rows) if rows else "None.\n"


def _type_of(kind: type[Part], name: str) -> str:
    annotation = str(inspect.get_annotations(kind)[name])
    return f"`{annotation.removeprefix('ClassVar[').removesuffix(']')}`"


def _default_of(kind: type[Part], name: str) -> str:
    value = getattr(kind, name, None)
    return f"`{value!r}`" if isinstance(value, bool | int | float | str | tuple) else ""


def _hook_section(kind: type[Part], name: str) -> str:
    calls = [call for call in CALLS if (call.kind, call.hook) == (kind.__name__, name)]
    facts = []
    for call in calls:
        condition = f" ({call.condition})" if call.condition else ""
        facts.append(f"- Called: {STAGES[call.stage].lower()}{condition}.")
    if calls:
        facts.append(f"- Scope: {SCOPES[calls[0].scope]}")
        facts.append(f"- May write: {calls[0].writes}.")
    lines = "\n".join(facts)
    return f"\n## {name}\n\n{lines}\n\n{format_function(getattr(kind, name), name)}"


def _methods(kind: type[Part]) -> str:
    text = ""
    for name in _python_methods(kind):
        value = vars(kind)[name]
        if isinstance(value, property):
            text += f"\n## {name}\n\nProperty. {prose(value.__doc__)}\n"
        else:
            text += f"\n## {name}\n\n{format_function(getattr(kind, name), name)}"
    return text


def _oracle(kind: type[Part]) -> str:
    contracts = [signatures.ORACLES.get(key) for key in (kind.kind, *hook_names(kind))]
    rows = [
        (
            f"`oracle({contract.arguments})`",
            contract.result,
            ", ".join(f"`{hook}`" for hook in contract.verifies),
        )
        for contract in contracts
        if contract
    ]
    if not rows:
        return ""
    heads = ("oracle", "result", "verified hooks")
    return f"\n## Oracle\n\n[Oracles](oracles.md) explains the arguments.\n\n{table(heads, rows)}"


def model_and_state() -> str:
    """Return the page of the fields that hooks get as `model` and `state`."""
    return f"""# Fields of model and state

Hooks of senses, bodies, learning rules and world features get `model` and `state`.
[Kinds of part](index.md) lists the arrays that each hook may write.

{_text(state)}

## Model

{_text(state.MiniWorldModel)}

{table(("field", "meaning"), _attribute_rows(state.MiniWorldModel))}
## State

{_text(state.State)}

{table(("field", "type", "owner and shape", "meaning"), _array_rows())}"""


def _attribute_rows(described: Any) -> Iterator[tuple[str, ...]]:
    for name, entry in described_attributes(described).items():
        kind = f" ({entry.kind})" if entry.kind else ""
        yield f"`{name}`", capitalized(f"{entry.text}{kind}")


def _array_rows() -> Iterator[tuple[str, ...]]:
    for name, entry in described_attributes(state.State).items():
        array = state.ARRAYS.get(name)
        if array is None:
            yield f"`{name}`", "", "", entry.text
        else:
            yield f"`{name}`", f"`{array.dtype}`", f"{array.owner}: {shape_text(array)}", entry.text


def shape_text(array: Array) -> str:
    """Return the axes of a declared array, for example "[units, lane]"."""
    return OWNERS[array.owner].format(rows=", ".join(map(str, array.rows)))


def random_numbers() -> str:
    """Return the page of the random streams."""
    rows = [
        (f"`{name}`", str(number), text)
        for name, number, text in streams()
        if number < rng.FIRST_CUSTOM
    ]
    return f"""# Random numbers

{prose(rng.__doc__)}

A *stream* is the set of random numbers with the same purpose.
The table lists the purposes that the package uses.
A number of the table never changes, because stored results depend on it.

{table(("purpose", "number", "index and draw"), rows)}
Rules for custom parts:

- A learning rule, sense, body or world feature uses the purpose `LIFE`:
  `philox(step, agent, state.generation[0], LIFE, seed, run)`.
  `seed` is `state.keys[world, 0]` and `run` is `state.keys[world, 1]`.
- A model uses `FOUNDER` for founders and `LIFE` for lifetimes.
- The hooks of selection and variation get their random numbers as arguments.
- Two calls with the same purpose, index and draw return the same numbers.
  For further independent streams, compute a purpose from a name: `POSITION = purpose("my-walls: position")`.
  The package itself uses no purpose from {rng.FIRST_CUSTOM} on.
- `philox` returns four words of 32 bits. `unit` converts a word to a float32 in [0, 1).
"""


def streams() -> Iterator[tuple[str, int, str]]:
    """Yield name, number and comment of each purpose that `engine/rng.py` declares."""
    source = Path(rng.__file__).read_text("utf-8")
    for node in ast.parse(source).body:
        if isinstance(node, ast.AnnAssign) and isinstance(node.value, ast.Constant):
            name = ast.unparse(node.target)
            lines = source.splitlines()[node.lineno - 2 : node.end_lineno]
            comments = [line.partition("#")[2].strip() for line in lines if "#" in line]
            yield name, int(ast.literal_eval(node.value)), comments[-1] if comments else ""


def oracles() -> str:
    """Return the page of the oracles and their arguments."""
    rows = [
        (key, f"`oracle({contract.arguments})`", contract.result, ", ".join(contract.verifies))
        for key, contract in signatures.ORACLES.items()
    ]
    methods = "".join(
        f"\n### naive.{name}\n\n{format_function(getattr(Naive, name), name)}"
        for name, value in vars(Naive).items()
        if inspect.isfunction(value) and not name.startswith("_")
    )
    return f"""# Oracles

An oracle computes the same as a hook, independently and in plain Python.
`baldwinlab check FILE` compares both.

{table(("kind or hook", "signature", "result", "verified hooks"), rows)}
`naive`, `agent` and `items` are objects of the classes below.

{_text(oracle_data)}

## Agent

{_text(oracle_data.Agent)}

{table(("field", "meaning"), _attribute_rows(oracle_data.Agent))}
## Item

{_text(oracle_data.Item)}

{table(("field", "meaning"), _attribute_rows(oracle_data.Item))}
## Naive

{_text(Naive)}

{table(("field", "meaning"), _attribute_rows(Naive))}{methods}"""


def helpers() -> str:
    """Return the page of the public names of `baldwinlab.parts` other than the kinds."""
    text = "# Helpers\n\nFunctions and classes of `baldwinlab.parts` for custom parts.\n"
    for name in helper_names():
        value = getattr(parts, name)
        description = constant_descriptions().get(name)
        if description:
            text += f"\n## {name}\n\n{_short(value)}{description}\n"
        else:
            text += f"\n{format_name(name, value)}{_hooks_of_base(value)}"
    return text


def _hooks_of_base(value: Any) -> str:
    """Return the hooks that a base class of parts adds to its kind."""
    if not isinstance(value, type) or not issubclass(value, Part):
        return ""
    added = [
        name
        for name, hook in vars(value).items()
        if isinstance(hook, staticmethod) and name not in hook_names(_kind_of(value))
    ]
    return "".join(
        f"\n### {value.__name__}.{name}\n\n{format_function(getattr(value, name), name)}"
        for name in added
    )


def _kind_of(part: type[Part]) -> type[Part]:
    return next(base for base in part.__mro__ if _is_kind(base))


def helper_names() -> list[str]:
    """Return the public names of `baldwinlab.parts` other than the kinds."""
    return sorted(set(parts.__all__) - {kind.__name__ for kind in kinds()}, key=str.lower)


def constant_descriptions() -> dict[str, str]:
    """Return the description of each helper that has no docstring."""
    return {
        **{name: f"Purpose of random numbers: {text}." for name, _, text in streams()},
        "PER_AGENT_DIMS": "Dimensions of a variable with one value per agent and generation.",
        "Field": "Function of pydantic: default, limits and description of a setting.",
        "ENERGY_ARRAYS": "Arrays of a part that calls `update_energy`.",
        "ENERGY_VALUES": "Derived values of a part that calls `energy_in_life`.",
        "LAYER_VALUES": "Derived values of a part that calls `for_each_synapse`.",
    }


def _short(value: Any) -> str:
    if isinstance(value, Mapping):
        return f"Names: {', '.join(f'`{name}`' for name in value)}. "
    return "" if callable(value) else f"Value `{value!r}`. "
