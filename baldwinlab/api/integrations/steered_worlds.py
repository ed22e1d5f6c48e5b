"""Worlds of foragers for the environments of PettingZoo and Gymnasium."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
import numpy.typing as npt

from baldwinlab.core.errors import RefusedError, require_positive
from baldwinlab.core.extras import missing_extra_error
from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.models.miniworld.appearance import describe_appearance
from baldwinlab.models.miniworld.external_actions import Numbers, SteeredBatch

try:
    from gymnasium import spaces
except ImportError:
    raise missing_extra_error("rl", "an environment") from None

SEED_LIMIT: Final = 2**31
"""Seeds are less than this limit."""


class SteeredWorlds:
    """Several worlds whose agents get their actions from a policy outside the package.

    Parameters
    ----------
    experiment
        The experiment.
    worlds
        Number of worlds, at least 1.
    """

    def __init__(self, experiment: BaseExperiment, worlds: int) -> None:
        if not isinstance(experiment, Experiment):
            raise RefusedError(
                f"{experiment.name} has the model {experiment.model!r}, whose lives have no steps; "
                "choose an experiment of the model 'miniworld'"
            )
        require_positive("worlds", worlds)
        self._batch = SteeredBatch(experiment, 0, range(worlds))
        self.shape = (worlds, experiment.population.size)
        self.life_steps = experiment.lifetime.steps
        appearance = describe_appearance(experiment)
        self.inputs = appearance.inputs
        self.actions = appearance.actions
        self.has_discrete_actions = bool(experiment.part("motor.body").chooses)
        self._seed = 0
        self._generation = -1

    def observation_space(self) -> Any:
        """Return the space of the inputs.

        Returns
        -------
        gymnasium.spaces.Box
            Each input is 0 to 1.
        """
        return spaces.Box(0, 1, (len(self.inputs),), np.float32)

    def action_space(self) -> Any:
        """Return the space of the actions.

        Returns
        -------
        gymnasium.spaces.Space
            Discrete, or a Box for a body with continuous actions.
        """
        if self.has_discrete_actions:
            return spaces.Discrete(len(self.actions))
        return spaces.Box(0, 1, (len(self.actions),), np.float32)

    @property
    def is_over(self) -> bool:
        """Return whether the lifetime has ended."""
        return self._batch.step >= self.life_steps

    def reset(self, seed: int | None) -> Numbers:
        """Start the next generation, or generation 0 of a seed.

        Parameters
        ----------
        seed
            Seed of the simulations, or None for the next generation.

        Returns
        -------
        array of float32
            The first inputs, [world, agent, input].
        """
        if seed is not None:
            self._seed = seed % SEED_LIMIT
            self._generation = -1
        self._generation += 1
        return self._batch.begin(self._seed, self._generation)

    def act(self, actions: npt.NDArray[Any]) -> tuple[Numbers, npt.NDArray[np.float64]]:
        """Simulate one step of all agents.

        Parameters
        ----------
        actions
            An array [agent], with the agents of all worlds. For continuous actions an array
            [agent, action].

        Returns
        -------
        tuple of array
            The inputs, [world, agent, input], and the eaten energy, [world, agent].
        """
        if self.has_discrete_actions:
            # The output of the chosen action is 1, and the others are 0.
            outputs = np.eye(len(self.actions), dtype=np.float32)[actions]
        else:
            outputs = np.asarray(actions, np.float32)
        return self._batch.act(outputs.reshape(*self.shape, -1))
