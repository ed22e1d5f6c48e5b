"""Recorders: objects that read variables of a batch during a lifetime.

A time is a number of simulated steps. The state at the time `s` contains the positions of agents
and items at the beginning of step `s`. The state at the time `s + 1` contains the inputs, outputs
and actions of the agents in step `s`.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from baldwinlab.models.miniworld.allocation import iterate_arrays
from baldwinlab.models.miniworld.backends.choice import SimulatedAgents

# Lanes are the indices of agents in a batch: first all agents of world 0, then those of world 1.
Lanes = slice | int
# Index of the world of a batch with recorded items.
RECORDED_WORLD = 0
Array = npt.NDArray[Any]

# Functions that read a variable. The first axis is the lane, which is the last axis of the state.
VARIABLE_READERS: Mapping[str, Callable[[SimulatedAgents, Lanes], Array]] = {
    "x": lambda batch, lanes: batch.state.positions[0, lanes],
    "y": lambda batch, lanes: batch.state.positions[1, lanes],
    # In units of 1 / HEADING_COUNT of a full turn.
    "heading": lambda batch, lanes: batch.state.heading[0, lanes],
    "action": lambda batch, lanes: batch.state.action[0, lanes],
    "activations": lambda batch, lanes: batch.state.activations[:, lanes].T,
    # Only for a teacher that computes outputs in every step.
    "teacher_activations": lambda batch, lanes: batch.state.lookup.activations[:, lanes].T,
    "inputs": lambda batch, lanes: batch.state.activations[: batch.model.inputs, lanes].T,
    # The outputs are the last units, one for each target.
    "outputs": lambda batch, lanes: batch.state.activations[-len(batch.state.targets) :, lanes].T,
    "weights": lambda batch, lanes: batch.state.weights[:, lanes].T,
    # 1 for living agents, 0 for dead agents.
    "alive": lambda batch, lanes: batch.state.alive[0, lanes],
    # [lane, kind]: items of each region, then agents of each prey species, eaten since birth.
    "eaten_kinds": lambda batch, lanes: batch.state.eaten_in_life[:, lanes].T,
    # [lane]: the sum over kinds.
    "eaten_in_life": lambda batch, lanes: batch.state.eaten_in_life[:, lanes].sum(axis=0),
    # Index of the agent that teaches.
    "teacher": lambda batch, lanes: _teachers(batch)[0, lanes],
    # [item, (x, y)] of the recorded world.
    "items": lambda batch, lanes: batch.items()[RECORDED_WORLD],
}


def _teachers(batch: SimulatedAgents) -> Array:
    """Return the index of the teacher [1, lane], from the array that the learning rule names."""
    rule = batch.state.rule
    teachers: Array = getattr(rule, type(rule).part.teacher_array)
    return teachers


class Recorder(Protocol):
    """Object that reads a batch at several times of a lifetime."""

    @property
    def times(self) -> Collection[int]:
        """Times of the calls of `record`."""

    def record(self, batch: SimulatedAgents, time: int) -> None:
        """Read the batch after `time` simulated steps."""


def record_batch(batch: SimulatedAgents, recorders: Sequence[Recorder]) -> None:
    """Simulate a batch to the last time of its recorders, and call each recorder at its times."""
    recorders_by_time: dict[int, list[Recorder]] = {}
    for recorder in recorders:
        for time in recorder.times:
            recorders_by_time.setdefault(int(time), []).append(recorder)
    steps_done = 0
    for time in sorted(recorders_by_time):
        batch.simulate(steps_done, time)
        steps_done = time
        for recorder in recorders_by_time[time]:
            recorder.record(batch, time)


class SpeciesRecorder:
    """Recorder that calls another recorder with the agents of one species instead of the batch."""

    def __init__(self, agents: SimulatedAgents, recorder: Recorder) -> None:
        """`agents`: the view of the species."""
        self.times = recorder.times
        self._agents = agents
        self._recorder = recorder

    def record(self, batch: SimulatedAgents, time: int) -> None:
        self._recorder.record(self._agents, time)


class Series:
    """Recorder of a variable of some agents: `values` is [time, lane, ...], in order of `times`."""

    def __init__(
        self,
        variable: str,
        times: Sequence[int],
        lanes: Lanes,
        dtype: type[np.generic] | None = None,
        transform: Callable[[Array], Array] = np.asarray,
    ) -> None:
        """Create a recorder. `transform`: applied to the variable. `dtype`: type of `values`."""
        self.times = times
        self.values: Array
        self._read = VARIABLE_READERS[variable]
        self._lanes = lanes
        self._dtype = dtype
        self._transform = transform
        self._time_index = 0

    def record(self, batch: SimulatedAgents, time: int) -> None:
        value = self._transform(self._read(batch, self._lanes))
        is_first = self._time_index == 0
        if is_first:
            self.values = np.empty((len(self.times), *value.shape), self._dtype or value.dtype)
        self.values[self._time_index] = value
        self._time_index += 1


class ItemMoves:
    """Recorder of the positions of items in one world at the first time, and of all later moves."""

    def __init__(self, times: range) -> None:
        """`times` are consecutive, so that each step is compared with the previous step."""
        self.times = times
        # [item, (x, y)]: positions at the first time.
        self.items: npt.NDArray[np.float32] = np.empty((0, 2), np.float32)
        # A world feature can move items that no agent has eaten, so positions are compared.
        self._previous_items = self.items
        # For each time with moves: the arrays time, item, x and y, each [moved item].
        self._moves: list[tuple[Array, ...]] = []

    def record(self, batch: SimulatedAgents, time: int) -> None:
        previous_items = self._previous_items
        items = batch.items()[RECORDED_WORLD]
        self._previous_items = items
        if time == self.times[0]:
            self.items = items
            return
        state = batch.state
        step = time - 1
        is_touched = state.touched[RECORDED_WORLD] == step
        is_moved = is_touched | (items != previous_items).any(axis=1)
        moved_items = np.flatnonzero(is_moved)
        if moved_items.size:
            times = np.full(moved_items.size, time)
            x = state.item_x[RECORDED_WORLD, moved_items]
            y = state.item_y[RECORDED_WORLD, moved_items]
            self._moves.append((times, moved_items, x, y))

    def columns(self) -> dict[str, Array]:
        """Return all moves in order, each [move]: `step` (time), `item`, new `x`, new `y`."""
        types = {"step": np.uint32, "item": np.uint32, "x": np.float32, "y": np.float32}
        columns: dict[str, Array] = {}
        for column_index, (name, dtype) in enumerate(types.items()):
            # `concatenate` needs at least one array.
            no_values = np.empty(0, dtype)
            values = [no_values, *(move[column_index] for move in self._moves)]
            columns[name] = np.concatenate(values, dtype=dtype, casting="unsafe")
        return columns


class FirstTime:
    """Recorder of the first time at which each condition is true: `values` [condition], or NaN.

    A true condition must remain true. If a condition becomes true between two `times`, the recorder
    restores the state at the earlier time, and finds the step by bisection.
    """

    def __init__(
        self, conditions: Callable[[SimulatedAgents], npt.NDArray[np.bool_]], times: Sequence[int]
    ) -> None:
        """`times` begin with the current time of the batch."""
        self.times = times
        self.values: npt.NDArray[np.float32] = np.empty(0, np.float32)
        self._conditions = conditions
        self._saved_time = 0
        self._saved_state: list[Array] = []

    def record(self, batch: SimulatedAgents, time: int) -> None:
        if time == self.times[0]:
            self.values = np.where(self._conditions(batch), np.float32(time), np.float32(np.nan))
        elif self._is_newly_true(batch).any():
            _restore_state(batch, self._saved_state)
            self._bisect(batch, self._saved_time, time)
        self._saved_state = _copy_state(batch)
        self._saved_time = time

    def _is_newly_true(self, batch: SimulatedAgents) -> npt.NDArray[np.bool_]:
        return self._conditions(batch) & np.isnan(self.values)

    def _bisect(self, batch: SimulatedAgents, first_step: int, last_step: int) -> None:
        """Simulate from `first_step` to `last_step`. Store the times of newly true conditions."""
        is_single_step = last_step - first_step == 1
        if is_single_step:
            batch.simulate(first_step, last_step)
            self.values[self._is_newly_true(batch)] = last_step
            return
        middle = (first_step + last_step) // 2
        for begin, end in ((first_step, middle), (middle, last_step)):
            saved_state = _copy_state(batch)
            batch.simulate(begin, end)
            if self._is_newly_true(batch).any():
                _restore_state(batch, saved_state)
                self._bisect(batch, begin, end)


def _copy_state(batch: SimulatedAgents) -> list[Array]:
    return [array.copy() for array in iterate_arrays(batch.state)]


def _restore_state(batch: SimulatedAgents, saved_state: list[Array]) -> None:
    for array, saved_array in zip(iterate_arrays(batch.state), saved_state, strict=True):
        array[:] = saved_array
