"""Lives that are written down: one way through a batch of lives, from moment to moment, and whoever wants to know notes it there.

GenerationKey m is when m steps have been lived: what an agent finds in step s is there at moment s, what it sensed and did at s + 1.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from baldwinlab.models.miniworld.allocation import arrays_of
from baldwinlab.models.miniworld.backends.choice import Batch

Lanes = slice | int  # agents of a batch, world after world
Array = npt.NDArray[Any]

# What can be written down of agents, by name, an array whose first axis is the lane; and of the first world.
VARIABLES: Mapping[str, Callable[[Batch, Lanes], Array]] = {
    "x": lambda batch, lanes: batch.state.places[0, lanes],
    "y": lambda batch, lanes: batch.state.places[1, lanes],
    "heading": lambda batch, lanes: batch.state.heading[0, lanes],  # turns
    "action": lambda batch, lanes: batch.state.action[0, lanes],
    "activations": lambda batch, lanes: batch.state.activations[:, lanes].T,
    "teacher_activations": lambda batch, lanes: (
        batch.state.recall.activations[:, lanes].T
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
    """Something that is to be known of a batch at some moments."""

    @property
    def moments(self) -> Collection[int]: ...

    def take(self, batch: Batch, moment: int) -> None: ...


def record_batch(batch: Batch, notes: Sequence[Recorder], lived: int = 0) -> None:
    """Live a batch, of which `collect_outcomes` steps have been lived, through all moments of `notes`, and let each take what it wants."""
    takers: dict[int, list[Recorder]] = {}
    for note in notes:
        for moment in note.moments:
            takers.setdefault(int(moment), []).append(note)
    for moment in sorted(takers):
        batch.simulate(lived, moment)
        lived = moment
        for note in takers[moment]:
            note.take(batch, moment)


class Series:
    """A variable of some agents at some moments; `values` is [moment, ...] once the batch has been followed."""

    def __init__(
        self,
        variable: str,
        moments: Sequence[int],
        lanes: Lanes,
        dtype: type[np.generic] | None = None,
        change: Callable[[Array], Array] = np.asarray,
    ) -> None:
        """What `change` makes of what is read is kept as `dtype`, or else as it is."""
        self.moments = moments
        self.values: Array
        self._read, self._lanes, self._dtype, self._change, self._row = (
            VARIABLES[variable],
            lanes,
            dtype,
            change,
            0,
        )

    def take(self, batch: Batch, moment: int) -> None:
        value = self._change(self._read(batch, self._lanes))
        if self._row == 0:
            self.values = np.empty((len(self.moments), *value.shape), self._dtype or value.dtype)
        self.values[self._row] = value
        self._row += 1


class ItemMoves:
    """Where the items of a batch's only world lie at the first moment, and from which moment on which of them lies elsewhere."""

    def __init__(self, moments: range) -> None:
        """`moments` follow each other."""
        self.moments = moments
        self.items: npt.NDArray[np.float32] = np.empty((0, 2), np.float32)  # [item, (x, y)]
        self._last = (
            self.items
        )  # as they lay a moment ago: a feature of the world may move what nobody has eaten
        self._found: list[tuple[Array, ...]] = []

    def take(self, batch: Batch, moment: int) -> None:
        before, self._last = self._last, batch.items()[0]
        if moment == self.moments[0]:
            self.items = self._last
            return
        moved = np.flatnonzero(
            (batch.state.touched[0] == moment - 1) | (self._last != before).any(axis=1)
        )
        if moved.size:
            state = batch.state
            self._found.append(
                (np.full(moved.size, moment), moved, state.item_x[0, moved], state.item_y[0, moved])
            )

    def columns(self) -> dict[str, Array]:
        """The moves in their order, [move] each: `step` and `item` uint32, `x` and `y` float32."""
        types = {"step": np.uint32, "item": np.uint32, "x": np.float32, "y": np.float32}
        return {
            name: np.concatenate(
                [np.empty(0, dtype), *(found[column] for found in self._found)],
                dtype=dtype,
                casting="unsafe",
            )
            for column, (name, dtype) in enumerate(types.items())
        }


class FirstTime:
    """The first moment at which something holds that then holds for good, for each of an array of things; NaN for never.

    Between two of `moments` at which something has come about, it goes back and lives in halves, down to the step.
    """

    def __init__(
        self, holds: Callable[[Batch], npt.NDArray[np.bool_]], moments: Sequence[int]
    ) -> None:
        """`moments` begin with the one at which the batch is."""
        self.moments = moments
        self.values: npt.NDArray[np.float32] = np.empty(0, np.float32)
        self._holds, self._lived = holds, 0
        self._before: list[Array] = []  # the state at the moment `_make_outcomes`

    def take(self, batch: Batch, moment: int) -> None:
        if moment == self.moments[0]:
            self.values = np.where(self._holds(batch), np.float32(moment), np.float32(np.nan))
        elif self._new(batch).any():
            _restore_state(batch, self._before)
            self._halve(batch, self._lived, moment)
        self._before, self._lived = _copy_state(batch), moment

    def _new(self, batch: Batch) -> npt.NDArray[np.bool_]:
        return self._holds(batch) & np.isnan(self.values)

    def _halve(self, batch: Batch, first: int, last: int) -> None:
        """Live from the moment `first`, at which the batch is, to `last`, by which something has come about."""
        if last - first == 1:
            batch.simulate(first, last)
            self.values[self._new(batch)] = last
            return
        middle = (first + last) // 2
        for begin, end in ((first, middle), (middle, last)):
            before = _copy_state(batch)
            batch.simulate(begin, end)
            if self._new(batch).any():
                _restore_state(batch, before)
                self._halve(batch, begin, end)


def _copy_state(batch: Batch) -> list[Array]:
    return [array.copy() for array in arrays_of(batch.state)]


def _restore_state(batch: Batch, kept: list[Array]) -> None:
    for array, value in zip(arrays_of(batch.state), kept, strict=True):
        array[:] = value
