"""Worlds of foragers as environments of PettingZoo and Gymnasium.

An observation is the inputs of an agent, an action is one of its actions, and the reward is the
energy that it eats in a step. A life is an episode of fixed length. The same seed gives the same
worlds: `reset(seed=...)` starts generation 0 of run 0, and each later `reset()` the next
generation.

References
----------
J. K. Terry and others, "PettingZoo", NeurIPS 34 (2021).
M. Towers and others, "Gymnasium", arXiv 2407.17032 (2024).
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from baldwinlab.core.errors import RefusedError, require_positive
from baldwinlab.core.extras import missing_extra
from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.models.miniworld.appearance import describe_appearance
from baldwinlab.models.miniworld.external_actions import Numbers, SteeredBatch

try:
    import gymnasium
    from gymnasium import spaces
    from gymnasium.vector import AutoresetMode, VectorEnv
    from pettingzoo import ParallelEnv
except ImportError:
    raise missing_extra("rl", "an environment") from None

SEED_LIMIT = 2**31  # seeds are less than this


class _Worlds:
    """Several worlds, their episodes, and the spaces of one of their agents."""

    def __init__(self, experiment: BaseExperiment, worlds: int) -> None:
        if not isinstance(experiment, Experiment):
            raise RefusedError(
                f"{experiment.name} has the model {experiment.model!r}, whose lives have no steps; "
                "choose an experiment of the model 'miniworld'"
            )
        require_positive("worlds", worlds)
        self._steered = SteeredBatch(experiment, 0, range(worlds))
        self.shape = (worlds, experiment.population.size)
        self.length = experiment.lifetime.steps
        appearance = describe_appearance(experiment)
        self.inputs = appearance.inputs
        self.actions = appearance.actions
        self.chooses = bool(experiment.part("motor.body").chooses)
        self._seed = 0
        self._generation = -1

    def observation_space(self) -> Any:
        """Return the space of the inputs, each 0 to 1."""
        return spaces.Box(0, 1, (len(self.inputs),), np.float32)

    def action_space(self) -> Any:
        """Return the space of the actions: one action, or for continuous bodies a number for each."""
        if self.chooses:
            return spaces.Discrete(len(self.actions))
        return spaces.Box(0, 1, (len(self.actions),), np.float32)

    @property
    def is_over(self) -> bool:
        """Return whether the life has ended."""
        return self._steered.step >= self.length

    def reset(self, seed: int | None) -> Numbers:
        """Start the next generation, or generation 0 of a seed. Return the first inputs."""
        if seed is not None:
            self._seed = seed % SEED_LIMIT
            self._generation = -1
        self._generation += 1
        return self._steered.begin(self._seed, self._generation)

    def act(self, actions: npt.NDArray[Any]) -> tuple[Numbers, npt.NDArray[np.float64]]:
        """Simulate one step of all agents. Return their inputs and the energy that they ate.

        `actions` is an array [agent of all worlds] or [agent of all worlds, action].
        """
        outputs = (
            np.eye(len(self.actions), dtype=np.float32)[actions]
            if self.chooses
            else np.asarray(actions, np.float32)
        )
        return self._steered.act(outputs.reshape(*self.shape, -1))


class ForagersTogether(ParallelEnv[str, Numbers, Any]):  # type: ignore[misc]  # ParallelEnv has no types
    """The agents of one world, each with its own policy. See `parallel_env`.

    Parameters
    ----------
    experiment
        The experiment.
    """

    metadata = {"name": "baldwinlab_v0", "render_modes": []}  # noqa: RUF012 (as PettingZoo declares it)
    render_mode = None

    def __init__(self, experiment: BaseExperiment) -> None:
        """Make the environment."""
        self._worlds = _Worlds(experiment, 1)
        self.possible_agents = [f"agent_{number}" for number in range(self._worlds.shape[1])]
        self.agents: list[str] = []
        self.observation_spaces = {
            agent: self._worlds.observation_space() for agent in self.possible_agents
        }
        self.action_spaces = {agent: self._worlds.action_space() for agent in self.possible_agents}

    def observation_space(self, agent: str) -> Any:
        """Return the space of the inputs of an agent.

        Parameters
        ----------
        agent
            Name of an agent.

        Returns
        -------
        gymnasium.spaces.Box
            Each input is 0 to 1.
        """
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> Any:
        """Return the space of the actions of an agent.

        Parameters
        ----------
        agent
            Name of an agent.

        Returns
        -------
        gymnasium.spaces.Space
            Discrete; a Box for a body with continuous actions.
        """
        return self.action_spaces[agent]

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Numbers], dict[str, dict[str, Any]]]:
        """Start the next life, or the first life of a seed.

        Parameters
        ----------
        seed
            Seed of the simulations.
        options
            Not used.

        Returns
        -------
        tuple of dict
            The inputs and an empty dict of each agent.
        """
        sensed = self._worlds.reset(seed)
        self.agents = list(self.possible_agents)
        return self._by_agent(sensed[0]), {agent: {} for agent in self.agents}

    def step(self, actions: dict[str, Any]) -> tuple[dict[str, Any], ...]:
        """Simulate one step.

        Parameters
        ----------
        actions
            The action of each agent.

        Returns
        -------
        tuple of dict
            Inputs, energy eaten, termination (never), truncation (the end of life) and an empty
            dict of each agent.

        Raises
        ------
        RefusedError
            An agent has no action, or the life is over.
        """
        if missing := [agent for agent in self.agents if agent not in actions]:
            raise RefusedError(
                f"{missing[0]} has no action; give one for each of the {len(self.agents)} agents"
            )
        if not self.agents:
            raise RefusedError("the life is over; call reset() to start the next one")
        sensed, gained = self._worlds.act(np.array([actions[agent] for agent in self.agents]))
        over = self._worlds.is_over
        agents = self.agents
        found: tuple[dict[str, Any], ...] = (
            self._by_agent(sensed[0]),
            {agent: float(energy) for agent, energy in zip(agents, gained[0], strict=True)},
            dict.fromkeys(agents, False),
            dict.fromkeys(agents, over),
            {agent: {} for agent in agents},
        )
        self.agents = [] if over else agents
        return found

    def render(self) -> None:
        """Do nothing. `baldwinlab lab` shows lives."""

    def close(self) -> None:
        """Do nothing. No resource is open."""

    def _by_agent(self, rows: npt.NDArray[Any]) -> dict[str, Any]:
        return dict(zip(self.possible_agents, rows, strict=True))


class ForagerAlone(gymnasium.Env[Numbers, Any]):
    """One agent that is alone in its world. See `single_env`.

    Parameters
    ----------
    experiment
        The experiment.
    """

    metadata = {"render_modes": []}  # noqa: RUF012 (as Gymnasium declares it)

    def __init__(self, experiment: BaseExperiment) -> None:
        """Make the environment."""
        if experiment.population.size != 1:
            size = experiment.population.size
            raise RefusedError(
                f"population.size = {size}, but single_env needs 1; use parallel_env or vector_env for more"
            )
        self._worlds = _Worlds(experiment, 1)
        self.observation_space, self.action_space = (
            self._worlds.observation_space(),
            self._worlds.action_space(),
        )

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
        sensed, gained = self._worlds.act(np.array([action]))
        return sensed[0, 0], float(gained[0, 0]), False, self._worlds.is_over, {}


class ManyForagers(VectorEnv[Numbers, npt.NDArray[Any], Numbers]):
    """The agents of many worlds as environments of one policy. See `vector_env`.

    Parameters
    ----------
    experiment
        The experiment.
    worlds
        Number of worlds.
    """

    metadata = {"autoreset_mode": AutoresetMode.NEXT_STEP}  # noqa: RUF012 (as Gymnasium declares it)

    def __init__(self, experiment: BaseExperiment, worlds: int) -> None:
        """Make the environments."""
        self._worlds = _Worlds(experiment, worlds)
        self.num_envs = worlds * experiment.population.size
        self.single_observation_space, self.single_action_space = (
            self._worlds.observation_space(),
            self._worlds.action_space(),
        )
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
        return self._rows(self._worlds.reset(seed)), {}

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
        none = np.zeros(self.num_envs, bool)
        if self._worlds.is_over:
            # Gymnasium wants the step after the last one to start the next life.
            return (
                self._rows(self._worlds.reset(None)),
                np.zeros(self.num_envs),
                none,
                none.copy(),
                {},
            )
        sensed, gained = self._worlds.act(np.asarray(actions))
        return (
            self._rows(sensed),
            gained.reshape(-1),
            none,
            np.full(self.num_envs, self._worlds.is_over),
            {},
        )

    def _rows(self, sensed: Numbers) -> Numbers:
        return sensed.reshape(self.num_envs, -1)


def parallel_env(experiment: BaseExperiment) -> ForagersTogether:
    """Return one world of foragers as a ParallelEnv of PettingZoo.

    Observations are inputs from 0 to 1, and the reward is the energy that an agent eats in a step.
    `reset(seed=...)` starts generation 0 of run 0 of that seed, and each later `reset()` the next
    generation.

    Parameters
    ----------
    experiment
        The experiment. Its learning rule, selection and variation are not used.

    Returns
    -------
    pettingzoo.ParallelEnv
        The environment, with `population.size` agents.

    Raises
    ------
    RefusedError
        The model has no steps, or its agents act one after another.
    """
    return ForagersTogether(experiment)


def single_env(experiment: BaseExperiment) -> ForagerAlone:
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
    return ForagerAlone(experiment)


def vector_env(experiment: BaseExperiment, worlds: int = 1) -> ManyForagers:
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
    return ManyForagers(experiment, worlds)
