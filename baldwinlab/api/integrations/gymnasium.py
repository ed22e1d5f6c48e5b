"""Worlds of foragers as environments of other people's libraries: PettingZoo's and Gymnasium's.

What an agent senses goes out, what it does comes in, and the energy that it eats is its reward; the engine does everything else.
A life is an episode, which ends by its length. `reset(seed=...)` begins with generation 0 of that seed, run 0, and each `reset()`
after it with the next generation, so the same seed gives the same worlds.

Sources: J. K. Terry and others, "PettingZoo", NeurIPS 34 (2021); M. Towers and others, "Gymnasium", arXiv 2407.17032 (2024).
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from baldwinlab.core.errors import RefusedError, require_positive
from baldwinlab.core.extras import missing_extra
from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.models.miniworld.appearance import look
from baldwinlab.models.miniworld.external_actions import Numbers, Steered

try:
    import gymnasium
    from gymnasium import spaces
    from gymnasium.vector import AutoresetMode, VectorEnv
    from pettingzoo import ParallelEnv
except ImportError:
    raise missing_extra("rl", "an environment") from None

FIRST_SEEDS = 2**31  # what a seed is below


class _Worlds:
    """Worlds side by side, their episodes, and the spaces of one agent of theirs."""

    def __init__(self, experiment: BaseExperiment, worlds: int) -> None:
        if not isinstance(experiment, Experiment):
            raise RefusedError(
                f"{experiment.name} is of the model {experiment.model}, whose lives have no steps to take"
            )
        require_positive("worlds", worlds)
        self._steered = Steered(experiment, 0, range(worlds))
        self.shape = (worlds, experiment.population.size)
        self.length = experiment.lifetime.steps
        found = look(experiment)
        self.inputs, self.actions = found.inputs, found.actions
        self.chooses = bool(experiment.part("motor.body").chooses)
        self._seed, self._generation = 0, -1

    def observation_space(self) -> Any:
        """An input is in [0, 1]."""
        return spaces.Box(0, 1, (len(self.inputs),), np.float32)

    def action_space(self) -> Any:
        """One of the body's actions; or a number in [0, 1] for each, where a body does something of all of them."""
        return (
            spaces.Discrete(len(self.actions))
            if self.chooses
            else spaces.Box(0, 1, (len(self.actions),), np.float32)
        )

    @property
    def over(self) -> bool:
        return self._steered.step >= self.length

    def reset(self, seed: int | None) -> Numbers:
        if seed is not None:
            self._seed, self._generation = seed % FIRST_SEEDS, -1
        self._generation += 1
        return self._steered.begin(self._seed, self._generation)

    def act(self, actions: npt.NDArray[Any]) -> tuple[Numbers, npt.NDArray[np.float64]]:
        """A step of all agents; `actions` is [agent of all worlds] or [agent of all worlds, action]."""
        outputs = (
            np.eye(len(self.actions), dtype=np.float32)[actions]
            if self.chooses
            else np.asarray(actions, np.float32)
        )
        return self._steered.act(outputs.reshape(*self.shape, -1))


