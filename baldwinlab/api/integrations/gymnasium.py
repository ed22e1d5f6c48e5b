"""Worlds of foragers as environments of Gymnasium.

Observations, actions, rewards and episodes are as in `baldwinlab.api.integrations.pettingzoo`.

References
----------
M. Towers and others, "Gymnasium", arXiv 2407.17032 (2024).
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from baldwinlab.api.integrations.steered_worlds import (
    RENDER_FPS,
    RENDER_MODES,
    SteeredWorlds,
    read_seed,
)
from baldwinlab.api.load import load
from baldwinlab.core.errors import RefusedError
from baldwinlab.core.extras import missing_extra_error
from baldwinlab.experiment import BaseExperiment, Experiment, assign
from baldwinlab.experiment.toml import format_assignments
from baldwinlab.models.miniworld.external_actions import Numbers

try:
    import gymnasium
    from gymnasium.vector import AutoresetMode, VectorEnv
    from gymnasium.wrappers import HumanRendering
except ImportError:
    raise missing_extra_error("rl", "an environment") from None

METADATA: dict[str, Any] = {"render_modes": list(RENDER_MODES), "render_fps": RENDER_FPS}
"""Metadata of an environment of one agent."""


class SingleForager(gymnasium.Env[Numbers, Any]):
    """The environment of the only agent of a world. See `single_env`."""

    metadata = METADATA

    def __init__(self, experiment: BaseExperiment, render_mode: str | None = None) -> None:
        """Make the environment."""
        if experiment.population.size != 1:
            size = experiment.population.size
            raise RefusedError(
                f"population.size = {size}, but single_env needs 1; use parallel_env or vector_env "
                "for more"
            )
        self.render_mode = render_mode
        self._worlds = SteeredWorlds(experiment, 1, render_mode)
        self.observation_space = self._worlds.observation_space()
        self.action_space = self._worlds.action_space()

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Numbers, dict[str, Any]]:
        """Start the next life, or the first life of a seed.

        `seed`: seed of the simulations, 0 to 2**32 - 1. Returns the inputs and an empty dict.
        """
        # Gymnasium requires this call. Its random generator is not used.
        super().reset(seed=None if seed is None else read_seed(seed))
        return self._worlds.reset(seed)[0, 0], {}  # World 0, agent 0.

    def step(self, action: Any) -> tuple[Numbers, float, bool, bool, dict[str, Any]]:
        """Simulate one step.

        Returns the inputs, the eaten energy as reward, False (a life is never terminated), whether
        the life ends (truncation), and an empty dict.
        """
        inputs, energy = self._worlds.act([action], ["action"])
        return inputs[0, 0], float(energy[0, 0]), False, self._worlds.is_over, {}

    def render(self) -> Any:
        """Draw the map with the agent, its trail and the items.

        Returns the image, [row, column, (red, green, blue)]. None without a render mode.
        """
        return next(iter(self._worlds.draw()), None)


class VectorForagers(VectorEnv[Numbers, npt.NDArray[Any], Numbers]):
    """The environments of the agents of several worlds, for one policy. See `vector_env`."""

    # Gymnasium declares the type of `metadata`.
    metadata = {  # noqa: RUF012
        "autoreset_mode": AutoresetMode.NEXT_STEP,
        "render_modes": ["rgb_array"],
        "render_fps": RENDER_FPS,
    }

    def __init__(
        self, experiment: BaseExperiment, worlds: int, render_mode: str | None = None
    ) -> None:
        """Make the environments."""
        self.render_mode = render_mode
        self._worlds = SteeredWorlds(experiment, worlds, render_mode)
        self.num_envs = worlds * experiment.population.size
        self.single_observation_space = self._worlds.observation_space()
        self.single_action_space = self._worlds.action_space()
        self.observation_space = gymnasium.vector.utils.batch_space(
            self.single_observation_space, self.num_envs
        )
        self.action_space = gymnasium.vector.utils.batch_space(
            self.single_action_space, self.num_envs
        )

    def reset(
        self, *, seed: int | list[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Numbers, dict[str, Any]]:
        """Start the next life in all worlds, or the first life of a seed, which is one number.

        `options` are not used. Returns the inputs [environment, input] and an empty dict.
        """
        if isinstance(seed, list):
            raise RefusedError(
                "seed must be one number; the worlds share it and differ by their run"
            )
        super().reset(seed=None if seed is None else read_seed(seed))
        return self._flatten_agents(self._worlds.reset(seed)), {}

    def step(self, actions: npt.NDArray[Any]) -> tuple[Any, ...]:
        """Simulate one step of all agents. The step after the end of life starts the next life.

        Returns the inputs [environment, input], the eaten energy as rewards, the terminations (all
        False), the truncations (all True at the end of life, else all False), and an empty dict.
        """
        all_false = np.zeros(self.num_envs, bool)
        if self._worlds.is_over:
            # AutoresetMode.NEXT_STEP: the step after the end of life ignores the actions.
            return (
                self._flatten_agents(self._worlds.reset(None)),
                np.zeros(self.num_envs),
                all_false,
                all_false.copy(),
                {},
            )
        names = [f"actions[{index}]" for index in range(self.num_envs)]
        inputs, energy = self._worlds.act(actions, names)
        return (
            self._flatten_agents(inputs),
            energy.reshape(-1),
            all_false,
            np.full(self.num_envs, self._worlds.is_over),
            {},
        )

    def render(self) -> tuple[Any, ...] | None:
        """Return an image per environment, or None without a render mode.

        The environments of one world have the same image.
        """
        images = self._worlds.draw()
        agents_per_world = self._worlds.shape[1]
        return tuple(image for image in images for _ in range(agents_per_world)) or None

    def _flatten_agents(self, inputs: Numbers) -> Numbers:
        """Return inputs [world, agent, input] as an array [environment, input]."""
        return inputs.reshape(self.num_envs, -1)


def single_env(
    experiment: BaseExperiment, render_mode: str | None = None
) -> gymnasium.Env[Numbers, Any]:
    """Return a world with one forager as an Env of Gymnasium.

    Parameters
    ----------
    experiment : BaseExperiment
        The experiment, with `population.size` = 1.
    render_mode : str or None
        "rgb_array": `render()` returns an image. "human": each step is shown in a window, which
        needs pygame. None: no images.

    Returns
    -------
    gymnasium.Env
        The environment. Observations, rewards and resets are as in `parallel_env`.

    Raises
    ------
    RefusedError
        The experiment has more than one agent, or its model has no steps.

    Examples
    --------
    >>> import baldwinlab as bl
    >>> env = bl.single_env(bl.load("evo/A").replace(population={"size": 1}))
    >>> observation, _ = env.reset(seed=3)
    >>> observation.tolist(), env.action_space.n.item()
    ([0.0, 0.0, 0.0], 3)
    """
    if render_mode == "human":
        return HumanRendering(SingleForager(experiment, "rgb_array"))
    return SingleForager(experiment, render_mode)


def vector_env(
    experiment: BaseExperiment, worlds: int = 1, render_mode: str | None = None
) -> VectorForagers:
    """Return the agents of several worlds as a VectorEnv of Gymnasium, for one policy.

    All worlds start and end their lives at the same time.

    Parameters
    ----------
    experiment : BaseExperiment
        The experiment.
    worlds : int
        Number of worlds, at least 1. World 0 is run 0 of the seed, world 1 is run 1.
    render_mode : str or None
        "rgb_array": `render()` returns an image per environment. None: no images.

    Returns
    -------
    gymnasium.vector.VectorEnv
        `worlds` times `population.size` environments. Observations, rewards and resets are as in
        `parallel_env`.

    Raises
    ------
    ArgumentError
        `worlds` is less than 1.
    RefusedError
        The model has no steps, or its agents act one after another.

    Examples
    --------
    >>> import baldwinlab as bl
    >>> env = bl.vector_env(bl.load("evo/A"), worlds=2)
    >>> env.reset(seed=3)[0].shape
    (40, 3)
    """
    return VectorForagers(experiment, worlds, render_mode)


def make_forager(
    preset: str | Path | Experiment = "evo/A",
    set: Mapping[str, Any] | None = None,
    render_mode: str | None = None,
) -> gymnasium.Env[Numbers, Any]:
    """Return the environment "baldwinlab/Forager-v0". `gymnasium.make` calls this function.

    `set`: settings that change, such as {"lifetime.steps": 500} or {"lifetime": {"steps": 500}}.
    Raises `RefusedError` if the model has no steps, or its agents act one after another.
    """
    return single_env(_load_single_forager(preset, set), render_mode)


# `gymnasium.make` reads the render modes from this attribute of the function.
make_forager.metadata = METADATA  # type: ignore[attr-defined]


def make_foragers(
    num_envs: int = 1,
    preset: str | Path | Experiment = "evo/A",
    set: Mapping[str, Any] | None = None,
    render_mode: str | None = None,
) -> VectorForagers:
    """Return environments "baldwinlab/Forager-v0". `gymnasium.make_vec` calls this function."""
    return vector_env(_load_single_forager(preset, set), num_envs, render_mode)


def _load_single_forager(
    preset: str | Path | Experiment, settings: Mapping[str, Any] | None
) -> BaseExperiment:
    """Return an experiment with one agent per world, and with changed settings."""
    experiment = preset if isinstance(preset, BaseExperiment) else load(preset)
    if isinstance(experiment, Experiment):
        # The elite must not be larger than the population.
        experiment = experiment.replace(population={"size": 1, "worlds": 1}, evolution={"elite": 0})
    changed: BaseExperiment = assign(experiment, format_assignments(settings or {}))
    return changed
