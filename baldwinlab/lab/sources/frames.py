"""Frames of a world: each visible agent and item, or the counts of both in squares of the window.

A large world has more agents than a page can draw, and often more agents than the page has pixels.
The server then counts the agents in each square, so that a frame of 100,000 agents has some ten
thousand bytes.

A recording of a large world has hundreds of megabytes. A cursor therefore stores only the latest
snapshots of a lifetime, and continues the simulation when a page requests later steps.
"""

from __future__ import annotations

import time
from collections import OrderedDict
from collections.abc import Hashable, Sequence
from threading import Lock
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from baldwinlab.evolution.species import SpeciesIndices
from baldwinlab.experiment import Experiment
from baldwinlab.lab import Lab, Query, read_number, read_real
from baldwinlab.lab.sources import binary_frames, life_query
from baldwinlab.lab.sources.experiment_form import describe_world
from baldwinlab.lab.sources.life_query import Life, StartData
from baldwinlab.models.miniworld.appearance import describe_appearance
from baldwinlab.models.miniworld.backends.choice import SimulatedAgents
from baldwinlab.models.miniworld.species import make_species_batch
from baldwinlab.simulation.recorder import RECORDED_WORLD, VARIABLE_READERS
from baldwinlab.simulation.reevaluation import make_batch

# Number of worlds in memory. A page can compare two lifetimes.
MAX_CURSORS: Final = 2
# Memory of the snapshots of one cursor.
MAX_SNAPSHOT_BYTES: Final = 64 * 2**20
# Agent-steps that are simulated between two checks of the clock.
PIECE_AGENT_STEPS: Final = 1_000_000

# In this module, the arrays of agents are [agent], and the arrays of items [item].
Array = npt.NDArray[Any]


class Snapshot(NamedTuple):
    """A world at the beginning of a step. Positions are in map units.

    Headings are clockwise from +x, in units of 1 / appearance.headings of a circle. `eaten` is the
    number of items that each agent has eaten since birth. `x` of a dead agent is NaN.
    """

    x: Array
    y: Array
    heading: Array
    eaten: Array
    item_x: Array
    item_y: Array

    def count_bytes(self) -> int:
        """Return the size of all arrays."""
        return sum(array.nbytes for array in self)


