"""Arrays and hooks of an allocated state and its parts."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from baldwinlab.engine import poison
from baldwinlab.engine.phases import Array, hook_functions
from baldwinlab.models.miniworld.learning.control import exchange_changes
from baldwinlab.models.miniworld.state import ARRAYS, ARRAYS_OF_CALLER, State
from baldwinlab.parts.learning_rules import observe_others
from baldwinlab.parts.senses import prepare_senses


def iterate_arrays(state: Any) -> Iterator[npt.NDArray[Any]]:
    """Yield every array of a state and its parts, always in the same order."""
    for entry in state:
        if isinstance(entry, np.ndarray):
            yield entry
        elif isinstance(entry, tuple):
            yield from iterate_arrays(entry)


def poison_state(state: State, agents: int) -> None:
    """Poison the arrays that a lifetime must write before it reads them.

    The lanes after the last of `agents` agents are not poisoned.
    """
    if poison.is_on():
        lanes = slice(agents)
        selection = {"agent": (..., lanes), "lane": (lanes,), "world": (), "batch": ()}
        for holder, arrays in array_holders(state).values():
            for name, array in arrays.items():
                is_set_by_caller = holder is state and name in ARRAYS_OF_CALLER
                if array.fill is None and not is_set_by_caller:
                    poison.fill(getattr(holder, name)[selection[array.owner]])


def list_parts(state: State) -> Iterator[tuple[str, Any]]:
    """Yield the parts of a state with their names, such as "rule" or "senses.0"."""
    for name, value in zip(State._fields, state, strict=True):
        if hasattr(type(value), "part"):
            yield name, value
        elif name not in ARRAYS:
            yield from ((f"{name}.{index}", part) for index, part in enumerate(value))


def array_holders(state: State) -> dict[str, tuple[Any, Mapping[str, Array]]]:
    """Return the state and its parts with their declared arrays, by name prefix."""
    holders: dict[str, tuple[Any, Mapping[str, Array]]] = {"": (state, ARRAYS)}
    for name, part in list_parts(state):
        declared = type(part).part.arrays.items()
        arrays = {key: array for key, array in declared if array.owner != "run"}
        holders[f"{name}."] = (part, arrays)
    return holders


def named_arrays(state: State, worlds: int, agents: int) -> dict[str, npt.NDArray[Any]]:
    """Return copies of the arrays by name, for the first worlds of a batch.

    Scratch, and the worlds and lanes of the padding, are left out.
    """
    lanes = slice(worlds * agents)
    selection = {"agent": (..., lanes), "lane": (lanes,), "world": (slice(worlds),), "batch": ()}
    return {
        f"{prefix}{name}": getattr(holder, name)[selection[array.owner]].copy()
        for prefix, (holder, arrays) in array_holders(state).items()
        for name, array in arrays.items()
        if not array.is_scratch
    }


def list_hooks(state: State) -> tuple[Any, ...]:
    """Return the types of the parts of a state, and their hooks, which the step compiles."""
    parts = [part for _, part in list_parts(state)]
    # Fields of parts can contain further parts.
    parts += [value for part in parts for value in part if hasattr(type(value), "part")]
    return tuple(
        value for part in parts for value in (type(part), *hook_functions(type(part).part))
    )


def reads_other_agents(state: State) -> bool:
    """Return whether a sense, the learning rule or its control reads other agents in a step."""
    rule = type(state.rule).part
    senses = [type(sense).part for sense in state.senses]
    return (
        rule.observe_others is not observe_others.default
        or type(state.control).part.exchange_changes is not exchange_changes.default
        or any(sense.prepare_senses is not prepare_senses.default for sense in senses)
    )
