"""Check that per-agent hooks neither read nor write the data of other agents.

Each hook runs twice for one agent. In the second run, the columns of all other agents contain
random numbers.
"""

from __future__ import annotations

import inspect
from collections.abc import Iterator
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from baldwinlab.api.checks.findings import FailsError
from baldwinlab.api.checks.fixture import PartGroup, is_of_miniworld, part_values
from baldwinlab.evolution import GenerationKey, draw_genomes
from baldwinlab.models.miniworld.allocation import list_parts
from baldwinlab.models.miniworld.backends.cpu import CpuBatch
from baldwinlab.models.miniworld.state import ARRAYS
from baldwinlab.parts.lane_check import PER_AGENT_HOOKS
from baldwinlab.parts.learning_rules import Synapse
from baldwinlab.parts.networks import Training
from baldwinlab.parts.part import overridden_hooks

TESTED_AGENT: Final = 2
"""Number of the agent for which the hooks run."""
STEPS: Final = 12
"""Number of steps before the hooks run."""


class _OwnedArray(NamedTuple):
    """An array of a state or a part, with its name and owner."""

    name: str
    owner: str
    values: npt.NDArray[Any]


def check_lane_isolation(group: PartGroup) -> str:
    """Check that per-agent hooks neither read nor write the data of other agents."""
    hooks = [
        (part, name)
        for part in group.parts
        for name in overridden_hooks(part)
        if name in PER_AGENT_HOOKS
    ]
    if not is_of_miniworld(group.experiment) or not hooks:
        return "it has no hook per agent"
    experiment = group.experiment
    batch = CpuBatch(experiment, group.seed, [0])
    batch.begin(0, draw_genomes(experiment, GenerationKey(group.seed, 0, 0))[None])
    batch.simulate(0, STEPS)
    for part, name in hooks:
        for garbage in (np.nan, None):
            _check_hook(group, batch, part, name, garbage)
    return ""


def _check_hook(
    group: PartGroup, batch: CpuBatch, part: Any, name: str, garbage: float | None
) -> None:
    clean = _copy(batch.state)
    dirty = _copy(batch.state)
    random = np.random.default_rng(group.seed)
    for _, owner, array in _list_arrays(dirty):
        if owner == "agent":
            columns = np.arange(array.shape[-1]) != TESTED_AGENT
            array[..., columns] = _make_garbage(array, random, garbage)[..., columns]
    before = _copy(dirty)
    clean_result = _call_hook(group.experiment, batch, clean, part, name)
    dirty_result = _call_hook(group.experiment, batch, dirty, part, name)
    hook = f"{part.__name__}.{name}"
    if clean_result != dirty_result:
        raise FailsError(f"{hook} returns a result that depends on other agents")
    for old, expected, actual in zip(*map(_list_arrays, (before, clean, dirty)), strict=True):
        is_of_agents = actual.owner == "agent"
        column = (..., TESTED_AGENT) if is_of_agents else ...
        if actual.values[column].tobytes() != expected.values[column].tobytes():
            raise FailsError(f"{hook} makes {actual.name} of an agent depend on other agents")
        if is_of_agents and _bytes_of_others(actual.values) != _bytes_of_others(old.values):
            raise FailsError(f"{hook} writes {actual.name} of other agents")


def _bytes_of_others(array: npt.NDArray[Any]) -> bytes:
    """Return the bytes of the columns of all agents except `TESTED_AGENT`."""
    return np.delete(array, TESTED_AGENT, -1).tobytes()


def _call_hook(experiment: Any, batch: CpuBatch, state: Any, part: Any, name: str) -> Any:
    """Call a hook for one agent, in plain Python."""
    rate = state.rate[0, TESTED_AGENT]
    synapse = Synapse(
        number=0,
        weight=state.weights[0, TESTED_AGENT],
        x=state.activations[0, TESTED_AGENT],
        y=state.activations[-1, TESTED_AGENT],
        rate=rate,
    )
    training = Training(rate, state.weights, state.activations, state.errors, state.targets)
    arguments = {
        **state._asdict(),
        "world": 0,
        "agent": TESTED_AGENT,
        "lane": TESTED_AGENT,
        "step": STEPS,
        "units": len(state.activations),
        "synapse": synapse,
        "training": training,
        "table": np.empty((len(state.weights), 3), np.float32),
        "model": batch.model,
        "state": state,
        "part": part_values(experiment, part, state),
    }
    function = getattr(part, name)
    names = inspect.signature(function).parameters
    with np.errstate(all="ignore"):
        try:
            return function(*(arguments[argument] for argument in names))
        except (IndexError, ValueError) as error:
            raise FailsError(
                f"{part.__name__}.{name} fails if the data of other agents change: {error}"
            ) from None


def _make_garbage(
    array: npt.NDArray[Any], random: np.random.Generator, value: float | None
) -> npt.NDArray[Any]:
    """Return an array of `value`, or of random numbers if it is None or the array has integers."""
    if array.dtype.kind != "f":
        return random.integers(0, 4, array.shape).astype(array.dtype)
    if value is not None:
        return np.full_like(array, value)
    return random.normal(0, 9, array.shape).astype(array.dtype)


def _copy(entry: Any) -> Any:
    if isinstance(entry, np.ndarray):
        return entry.copy()
    if isinstance(entry, tuple):
        copies = map(_copy, entry)
        return type(entry)(*copies) if hasattr(entry, "_fields") else tuple(copies)
    return entry


def _list_arrays(state: Any) -> Iterator[_OwnedArray]:
    """Yield the arrays of a state and of its parts."""
    for name, array in ARRAYS.items():
        yield _OwnedArray(name, array.owner, getattr(state, name))
    for _, values in list_parts(state):
        for name, array in type(values).part.arrays.items():
            if array.owner == "run":
                continue
            yield _OwnedArray(name, array.owner, getattr(values, name))