class WorldCursor:
    """One lifetime that is simulated up to a step, and the latest snapshots of this lifetime."""

    def __init__(self, life: Life) -> None:
        self._life = life
        self._lock = Lock()
        self._start: StartData | None = None
        # One entry with all agents, or one entry per species. `simulate` of any entry simulates
        # all species, because the species share a world.
        self._members: Sequence[SimulatedAgents] = ()
        self._steps_done = 0
        self._snapshots: OrderedDict[int, Snapshot] = OrderedDict()

    @property
    def species(self) -> SpeciesIndices | None:
        """The species of each agent [agent]. None without species, and before the first `read`."""
        return self._start.species if self._start else None

    def read(self, steps: Sequence[int], seconds: float) -> tuple[dict[int, Snapshot], int]:
        """Return the snapshot of each step, by step, and the number of simulated steps.

        `seconds`: the simulation stops after this time. The result then lacks the later steps.
        A call simulates at least a few steps, so repeated calls reach every step.
        """
        deadline = time.monotonic() + seconds
        result: dict[int, Snapshot] = {}
        with self._lock:
            for step in steps:
                if step not in self._snapshots and not self._simulate_until(step, deadline):
                    break
                result[step] = self._snapshots[step]
                if time.monotonic() > deadline:
                    break
            return result, self._steps_done

    def _simulate_until(self, step: int, deadline: float) -> bool:
        """Simulate up to a step, store its snapshot, and return True; False after the deadline."""
        # A simulation cannot go back, so an earlier step needs a new one.
        if not self._members or step < self._steps_done:
            self._begin()
        piece = max(1, PIECE_AGENT_STEPS // self._life.experiment.agents_per_world)
        while self._steps_done < step:
            stop = min(self._steps_done + piece, step)
            self._members[0].simulate(self._steps_done, stop)
            self._steps_done = stop
            # At the requested step, the snapshot is stored even after the deadline.
            if time.monotonic() > deadline and stop < step:
                return False
        self._store(step, _take_snapshot(self._members))
        return True

    def _begin(self) -> None:
        seed, run, generation = self._life.key
        if self._start is None:
            self._start = self._life.load_start_data()
        genomes, species = self._start.genomes, self._start.species
        experiment = self._life.experiment
        if species is None:
            self._members = [
                make_batch(experiment, seed, [run], generation, genomes[None], world=RECORDED_WORLD)
            ]
        else:
            batch = make_species_batch(experiment, seed, run, generation, genomes, species)
            self._members = batch.views()
        self._steps_done = 0

    def _store(self, step: int, snapshot: Snapshot) -> None:
        """Store a snapshot, and drop the oldest snapshots if all together need too much memory."""
        self._snapshots[step] = snapshot
        max_snapshots = max(1, MAX_SNAPSHOT_BYTES // max(1, snapshot.count_bytes()))
        while len(self._snapshots) > max_snapshots:
            self._snapshots.popitem(last=False)


class WorldCursors:
    """The cursors of a server. A new cursor replaces the least recently used cursor.

    The experiment and the key of a lifetime determine its world, so pages share cursors.
    """

    def __init__(self) -> None:
        self._lock = Lock()
        self._cursors: OrderedDict[Hashable, WorldCursor] = OrderedDict()

    def find(self, life: Life) -> WorldCursor:
        """Return the cursor of a lifetime."""
        key = (life.experiment, life.key)
        with self._lock:
            if key not in self._cursors:
                self._cursors[key] = WorldCursor(life)
            self._cursors.move_to_end(key)
            while len(self._cursors) > MAX_CURSORS:
                self._cursors.popitem(last=False)
            return self._cursors[key]


def _take_snapshot(members: Sequence[SimulatedAgents]) -> Snapshot:
    """Return the snapshot of a world, with the agents of all members in the order of members."""
    x, y, heading, eaten, alive = (
        np.concatenate(
            [VARIABLE_READERS[name](member, slice(member.model.agents)) for member in members]
        )
        for name in ("x", "y", "heading", "eaten_in_life", "alive")
    )
    x[alive == 0] = np.nan
    state = members[0].state
    return Snapshot(
        x,
        y,
        heading,
        eaten,
        item_x=state.item_x[RECORDED_WORLD].copy(),
        item_y=state.item_y[RECORDED_WORLD].copy(),
    )


# Seconds of simulation for one response.
RESPONSE_SECONDS: Final = 0.1
MAX_FRAMES: Final = 32
MAX_SQUARES: Final = 400_000
# Maximum number of agents, or of items, that a frame contains one by one.
MAX_SHAPES: Final = 20_000


class Window(NamedTuple):
    """A rectangle of the map, in map units, divided into squares.

    A frame contains agents one by one if at most `max_shapes` agents are in the window, and else
    the count of each square. The same applies to items.
    """

    left: float
    top: float
    right: float
    bottom: float
    columns: int
    rows: int
    max_shapes: int

    def contains(self, x: Array, y: Array) -> npt.NDArray[np.bool_]:
        """Return whether each position is in the window. A position of NaN is outside."""
        is_inside: npt.NDArray[np.bool_] = (
            (x >= self.left) & (x < self.right) & (y >= self.top) & (y < self.bottom)
        )
        return is_inside

    def count_by_square(self, x: Array, y: Array) -> npt.NDArray[np.int64]:
        """Return the number of positions in each square [square], row by row of the window."""
        column = _find_square(x, self.left, self.right, self.columns)
        row = _find_square(y, self.top, self.bottom, self.rows)
        is_inside = (column < self.columns) & (row < self.rows)
        if not is_inside.all():
            column, row = column[is_inside], row[is_inside]
        return np.bincount(row * self.columns + column, minlength=self.rows * self.columns)


class FrameQuery(NamedTuple):
    """A request for `n_frames` frames: one every `interval` steps, from the step `first`."""

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
    """Return the frames that a query requests. The default is no frame, and the complete map."""
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

    The container (`binary_frames.pack`) has these arrays. The request has chosen the window.

    - eaten, eaters: uint32 [frame], the number of items eaten before the step, and the number of
      agents that ate them.
    - agent_counts: [frame, square], the number of agents in each square of the window, row by
      row. If the window contains few agents in the first frame, these arrays instead:
      agent_number [frame], the number of agents in the window; agent (index), x, y (map units),
      heading and agent_eaten [visible agent], frame by frame; species [visible agent] with
      several species.
    - item_counts: [frame, kind, square]. If the window contains few items in the first frame,
      these arrays instead: item_number [frame, kind]; item_x, item_y [visible item], frame by
      frame and kind by kind.
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
    """Return the arrays of agents of `make_frames`: the counts, or the visible agents if few."""
    # One array [square] per frame. The first frame decides for all frames of a response.
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
    """Return the arrays of items of `make_frames`: the counts, or the visible items if few."""
    # The items of a kind have successive indices, and the kinds follow each other.
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
    # `indices` ascend, so the place of `kind_ends` in them gives the number of items of each kind.
    numbers = [np.diff(np.searchsorted(indices, kind_ends), prepend=0) for indices in visible]
    return {
        "item_number": np.array(numbers, np.uint32).reshape(len(worlds), len(kind_sizes)),
        "item_x": np.concatenate([world.item_x[indices] for world, indices in pairs]),
        "item_y": np.concatenate([world.item_y[indices] for world, indices in pairs]),
    }


def _find_square(positions: Array, low: float, high: float, n_squares: int) -> Array:
    """Return the column or row of each position; `n_squares` or more outside of the window."""
    squares = np.floor((positions - np.float32(low)) * np.float32(n_squares / (high - low)))
    # The view turns a negative integer into a large one. The cast of a NaN gives a warning.
    with np.errstate(invalid="ignore"):
        indices: Array = squares.astype(np.int32).view(np.uint32)
    return indices


def _narrow(values: Array) -> Array:
    """Return whole numbers in the smallest unsigned type that can hold all of them."""
    return values.astype(np.min_scalar_type(int(values.max(initial=0))))


def _read_limited(query: Query, name: str, default: int, maximum: int) -> int:
    value = read_number(query, name, default)
    # Only a parameter with the default 0 can be 0.
    minimum = min(default, 1)
    if not minimum <= value <= maximum:
        raise ValueError(f"{name} = {value} must be at least {minimum} and at most {maximum}")
    return value
