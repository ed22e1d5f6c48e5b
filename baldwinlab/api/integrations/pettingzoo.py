"""Worlds of foragers as environments of PettingZoo.

An observation is the inputs of an agent, an action is one action of the agent, and the reward is
the energy that the agent eats in a step. A lifetime is an episode of fixed length. The same seed
gives the same worlds: `reset(seed=...)` starts generation 0 of run 0, and each later `reset()`
starts the next generation.

References
----------
J. K. Terry and others, "PettingZoo", NeurIPS 34 (2021).
"""

from __future__ import annotations

from typing import Any

import numpy.typing as npt

from baldwinlab.api.integrations.steered_worlds import RENDER_FPS, InvalidActionError, SteeredWorlds
from baldwinlab.core.extras import missing_extra_error
from baldwinlab.experiment import BaseExperiment
from baldwinlab.models.miniworld.external_actions import Numbers

try:
    from pettingzoo import ParallelEnv
except ImportError:
    raise missing_extra_error("rl", "an environment") from None


# ParallelEnv has no types.
class ParallelForagers(ParallelEnv[str, Numbers, Any]):  # type: ignore[misc]
    """The environment of the agents of one world, with a policy per agent. See `parallel_env`."""

    # PettingZoo declares the type of `metadata`.
    metadata = {  # noqa: RUF012
        "name": "baldwinlab_v0",
        "render_modes": ["rgb_array"],
        "render_fps": RENDER_FPS,
        "is_parallelizable": True,
    }

    def __init__(self, experiment: BaseExperiment, render_mode: str | None = None) -> None:
        """Make the environment."""
        self.render_mode = render_mode
        self._worlds = SteeredWorlds(experiment, 1, render_mode)
        _, n_agents = self._worlds.shape
        self.possible_agents = [f"agent_{index}" for index in range(n_agents)]
        self.agents: list[str] = []
        self.observation_spaces = {
            agent: self._worlds.observation_space() for agent in self.possible_agents
        }
        self.action_spaces = {agent: self._worlds.action_space() for agent in self.possible_agents}

    def observation_space(self, agent: str) -> Any:
        """Return the space of the inputs of an agent. Each input is 0 to 1."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> Any:
        """Return the space of the actions of an agent, a Box for continuous actions."""
        return self.action_spaces[agent]

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Numbers], dict[str, dict[str, Any]]]:
        """Start the next life, or the first life of a seed from 0 to 2**32 - 1.

        `options` are not used. Returns the inputs and an empty dict, both by agent.
        """
        inputs = self._worlds.reset(seed)
        self.agents = list(self.possible_agents)
        return self._name_by_agent(inputs[0]), {agent: {} for agent in self.agents}

    def step(self, actions: dict[str, Any]) -> tuple[dict[str, Any], ...]:
        """Simulate one step, with an action of each agent.

        Returns five dicts by agent: the inputs, the eaten energy as reward, False (a life is never
        terminated), whether the life ends (truncation), and an empty dict.
        """
        names = [f"actions[{agent!r}]" for agent in self.possible_agents]
        # Without agents, no life is running, and `act` raises ResetNeededError.
        listed_actions = self._list_actions(actions) if self.agents else []
        inputs, energy = self._worlds.act(listed_actions, names)
        is_over = self._worlds.is_over
        agents = self.agents
        results: tuple[dict[str, Any], ...] = (
            self._name_by_agent(inputs[0]),
            {agent: float(reward) for agent, reward in zip(agents, energy[0], strict=True)},
            dict.fromkeys(agents, False),
            dict.fromkeys(agents, is_over),
            {agent: {} for agent in agents},
        )
        self.agents = [] if is_over else agents
        return results

    def _list_actions(self, actions: dict[str, Any]) -> list[Any]:
        """Return the actions in the order of the agents."""
        if missing := [agent for agent in self.agents if agent not in actions]:
            raise InvalidActionError(
                f"{missing[0]} has no action; give one for each of the {len(self.agents)} agents"
            )
        if unknown := [agent for agent in actions if agent not in self.action_spaces]:
            raise InvalidActionError(
                f"there is no agent {unknown[0]!r}; the agents are {self.agents[0]} to "
                f"{self.agents[-1]}"
            )
        return [actions[agent] for agent in self.agents]

    def render(self) -> Any:
        """Draw the map with the agents, their trails and the items; None without a render mode."""
        return next(iter(self._worlds.draw()), None)

    def close(self) -> None:
        """Do nothing. No resource is open."""

    def _name_by_agent(self, rows: npt.NDArray[Any]) -> dict[str, Any]:
        """Return the rows of an array [agent, ...] by the names of the agents."""
        return dict(zip(self.possible_agents, rows, strict=True))


def parallel_env(experiment: BaseExperiment, render_mode: str | None = None) -> ParallelForagers:
    """Return one world of foragers as a ParallelEnv of PettingZoo.

    Observations are inputs from 0 to 1, and the reward is the energy that an agent eats in a step.
    `reset(seed=...)` starts generation 0 of run 0 of that seed, and each later `reset()` the next
    generation.

    Parameters
    ----------
    experiment : BaseExperiment
        The experiment. Its learning rule, selection and variation are not used. A generation has
        the settings that the schedule gives to it.
    render_mode : str or None
        "rgb_array": `render()` returns an image. None: no images.

    Returns
    -------
    pettingzoo.ParallelEnv
        The environment, with `population.size` agents.

    Raises
    ------
    RefusedError
        The model has no steps, or its agents act one after another.

    Examples
    --------
    >>> import baldwinlab as bl
    >>> env = bl.parallel_env(bl.load("evo/A"))
    >>> observations, _ = env.reset(seed=3)
    >>> len(observations), observations[env.agents[0]].tolist()
    (20, [0.0, 0.0, 0.0])
    """
    return ParallelForagers(experiment, render_mode)
