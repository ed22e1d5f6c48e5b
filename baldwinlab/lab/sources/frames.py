"""Frames of a world: the visible agents and items, or their numbers in squares of the window.

A world of many agents has more agents than a page can draw, and often more than it has pixels. The
server counts them, so that a frame of 100,000 agents has some ten thousand bytes.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from baldwinlab.experiment import Experiment
from baldwinlab.lab import Lab
from baldwinlab.lab.sources import binary_frames, life_query
from baldwinlab.lab.sources.experiment_form import describe_world
from baldwinlab.lab.sources.life_query import Life
from baldwinlab.lab.sources.query import Query, read_number, read_real
from baldwinlab.lab.sources.world_cursor import Snapshot, WorldCursor, WorldCursors
from baldwinlab.models.miniworld.appearance import describe_appearance

# Seconds of simulation before a response.
RESPONSE_SECONDS: Final = 0.1
MAX_FRAMES: Final = 32
MAX_SQUARES: Final = 400_000
# Agents or items of a frame that are returned one by one.
MAX_SHAPES: Final = 20_000

Array = npt.NDArray[Any]


class Window(NamedTuple):
    """A part of the map, in map units, divided into squares.

    Objects are returned one by one if the part contains at most `max_shapes` of them.
    """

    left: float
    top: float
    right: float
    bottom: float
    columns: int
    rows: int
    max_shapes: int

    def contains(self, x: Array, y: Array) -> npt.NDArray[np.bool_]:
        """Return whether each position is in the window. A NaN is not."""
        is_inside: npt.NDArray[np.bool_] = (
            (x >= self.left) & (x < self.right) & (y >= self.top) & (y < self.bottom)
        )
        return is_inside

    def count_by_square(self, x: Array, y: Array) -> npt.NDArray[np.int64]:
        """Return the number of positions in each square, row by row [square]."""
        column = _find_square(x, self.left, self.right, self.columns)
        row = _find_square(y, self.top, self.bottom, self.rows)
        is_inside = (column < self.columns) & (row < self.rows)
        if not is_inside.all():
            column, row = column[is_inside], row[is_inside]
        return np.bincount(row * self.columns + column, minlength=self.rows * self.columns)


class FrameQuery(NamedTuple):
    """The requested frames: `n_frames` frames from the step `first`, one every `interval` steps."""

    first: int
    interval: int
    n_frames: int
    window: Window

    def list_steps(self, n_steps: int) -> list[int]:
        """Return the steps of the frames in a lifetime of `n_steps`."""
        stop = self.first + self.interval * self.n_frames
        return list(range(self.first, min(stop, n_steps), self.interval))


def load_frames(cursors: WorldCursors, lab: Lab, query: Query) -> bytes:
    """Return the container with the requested frames of a lifetime."""
    life = life_query.find_life(lab, query)
    frame_query = read_frame_query(query, life.experiment)
    return make_frames(life, cursors.find(life), frame_query, dict(query))


def read_frame_query(query: Query, experiment: Experiment) -> FrameQuery:
    """Return the requested frames. The default is no frame, and a window of the complete map."""
    n_steps = experiment.lifetime.steps
    world = experiment.world
    window = Window(
        left=read_real(query, "left", 0.0),
        top=read_real(query, "top", 0.0),
        right=read_real(query, "right", world.width),
        bottom=read_real(query, "bottom", world.height),
        columns=_read_limited(query, "columns", 1, MAX_SQUARES),
        rows=_read_limited(query, "rows", 1, MAX_SQUARES),
        max_shapes=_read_limited(query, "max_shapes", 1, MAX_SHAPES),
    )
    if not (window.left < window.right and window.top < window.bottom):
        raise ValueError(
            f"the window from ({window.left:g}, {window.top:g}) to ({window.right:g},"
            f" {window.bottom:g}) is empty: left must be less than right, and top less than bottom"
        )
    n_squares = window.columns * window.rows
    if n_squares > MAX_SQUARES:
        raise ValueError(f"columns x rows = {n_squares:,} must be at most {MAX_SQUARES:,}")
    first = read_number(query, "first", 0)
    if first >= n_steps:
        raise ValueError(
            f"first = {first} must be less than {n_steps}, the number of steps of a lifetime"
        )
    return FrameQuery(
        first,
        interval=_read_limited(query, "interval", 1, n_steps),
        n_frames=_read_limited(query, "count", 0, MAX_FRAMES),
        window=window,
    )


def make_frames(
    life: Life, cursor: WorldCursor, frame_query: FrameQuery, source: dict[str, str]
) -> bytes:
    """Return the container with frames of a lifetime.

    The response can have fewer frames than requested, or none, because it is sent after a limited
    time. `simulated` in the header is the number of simulated steps.

    The container (`binary_frames.pack`) has these arrays. The window is that of the request.

    - eaten, eaters: uint32 [frame], the number of items eaten before the step, and of the
      agents that ate.
    - agent_counts: [frame, square], the number of agents in each square of the window, row by
      row. If the window contains few agents in the first frame, these arrays instead:
      agent_number [frame], the number of agents in the window; agent (index), x, y (map units),
      heading and agent_eaten [agent], frame by frame; species [agent] with several species.
    - item_counts: [frame, kind, square]. If the window contains few items, these arrays
      instead: item_number [frame, kind]; item_x, item_y [item], kind by kind.
    """
    experiment = life.experiment.at(life.key.generation)
    steps = frame_query.list_steps(experiment.lifetime.steps)
    snapshots, steps_done = cursor.read(steps, RESPONSE_SECONDS)
    window = frame_query.window
    header = {
        "kind": "frames",
        "source": source,
        "condition": experiment.name,
        **life.key._asdict(),
        "steps": experiment.lifetime.steps,
        "agents": experiment.agents_per_world,
        "simulated": steps_done,
        "interval": frame_query.interval,
        "frames": list(snapshots),
        "window": window._asdict(),
        **describe_world(experiment),
    }
    worlds = list(snapshots.values())
    kind_sizes = [kind.number for kind in describe_appearance(experiment).item_kinds]
    arrays = {
        "eaten": np.array([world.eaten.sum() for world in worlds], np.uint32),
        "eaters": np.array([np.count_nonzero(world.eaten) for world in worlds], np.uint32),
    }
    if worlds:
        arrays |= _make_agent_arrays(worlds, window, cursor.species)
        arrays |= _make_item_arrays(worlds, window, kind_sizes)
    return binary_frames.pack(header, arrays)


def _make_agent_arrays(
    worlds: Sequence[Snapshot], window: Window, species: Array | None
) -> dict[str, Array]:
    """Return the counts of agents, or the visible agents if there are few."""
    counts = [window.count_by_square(world.x, world.y) for world in worlds]
    if counts[0].sum() > window.max_shapes:
        return {"agent_counts": _narrow(np.stack(counts))}
    visible = [np.flatnonzero(window.contains(world.x, world.y)) for world in worlds]
    pairs = list(zip(worlds, visible, strict=True))
    agents = np.concatenate(visible)
    arrays = {
        "agent_number": np.array([indices.size for indices in visible], np.uint32),
        "agent": agents.astype(np.uint32),
        "x": np.concatenate([world.x[indices] for world, indices in pairs]),
        "y": np.concatenate([world.y[indices] for world, indices in pairs]),
        "heading": _narrow(np.concatenate([world.heading[indices] for world, indices in pairs])),
        "agent_eaten": _narrow(np.concatenate([world.eaten[indices] for world, indices in pairs])),
    }
    if species is not None:
        arrays["species"] = species[agents].astype(np.uint8)
    return arrays


def _make_item_arrays(
    worlds: Sequence[Snapshot], window: Window, kind_sizes: Sequence[int]
) -> dict[str, Array]:
    """Return the counts of items, or the visible items if there are few.

    Items are numbered by kind.
    """
    kind_ends = np.cumsum(kind_sizes)
    counts = [
        [
            window.count_by_square(world.item_x[end - size : end], world.item_y[end - size : end])
            for size, end in zip(kind_sizes, kind_ends, strict=True)
        ]
        for world in worlds
    ]
    if np.sum(counts[0]) > window.max_shapes:
        return {"item_counts": _narrow(np.array(counts))}
    visible = [np.flatnonzero(window.contains(world.item_x, world.item_y)) for world in worlds]
    pairs = list(zip(worlds, visible, strict=True))
    numbers = [np.diff(np.searchsorted(indices, kind_ends), prepend=0) for indices in visible]
    return {
        "item_number": np.array(numbers, np.uint32).reshape(len(worlds), len(kind_sizes)),
        "item_x": np.concatenate([world.item_x[indices] for world, indices in pairs]),
        "item_y": np.concatenate([world.item_y[indices] for world, indices in pairs]),
    }


def _find_square(positions: Array, low: float, high: float, n_squares: int) -> Array:
    """Return the column or row of positions. Those outside of the window have no column or row."""
    squares = np.floor((positions - np.float32(low)) * np.float32(n_squares / (high - low)))
    # A negative number becomes a large one. So does a NaN, with a warning.
    with np.errstate(invalid="ignore"):
        indices: Array = squares.astype(np.int32).view(np.uint32)
    return indices


def _narrow(values: Array) -> Array:
    """Return whole numbers in the smallest unsigned type."""
    return values.astype(np.min_scalar_type(int(values.max(initial=0))))


def _read_limited(query: Query, name: str, default: int, maximum: int) -> int:
    """Return a whole number of at most `maximum`. Raise ValueError for another value."""
    value = read_number(query, name, default)
    minimum = min(default, 1)
    if not minimum <= value <= maximum:
        raise ValueError(f"{name} = {value} must be at least {minimum} and at most {maximum}")
    return value
