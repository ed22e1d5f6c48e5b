"""Worlds that are simulated step by step while a page watches them.

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
from baldwinlab.lab.sources.life_query import Life, StartData
from baldwinlab.models.miniworld.backends.choice import SimulatedAgents
from baldwinlab.models.miniworld.species import make_species_batch
from baldwinlab.simulation.recorder import RECORDED_WORLD, VARIABLE_READERS
from baldwinlab.simulation.reevaluation import make_batch

# Worlds in memory: the two of a comparison.
MAX_CURSORS: Final = 2
# Memory of the snapshots of one cursor.
MAX_SNAPSHOT_BYTES: Final = 64 * 2**20
# Agent-steps between two checks of the time.
PIECE_AGENT_STEPS: Final = 1_000_000

Array = npt.NDArray[Any]


class Snapshot(NamedTuple):
    """A world before a step: positions in map units, headings, and the items eaten so far.

    The arrays of agents are [agent], and those of items [item]. `x` of a dead agent is NaN.
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
    """One lifetime, simulated up to a step, and its latest snapshots."""

    def __init__(self, life: Life) -> None:
        self._life = life
        self._lock = Lock()
        self._start: StartData | None = None
        # The agents of each species, or of the world. The first entry simulates all.
        self._members: Sequence[SimulatedAgents] = ()
        self._steps_done = 0
        self._snapshots: OrderedDict[int, Snapshot] = OrderedDict()

    @property
    def species(self) -> SpeciesIndices | None:
        """The species of each agent [agent]. None without species, and before the first step."""
        return self._start.species if self._start else None

    def read(self, steps: Sequence[int], seconds: float) -> tuple[dict[int, Snapshot], int]:
        """Return the snapshots of some steps, and the number of simulated steps.

        `seconds`: the simulation stops after this time, and later steps are missing in the result.
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
        """Simulate up to a step and store its snapshot, unless the deadline passes before."""
        if not self._members or step < self._steps_done:
            self._begin()
        piece = max(1, PIECE_AGENT_STEPS // self._life.experiment.agents_per_world)
        while self._steps_done < step:
            stop = min(self._steps_done + piece, step)
            self._members[0].simulate(self._steps_done, stop)
            self._steps_done = stop
            if time.monotonic() > deadline and stop < step:
                return False
        self._store(step, _take_snapshot(self._members))
        return True

    def _begin(self) -> None:
        """Begin the lifetime."""
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
        """Store a snapshot, and drop the oldest ones if they need too much memory."""
        self._snapshots[step] = snapshot
        max_snapshots = max(1, MAX_SNAPSHOT_BYTES // max(1, snapshot.count_bytes()))
        while len(self._snapshots) > max_snapshots:
            self._snapshots.popitem(last=False)


class WorldCursors:
    """The cursors of a server. A new one replaces the one that was not used for the longest time.

    The experiment and the key of a life determine its world, so pages share cursors.
    """

    def __init__(self) -> None:
        self._lock = Lock()
        self._cursors: OrderedDict[Hashable, WorldCursor] = OrderedDict()

    def find(self, life: Life) -> WorldCursor:
        """Return the cursor of a life."""
        key = (life.experiment, life.key)
        with self._lock:
            if key not in self._cursors:
                self._cursors[key] = WorldCursor(life)
            self._cursors.move_to_end(key)
            while len(self._cursors) > MAX_CURSORS:
                self._cursors.popitem(last=False)
            return self._cursors[key]


def _take_snapshot(members: Sequence[SimulatedAgents]) -> Snapshot:
    """Return the agents and the items of a world. Each species has its agents in one member."""
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
