"""Worlds of foragers with external actions, for PettingZoo and Gymnasium, and images of worlds."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from baldwinlab.analysis.movie import TRAIL_STEPS, Scene, SceneRenderer
from baldwinlab.core.deferred import xr
from baldwinlab.core.errors import ArgumentError, RefusedError
from baldwinlab.core.extras import missing_extra_error
from baldwinlab.core.numbers import require_whole_number
from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.models.miniworld.appearance import Appearance, appearance_json, describe_appearance
from baldwinlab.models.miniworld.backends.cpu import PopulationView
from baldwinlab.models.miniworld.external_actions import (
    Numbers,
    SteeredBatch,
    require_external_actions,
)
from baldwinlab.models.miniworld.state import HEADING_COUNT

try:
    from gymnasium import error, spaces
except ImportError:
    raise missing_extra_error("rl", "an environment") from None

Image = npt.NDArray[np.uint8]
"""Array [row, column, (red, green, blue)]."""
DEGREES_PER_TURN = 360
SEED_LIMIT: Final = 2**32
"""Seeds are less than this limit, because the key of the random numbers has 32 bits."""
RENDER_MODES: Final = ("human", "rgb_array")
RENDER_FPS: Final = 25
"""Images per second of a recorded video or of a window. An image shows one step."""


class LifetimeImages:
    """Images of one world, which show the agents, the trails of the agents, and the items."""

    def __init__(self, world: int) -> None:
        self._world = world
        # The last states. A trail connects the current position with `TRAIL_STEPS` earlier ones.
        self._states: deque[dict[str, npt.NDArray[Any]]] = deque(maxlen=TRAIL_STEPS + 1)
        self._steps_done = 0

    def begin(self, experiment: Experiment, generation: int, view: PopulationView) -> None:
        """Start a lifetime, and store the state before the first step."""
        self._experiment = experiment
        self._generation = generation
        self._states.clear()
        self.record(view)
        # `record` has counted a step, but no step was simulated yet.
        self._steps_done = 0

    def record(self, view: PopulationView) -> None:
        """Store the current state of the world, and count one step."""
        n_agents = self._experiment.population.size
        lanes = slice(self._world * n_agents, (self._world + 1) * n_agents)
        positions = view.positions()[self._world]  # [agent, (x, y)]
        # The engine marks a dead agent with a negative x. An image shows no agent at NaN.
        positions = np.where(positions[:, :1] < 0, np.float32(np.nan), positions)
        items = view.items()[self._world]  # [item, (x, y)]
        # The engine stores a heading as index of one of `HEADING_COUNT` directions.
        heading = view.state.heading[0, lanes] * np.float32(DEGREES_PER_TURN / HEADING_COUNT)
        self._states.append(
            {
                "x": positions[:, 0],
                "y": positions[:, 1],
                "heading": heading,
                "eaten": view.state.eaten_in_life[:, lanes].sum(axis=0),  # Of all kinds, [agent].
                "item_x": items[:, 0].copy(),
                "item_y": items[:, 1].copy(),
            }
        )
        self._steps_done += 1

    def draw(self) -> Image:
        """Draw the current state, with trails from the earlier stored states."""
        arrays = {
            name: np.stack([state[name] for state in self._states]) for name in self._states[0]
        }
        # Totals since birth -> items per step. The first entry is the total of the first state.
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


class ResetNeededError(RefusedError, error.ResetNeeded):
    """Error of a step or an image before the first reset, or of a step after a lifetime."""


class InvalidActionError(RefusedError, error.InvalidAction):
    """Error of an action that the space of the actions does not contain."""


class SteeredWorlds:
    """Several worlds whose agents get their actions from a policy outside the package.

    A generation has the settings that the schedule of the experiment gives to it.

    `worlds`: number of worlds, at least 1. `render_mode`: "rgb_array" for images of the worlds, or
    None.
    """

    def __init__(
        self, experiment: BaseExperiment, worlds: int, render_mode: str | None = None
    ) -> None:
        if not isinstance(experiment, Experiment):
            raise RefusedError(
                f"{experiment.name} has the model {experiment.model!r}, whose lives have no steps; "
                "choose an experiment of the model 'miniworld'"
            )
        worlds = require_whole_number("worlds", worlds)
        if render_mode == "human":
            raise RefusedError("render_mode = 'human' needs single_env; use 'rgb_array' for images")
        if render_mode not in (None, *RENDER_MODES):
            raise ArgumentError("render_mode", render_mode, f"must be one of {RENDER_MODES}")
        appearance = _require_constant_spaces(experiment)
        self._experiment = experiment
        # The settings of the current generation.
        self._settings = experiment.at(0)
        # The seed 0 is a placeholder: `reset` sets the seed. World 0 is run 0, world 1 is run 1.
        self._batch = SteeredBatch(self._settings, 0, range(worlds))
        self.shape = (worlds, experiment.population.size)
        self.life_steps = experiment.lifetime.steps
        self.inputs = appearance.inputs
        self.actions = appearance.actions
        self.has_discrete_actions = bool(experiment.part("motor.body").chooses)
        self._seed = 0
        self._generation = -1  # No lifetime has started yet.
        n_images = 0 if render_mode is None else worlds
        self._images = [LifetimeImages(world) for world in range(n_images)]

    def observation_space(self) -> Any:
        """Return the space of the inputs."""
        return spaces.Box(0, 1, (len(self.inputs),), np.float32)

    def action_space(self) -> Any:
        """Return the space of the actions."""
        if self.has_discrete_actions:
            return spaces.Discrete(len(self.actions))
        return spaces.Box(0, 1, (len(self.actions),), np.float32)

    @property
    def is_over(self) -> bool:
        """Return whether the lifetime has ended."""
        return self._batch.step >= self.life_steps

    def reset(self, seed: int | None) -> Numbers:
        """Start the next generation, or generation 0 of a seed.

        `seed`: seed of the simulations, or None for the next generation. Returns the first inputs,
        [world, agent, input].
        """
        if seed is not None:
            self._seed = read_seed(seed)
            self._generation = -1
        self._generation += 1
        settings = self._experiment.at(self._generation)
        if settings != self._settings:
            self._settings = settings
            self._batch = SteeredBatch(settings, 0, range(self.shape[0]))
        inputs = self._batch.begin(self._seed, self._generation)
        for images in self._images:
            images.begin(settings, self._generation, self._batch.view)
        return inputs

    def act(self, actions: Any, names: Sequence[str]) -> tuple[Numbers, npt.NDArray[np.float64]]:
        """Simulate one step of all agents.

        `names`: the name of each agent in messages, world after world. Returns the next inputs,
        [world, agent, input], and the energy that each agent ate in the step, [world, agent].
        """
        self._require_started("step")
        if self.is_over:
            raise ResetNeededError("the lifetime is over; call reset() to start the next one")
        checked_actions = self._check_actions(actions, names)
        if self.has_discrete_actions:
            # The output of the chosen action is 1, and the others are 0.
            outputs = np.eye(len(self.actions), dtype=np.float32)[checked_actions]
        else:
            outputs = checked_actions.astype(np.float32)
        results = self._batch.act(outputs.reshape(*self.shape, -1))
        for images in self._images:
            images.record(self._batch.view)
        return results

    def draw(self) -> list[Image]:
        """Return one image per world of the current state, or an empty list without render mode."""
        self._require_started("render")
        return [images.draw() for images in self._images]

    def _require_started(self, method: str) -> None:
        if self._generation < 0:
            raise ResetNeededError(f"{method}() needs a lifetime; call reset() before")

    def _check_actions(self, actions: Any, names: Sequence[str]) -> npt.NDArray[Any]:
        """Return the actions as an array [agent] or [agent, action]."""
        n_actions = 0 if np.isscalar(actions) or actions is None else len(actions)
        if n_actions != len(names):
            raise InvalidActionError(
                f"{n_actions} actions do not fit {len(names)} agents; give one action for each "
                f"agent, which {self._describe_actions()}"
            )
        checked_actions = self._select_valid(actions)
        if checked_actions is not None:
            return checked_actions
        # Name the first invalid action. If each is valid alone, only their types differ.
        for name, action in zip(names, actions, strict=True):
            if self._select_valid([action]) is None:
                raise InvalidActionError(f"{name} = {action!r} {self._describe_actions()}")
        raise InvalidActionError(
            f"the actions have different types; each {self._describe_actions()}"
        )

    def _select_valid(self, values: Any) -> npt.NDArray[Any] | None:
        """Return actions [agent, ...] as an array, or None if their space does not contain all."""
        try:
            actions = np.asarray(values)
        except ValueError:
            # The actions have different shapes.
            return None
        if self.has_discrete_actions:
            highest = len(self.actions) - 1
            has_valid_type = actions.ndim == 1 and actions.dtype.kind in "iu"
        else:
            highest = 1
            has_valid_type = (
                actions.shape[1:] == (len(self.actions),) and actions.dtype.kind in "iuf"
            )
        # A comparison with NaN is false.
        is_valid = has_valid_type and bool(((actions >= 0) & (actions <= highest)).all())
        return actions if is_valid else None

    def _describe_actions(self) -> str:
        names = ", ".join(self.actions)
        if self.has_discrete_actions:
            return f"must be a whole number from 0 to {len(self.actions) - 1} ({names})"
        return f"must be an array of {len(self.actions)} numbers from 0 to 1 ({names})"


def read_seed(seed: Any) -> int:
    """Return a seed as an integer of Python. Raise ArgumentError for an invalid seed."""
    is_integer = isinstance(seed, int | np.integer) and not isinstance(seed, bool)
    if not is_integer or not 0 <= seed < SEED_LIMIT:
        raise ArgumentError("seed", seed, f"must be a whole number from 0 to {SEED_LIMIT - 1}")
    return int(seed)


def _require_constant_spaces(experiment: Experiment) -> Appearance:
    """Return the names of inputs and actions. Raise RefusedError if the schedule changes them."""
    first_settings = experiment.at(0)
    first_appearance = describe_appearance(first_settings)
    for generation in (0, *(change.generation for change in experiment.schedule)):
        settings = experiment.at(generation)
        require_external_actions(settings)
        appearance = describe_appearance(settings)
        has_same_actions = (
            appearance.actions == first_appearance.actions
            and settings.part("motor.body").chooses == first_settings.part("motor.body").chooses
        )
        if appearance.inputs != first_appearance.inputs or not has_same_actions:
            raise RefusedError(
                f"the schedule of {experiment.name} changes the inputs or the actions at "
                f"generation {generation}, and those of an environment are constant; use "
                f"experiment.at({generation}) for an environment with the later settings"
            )
    return first_appearance
