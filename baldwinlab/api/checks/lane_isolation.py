"""No per-agent hook reads other agents: tried, with garbage in the columns of all others."""

from __future__ import annotations

import inspect
from collections.abc import Iterator
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from baldwinlab.api.checks.findings import FailsError
from baldwinlab.api.checks.fixture import Subject, is_of_miniworld, values_of
from baldwinlab.evolution import GenerationKey, draw_genomes
from baldwinlab.models.miniworld.backends.cpu import CpuBatch
from baldwinlab.models.miniworld.state import ARRAYS
from baldwinlab.parts.lane_check import PER_AGENT
from baldwinlab.parts.part import overridden_hooks

AGENT: Final = 2
STEPS: Final = 12  # after which it is tried
Owned = tuple[str, str, npt.NDArray[Any]]  # an array's name and owner


def check_lane_isolation(subject: Subject) -> str:
    hooks = [
        (part, name)
        for part in subject.parts
        for name in overridden_hooks(part)
        if name in PER_AGENT
    ]
    if not is_of_miniworld(subject.experiment) or not hooks:
        return "it has no hook per agent"
    experiment = subject.experiment
    batch = CpuBatch(experiment, subject.seed, [0])
    batch.begin(0, draw_genomes(experiment, GenerationKey(subject.seed, 0, 0))[None])
    batch.simulate(0, STEPS)
    for part, name in hooks:
        for garbage in (np.nan, None):
            _try(subject, batch, part, name, garbage)
    return ""


def _try(subject: Subject, batch: CpuBatch, part: Any, name: str, garbage: float | None) -> None:
    clean, dirty = _copied(batch.state), _copied(batch.state)
    random = np.random.default_rng(subject.seed)
    for array in (array for _, owner, array in _owned(dirty) if owner == "agent"):
        others = np.arange(array.shape[-1]) != AGENT
        array[..., others] = _garbage(array, random, garbage)[..., others]
    before = _copied(dirty)
    answers = [_call(subject.experiment, batch, state, part, name) for state in (clean, dirty)]
    if answers[0] != answers[1]:
        raise FailsError(
            f"{part.__name__}.{name} answers otherwise when other agents are otherwise"
        )
    for (what, owner, one), (_, _, other), (_, _, old) in zip(
        *map(_owned, (clean, dirty, before)), strict=True
    ):
        own = (..., AGENT) if owner == "agent" else ...
        if one[own].tobytes() != other[own].tobytes():
            raise FailsError(
                f"{part.__name__}.{name} makes {what} of an agent depend on other agents"
            )
        if (
            owner == "agent"
            and np.delete(other, AGENT, -1).tobytes() != np.delete(old, AGENT, -1).tobytes()
        ):
            raise FailsError(f"{part.__name__}.{name} writes {what} of other agents")


def _call(experiment: Any, batch: CpuBatch, state: Any, part: Any, name: str) -> Any:
    """Call a hook, as the plain Python that it is, for one agent."""
    numbers = {
        "world": 0,
        "agent": AGENT,
        "lane": AGENT,
        "step": STEPS,
        "first": 0,
        "rate": state.rate[0, AGENT],
    }
    values, found = (
        values_of(experiment, part, state),
        np.empty((len(state.weights), 3), np.float32),
    )
    asked = {"units": len(state.activations), "found": found}
    known = {
        **state._asdict(),
        **numbers,
        **asked,
        "model": batch.model,
        "state": state,
        "part": values,
    }
    function = getattr(part, name)
    with np.errstate(all="ignore"):
        try:
            return function(*(known[each] for each in inspect.signature(function).parameters))
        except (IndexError, ValueError) as error:
            raise FailsError(
                f"{part.__name__}.{name} fails when other agents are otherwise: {error}"
            ) from None


def _garbage(
    array: npt.NDArray[Any], random: np.random.Generator, value: float | None
) -> npt.NDArray[Any]:
    if array.dtype.kind != "f":
        return random.integers(0, 4, array.shape).astype(array.dtype)
    return (
        np.full_like(array, value)
        if value is not None
        else random.normal(0, 9, array.shape).astype(array.dtype)
    )


def _copied(entry: Any) -> Any:
    if isinstance(entry, np.ndarray):
        return entry.copy()
    if isinstance(entry, tuple):
        inside = map(_copied, entry)
        return type(entry)(*inside) if hasattr(entry, "_fields") else tuple(inside)
    return entry


def _owned(state: Any) -> Iterator[Owned]:
    """The arrays of a state and of its parts."""
    for name, array in ARRAYS.items():
        yield name, array.owner, getattr(state, name)
    for values in (
        state.lookup,
        state.network,
        state.rule,
        state.body,
        *state.senses,
        *state.features,
    ):
        for name, array in type(values).part.arrays.items():
            yield name, array.owner, getattr(values, name)
