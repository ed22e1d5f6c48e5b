"""Worlds of foragers as environments of Gymnasium.

Observations, actions, rewards and episodes are those of `baldwinlab.api.integrations.pettingzoo`.

References
----------
M. Towers and others, "Gymnasium", arXiv 2407.17032 (2024).
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from baldwinlab.api.integrations.steered_worlds import SteeredWorlds
from baldwinlab.core.errors import RefusedError
from baldwinlab.core.extras import missing_extra_error
from baldwinlab.experiment import BaseExperiment
from baldwinlab.models.miniworld.external_actions import Numbers

try:
    import gymnasium
    from gymnasium.vector import AutoresetMode, VectorEnv
except ImportError:
    raise missing_extra_error("rl", "an environment") from None


class SingleForager(gymnasium.Env[Numbers, Any]):
    """The environment of the only agent of a world. See `single_env`.

    Parameters
    ----------
    experiment
        The experiment.
    """

    # Gymnasium declares the type of `metadata`.
    metadata = {"render_modes": []}  # noqa: RUF012

    def __init__(self, experiment: BaseExperiment) -> None:
        """Make the environment."""
        if experiment.population.size != 1:
            size = experiment.population.size
            raise RefusedError(
                f"population.size = {size}, but single_env needs 1; use parallel_env or vector_env "
                "for more"
            )
        self._worlds = SteeredWorlds(experiment, 1)
        self.observation_space = self._worlds.observation_space()
        self.action_space = self._worlds.action_space()

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Numbers, dict[str, Any]]:
        """Start the next life, or the first life of a seed.

        Parameters
        ----------
        seed
            Seed of the simulations.
        options
            Not used.

        Returns
        -------
        tuple
            The inputs and an empty dict.
        """
        super().reset(seed=seed)
        return self._worlds.reset(seed)[0, 0], {}

    def step(self, action: Any) -> tuple[Numbers, float, bool, bool, dict[str, Any]]:
        """Simulate one step.

        Parameters
        ----------
        action
            The action of the agent.

        Returns
        -------
        tuple
            Inputs, energy eaten, termination (never), truncation (the end of life) and an empty
            dict.
        """
        inputs, energy = self._worlds.act(np.array([action]))
        return inputs[0, 0], float(energy[0, 0]), False, self._worlds.is_over, {}


class VectorForagers(VectorEnv[Numbers, npt.NDArray[Any], Numbers]):
    """The environments of the agents of several worlds, for one policy. See `vector_env`.

    Parameters
    ----------
    experiment
        The experiment.
    worlds
        Number of worlds.
    """

    # Gymnasium declares the type of `metadata`.
    metadata = {"autoreset_mode": AutoresetMode.NEXT_STEP}  # noqa: RUF012

    def __init__(self, experiment: BaseExperiment, worlds: int) -> None:
        """Make the environments."""
        self._worlds = SteeredWorlds(experiment, worlds)
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
        """Start the next life in all worlds, or the first life of a seed.

        Parameters
        ----------
        seed
            One seed. World 0 is run 0 of the seed, world 1 is run 1.
        options
            Not used.

        Returns
        -------
        tuple
            The inputs of all agents and an empty dict.

        Raises
        ------
        RefusedError
            `seed` is a list.
        """
        if isinstance(seed, list):
            raise RefusedError(
                "seed must be one number; the worlds share it and differ by their run"
            )
        super().reset(seed=seed)
        return self._flatten_agents(self._worlds.reset(seed)), {}

    def step(self, actions: npt.NDArray[Any]) -> tuple[Any, ...]:
        """Simulate one step of all agents. The step after the end of life starts the next life.

        Parameters
        ----------
        actions
            The action of each agent.

        Returns
        -------
        tuple
            Inputs, energy eaten, terminations (never), truncations (the end of life) and an empty
            dict.
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
        inputs, energy = self._worlds.act(np.asarray(actions))
        return (
            self._flatten_agents(inputs),
            energy.reshape(-1),
            all_false,
            np.full(self.num_envs, self._worlds.is_over),
            {},
        )

    def _flatten_agents(self, inputs: Numbers) -> Numbers:
        """Return inputs [world, agent, input] as an array [environment, input]."""
        return inputs.reshape(self.num_envs, -1)


def single_env(experiment: BaseExperiment) -> SingleForager:
    """Return a world with one forager as an Env of Gymnasium.

    Parameters
    ----------
    experiment
        The experiment, with `population.size` = 1.

    Returns
    -------
    gymnasium.Env
        The environment. Observations, rewards and resets are those of `parallel_env`.

    Raises
    ------
    RefusedError
        The experiment has more than one agent, or its model has no steps.
    """
    return SingleForager(experiment)


def vector_env(experiment: BaseExperiment, worlds: int = 1) -> VectorForagers:
    """Return the agents of several worlds as a VectorEnv of Gymnasium, for one policy.

    All worlds start and end their lives at the same time.

    Parameters
    ----------
    experiment
        The experiment.
    worlds
        Number of worlds, at least 1. World 0 is run 0 of the seed, world 1 is run 1.

    Returns
    -------
    gymnasium.vector.VectorEnv
        `worlds` times `population.size` environments. Observations, rewards and resets are those of
        `parallel_env`.

    Raises
    ------
    ArgumentError
        `worlds` is less than 1.
    RefusedError
        The model has no steps, or its agents act one after another.
    """
    return VectorForagers(experiment, worlds)
