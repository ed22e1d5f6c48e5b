"""Images of a world during a lifetime whose agents take external actions."""

from __future__ import annotations

from collections import deque
from typing import Any

import numpy as np
import numpy.typing as npt

from baldwinlab.analysis.scene import TRAIL_STEPS, Scene, SceneRenderer
from baldwinlab.core.deferred import xr
from baldwinlab.experiment import Experiment
from baldwinlab.models.miniworld.appearance import appearance_json
from baldwinlab.models.miniworld.backends.cpu import PopulationView
from baldwinlab.models.miniworld.state import HEADING_COUNT

Image = npt.NDArray[np.uint8]
"""Array [row, column, (red, green, blue)]."""
DEGREES_PER_TURN = 360


class LifetimeImages:
    """Images of one world, which show its agents, their trails and its items."""

    def __init__(self, world: int) -> None:
        self._world = world
        # The states after the last steps, as many as the trails of the agents show.
        self._states: deque[dict[str, npt.NDArray[Any]]] = deque(maxlen=TRAIL_STEPS + 1)
        self._steps_done = 0

    def begin(self, experiment: Experiment, generation: int, view: PopulationView) -> None:
        """Start a lifetime with its state before the first step."""
        self._experiment = experiment
        self._generation = generation
        self._states.clear()
        self.record(view)
        self._steps_done = 0

    def record(self, view: PopulationView) -> None:
        """Store the state after one more step."""
        n_agents = self._experiment.population.size
        lanes = slice(self._world * n_agents, (self._world + 1) * n_agents)
        positions = view.positions()[self._world]
        # A dead agent has a negative x.
        positions = np.where(positions[:, :1] < 0, np.float32(np.nan), positions)
        items = view.items()[self._world]
        heading = view.state.heading[0, lanes] * np.float32(DEGREES_PER_TURN / HEADING_COUNT)
        self._states.append(
            {
                "x": positions[:, 0],
                "y": positions[:, 1],
                "heading": heading,
                "eaten": view.state.eaten_in_life[:, lanes].sum(axis=0),
                "item_x": items[:, 0].copy(),
                "item_y": items[:, 1].copy(),
            }
        )
        self._steps_done += 1

    def draw(self) -> Image:
        """Draw the last state."""
        arrays = {
            name: np.stack([state[name] for state in self._states]) for name in self._states[0]
        }
        # From the numbers in life to the numbers in each step, and those before the first state.
        arrays["eaten"] = np.diff(arrays["eaten"], axis=0, prepend=0)
        dimensions = {name: "item" if name.startswith("item") else "agent" for name in arrays}
        trace = xr.Dataset(
            {name: (("step", dimensions[name]), values) for name, values in arrays.items()},
            attrs={
                "condition": self._experiment.name,
                "generation": self._generation,
                "appearance": appearance_json(self._experiment),
            },
        )
        world = self._experiment.world
        last_state = len(self._states) - 1
        scene = Scene(
            trace,
            world.width,
            world.height,
            first_step=self._steps_done - last_state,
            n_steps=self._experiment.lifetime.steps,
        )
        return np.asarray(SceneRenderer(scene).frame(last_state), np.uint8)
