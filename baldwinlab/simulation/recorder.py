"""Recorders of the variables of a batch after selected numbers of steps.

The state after `s` steps holds the positions of agents and items at the beginning of step `s`. The
state after `s + 1` steps holds the inputs, outputs and actions of the agents in step `s`.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from baldwinlab.models.miniworld.allocation import iterate_arrays
from baldwinlab.models.miniworld.backends.choice import Batch

# Agents of a batch, world after world.
Lanes = slice | int
Array = npt.NDArray[Any]

# Functions that read a variable. The first axis of agents' variables is the lane.
VARIABLE_READERS: Mapping[str, Callable[[Batch, Lanes], Array]] = {
    "x": lambda batch, lanes: batch.state.positions[0, lanes],
    "y": lambda batch, lanes: batch.state.positions[1, lanes],
    "heading": lambda batch, lanes: batch.state.heading[0, lanes],  # turns
    "action": lambda batch, lanes: batch.state.action[0, lanes],
    "activations": lambda batch, lanes: batch.state.activations[:, lanes].T,
    "teacher_activations": lambda batch, lanes: (
        batch.state.lookup.activations[:, lanes].T
    ),  # where it is asked in every step
    "inputs": lambda batch, lanes: batch.state.activations[: batch.model.inputs, lanes].T,
    "outputs": lambda batch, lanes: batch.state.activations[-len(batch.state.targets) :, lanes].T,
    "weights": lambda batch, lanes: batch.state.weights[:, lanes].T,
    "eaten_in_life": lambda batch, lanes: batch.state.eaten_in_life[:, lanes].sum(
        axis=0
    ),  # items so far in life
    "teacher": lambda batch, lanes: getattr(
        batch.state.rule, type(batch.state.rule).part.teacher_array
    )[0, lanes],  # an agent
    "items": lambda batch, lanes: batch.items()[0],  # [item, (x, y)]
}


class Recorder(Protocol):
    """An object that reads a batch after some numbers of steps."""

    @property
    def times(self) -> Collection[int]:
        """The numbers of steps after which `record` is called."""

    def record(self, batch: Batch, time: int) -> None:
        """Read the batch after `time` simulated steps."""


def record_batch(batch: Batch, recorders: Sequence[Recorder], steps_done: int = 0) -> None:
    """Simulate a batch up to the last time of its recorders, and call each recorder at its times.

    Parameters
    ----------
    batch : Batch
        The batch.
    recorders : sequence of Recorder
        The recorders, which are called in this order.
    steps_done : int
        The number of steps that have been simulated.
    """
    recorders_by_time: dict[int, list[Recorder]] = {}
    for recorder in recorders:
        for time in recorder.times:
            recorders_by_time.setdefault(int(time), []).append(recorder)
    for time in sorted(recorders_by_time):
        batch.simulate(steps_done, time)
        steps_done = time
        for recorder in recorders_by_time[time]:
            recorder.record(batch, time)


class Series:
    """Record a variable of some agents: `values` is [time, ...]."""

    def __init__(
        self,
        variable: str,
        times: Sequence[int],
        lanes: Lanes,
        dtype: type[np.generic] | None = None,
        transform: Callable[[Array], Array] = np.asarray,
    ) -> None:
        """Create a recorder that stores the result of `transform`, as `dtype` if it is given."""
        self.times = times
        self.values: Array
        self._read = VARIABLE_READERS[variable]
        self._lanes = lanes
        self._dtype = dtype
        self._transform = transform
        self._row = 0

    def record(self, batch: Batch, time: int) -> None:
        value = self._transform(self._read(batch, self._lanes))
        if self._row == 0:
            self.values = np.empty((len(self.times), *value.shape), self._dtype or value.dtype)
        self.values[self._row] = value
        self._row += 1


class ItemMoves:
    """Record the positions of the items of one world at the first time, then each move."""

    def __init__(self, times: range) -> None:
        """`times` are consecutive."""
        self.times = times
        self.items: npt.NDArray[np.float32] = np.empty((0, 2), np.float32)  # [item, (x, y)]
        # A world feature can move items that no agent has eaten, so positions are compared.
        self._previous_items = self.items
        self._moves: list[tuple[Array, ...]] = []

    def record(self, batch: Batch, time: int) -> None:
        previous = self._previous_items
        items = batch.items()[0]
        self._previous_items = items
        if time == self.times[0]:
            self.items = items
            return
        state = batch.state
        is_moved = (state.touched[0] == time - 1) | (items != previous).any(axis=1)
        moved = np.flatnonzero(is_moved)
        if moved.size:
            step = np.full(moved.size, time)
            self._moves.append((step, moved, state.item_x[0, moved], state.item_y[0, moved]))

    def columns(self) -> dict[str, Array]:
        """Return the moves in order, [move]: `step` and `item` uint32, `x` and `y` float32."""
        types = {"step": np.uint32, "item": np.uint32, "x": np.float32, "y": np.float32}
        return {
            name: np.concatenate(
                [np.empty(0, dtype), *(move[column] for move in self._moves)],
                dtype=dtype,
                casting="unsafe",
            )
            for column, (name, dtype) in enumerate(types.items())
        }


class FirstTime:
    """Find the first time at which each of several conditions is true; NaN if it never is.

    A true condition must remain true. If a condition becomes true between two `times`, the recorder
    restores the state of the first of them, and finds the step by bisection.
    """

    def __init__(
        self, conditions: Callable[[Batch], npt.NDArray[np.bool_]], times: Sequence[int]
    ) -> None:
        """`times` begin with the current time of the batch."""
        self.times = times
        self.values: npt.NDArray[np.float32] = np.empty(0, np.float32)
        self._conditions = conditions
        self._saved_time = 0
        self._saved_state: list[Array] = []

    def record(self, batch: Batch, time: int) -> None:
        if time == self.times[0]:
            self.values = np.where(self._conditions(batch), np.float32(time), np.float32(np.nan))
        elif self._is_newly_true(batch).any():
            _restore_state(batch, self._saved_state)
            self._bisect(batch, self._saved_time, time)
        self._saved_state = _copy_state(batch)
        self._saved_time = time

    def _is_newly_true(self, batch: Batch) -> npt.NDArray[np.bool_]:
        return self._conditions(batch) & np.isnan(self.values)

    def _bisect(self, batch: Batch, first: int, last: int) -> None:
        """Simulate from `first`, the current time, to `last`, where a condition becomes true."""
        if last - first == 1:
            batch.simulate(first, last)
            self.values[self._is_newly_true(batch)] = last
            return
        middle = (first + last) // 2
        for begin, end in ((first, middle), (middle, last)):
            state = _copy_state(batch)
            batch.simulate(begin, end)
            if self._is_newly_true(batch).any():
                _restore_state(batch, state)
                self._bisect(batch, begin, end)


def _copy_state(batch: Batch) -> list[Array]:
    return [array.copy() for array in iterate_arrays(batch.state)]


def _restore_state(batch: Batch, state: list[Array]) -> None:
    for array, value in zip(iterate_arrays(batch.state), state, strict=True):
        array[:] = value