class ForagersTogether(ParallelEnv[str, Numbers, Any]):  # type: ignore[misc]  # which has no types
    """The agents of one world, each with a policy of its own. See `parallel_env`."""

    metadata = {"name": "baldwinlab_v0", "render_modes": []}  # noqa: RUF012 (as PettingZoo declares it)
    render_mode = None

    def __init__(self, experiment: BaseExperiment) -> None:
        self._worlds = _Worlds(experiment, 1)
        self.possible_agents = [f"agent_{number}" for number in range(self._worlds.shape[1])]
        self.agents: list[str] = []
        self.observation_spaces = {
            agent: self._worlds.observation_space() for agent in self.possible_agents
        }
        self.action_spaces = {agent: self._worlds.action_space() for agent in self.possible_agents}

    def observation_space(self, agent: str) -> Any:
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> Any:
        return self.action_spaces[agent]

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Numbers], dict[str, dict[str, Any]]]:
        sensed = self._worlds.reset(seed)
        self.agents = list(self.possible_agents)
        return self._by_agent(sensed[0]), {agent: {} for agent in self.agents}

    def step(self, actions: dict[str, Any]) -> tuple[dict[str, Any], ...]:
        """Raises RefusedError where an agent is told nothing."""
        if missing := [agent for agent in self.agents if agent not in actions]:
            raise RefusedError(
                f"{missing[0]} is told no action; all of {len(self.agents)} agents need one in every step"
            )
        if not self.agents:
            raise RefusedError("the life is over: reset() begins the next one")
        sensed, gained = self._worlds.act(np.array([actions[agent] for agent in self.agents]))
        over = self._worlds.over
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
        """Nothing: `baldwinlab lab` shows lives."""

    def close(self) -> None:
        """Nothing is held open."""

    def _by_agent(self, rows: npt.NDArray[Any]) -> dict[str, Any]:
        return dict(zip(self.possible_agents, rows, strict=True))


class ForagerAlone(gymnasium.Env[Numbers, Any]):
    """One agent in a world of its own. See `single_env`."""

    metadata = {"render_modes": []}  # noqa: RUF012 (as Gymnasium declares it)

    def __init__(self, experiment: BaseExperiment) -> None:
        if experiment.population.size != 1:
            size = experiment.population.size
            raise RefusedError(
                f"population.size = {size}: one agent alone needs 1; for more there are parallel_env and vector_env"
            )
        self._worlds = _Worlds(experiment, 1)
        self.observation_space, self.action_space = (
            self._worlds.observation_space(),
            self._worlds.action_space(),
        )

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Numbers, dict[str, Any]]:
        super().reset(seed=seed)
        return self._worlds.reset(seed)[0, 0], {}

    def step(self, action: Any) -> tuple[Numbers, float, bool, bool, dict[str, Any]]:
        sensed, gained = self._worlds.act(np.array([action]))
        return sensed[0, 0], float(gained[0, 0]), False, self._worlds.over, {}


class ManyForagers(VectorEnv[Numbers, npt.NDArray[Any], Numbers]):
    """The agents of many worlds as environments of one policy. See `vector_env`."""

    metadata = {"autoreset_mode": AutoresetMode.NEXT_STEP}  # noqa: RUF012 (as Gymnasium declares it)

    def __init__(self, experiment: BaseExperiment, worlds: int) -> None:
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
        """One seed, which is that of all worlds: the first is its run 0, the second its run 1, and so on."""
        if isinstance(seed, list):
            raise RefusedError(
                "the worlds of a vector of foragers have one seed, and differ by their run"
            )
        super().reset(seed=seed)
        return self._rows(self._worlds.reset(seed)), {}

    def step(self, actions: npt.NDArray[Any]) -> tuple[Any, ...]:
        none = np.zeros(self.num_envs, bool)
        if self._worlds.over:  # the step after the last one begins the next life, as Gymnasium asks
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
            np.full(self.num_envs, self._worlds.over),
            {},
        )

    def _rows(self, sensed: Numbers) -> Numbers:
        return sensed.reshape(self.num_envs, -1)


def parallel_env(experiment: BaseExperiment) -> ForagersTogether:
    """The agents of one world as PettingZoo's ParallelEnv: observations are inputs in [0, 1], rewards the energy eaten in a step.

    Raises RefusedError for a model without steps, and for agents that act one after another.
    """
    return ForagersTogether(experiment)


def single_env(experiment: BaseExperiment) -> ForagerAlone:
    """One agent alone as Gymnasium's Env; `population.size` must be 1. Raises as `parallel_env` does."""
    return ForagerAlone(experiment)


def vector_env(experiment: BaseExperiment, worlds: int = 1) -> ManyForagers:
    """All agents of so many worlds as Gymnasium's VectorEnv, for one policy: `worlds` times `population.size` environments.

    Worlds begin their lives together and end them together. Raises as `parallel_env` does.
    """
    return ManyForagers(experiment, worlds)
