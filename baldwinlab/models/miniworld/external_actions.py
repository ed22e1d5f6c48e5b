"""Lives whose actions are told from outside, step by step: the engine does all but think and learn."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from baldwinlab.core.errors import RefusedError
from baldwinlab.engine.jit import cached_jit, resolve_call
from baldwinlab.engine.reference import as_pointer
from baldwinlab.engine.simd import get, lanes_in_block, put, simd_block
from baldwinlab.experiment import Experiment
from baldwinlab.models.miniworld.allocation import (
    item_regions,
    list_hooks,
    make_model,
    make_state,
    poison_state,
)
from baldwinlab.models.miniworld.birth import init_generation
from baldwinlab.models.miniworld.state import Floats, Model, State
from baldwinlab.models.miniworld.step import (
    act_and_learn,
    all_agents,
    end_step_of_features,
    sense_environment,
)

Numbers = npt.NDArray[np.float32]  # [world, agent, number]


def simulate_steered(model: Model, state: State, newborn: bool, step: int, outputs: Floats) -> None:
    """Be born, if newborn; else take the step with these `outputs` [action, lane]. Then sense what the next step begins with."""
    model, state = as_pointer(model), as_pointer(state)
    everyone = all_agents(model, state)
    if newborn:
        init_generation(model, state)
        sense_environment(everyone, model, state, step)
        return
    rows, actions = state.activations.shape[0], outputs.shape[0]
    for first in range(0, state.positions.shape[1], lanes_in_block()):
        for action in range(actions):
            put(
                state.activations,
                rows - actions + action,
                simd_block(first),
                get(outputs, action, simd_block(first)),
            )
    act_and_learn(everyone, model, state, step)
    for world in range(model.worlds):
        end_step_of_features(state.features, model, state, world, step)
    sense_environment(everyone, model, state, step + 1)


class SteeredBatch:
    """Several worlds of an experiment side by side, in which agents do as they are told, and learn nothing of their own."""

    def __init__(self, experiment: Experiment, seed: int, runs: Sequence[int]) -> None:
        """Raises RefusedError where agents act one after another, and where they are born in mid-life."""
        if experiment.births_in_life:
            raise RefusedError(
                "world.features lets agents be born in mid-life, and whoever is told what to do lives to its end"
            )
        if experiment.lifetime.update == "sequential":
            raise RefusedError(
                'lifetime.update = "sequential" lets agents act one after another, and these act together'
            )
        without = experiment.replace(learning={"rule": "none"}, evolution={"lamarckian_share": 0})
        self.experiment = without
        self._model, self._state = make_model(without, len(runs)), make_state(without, len(runs))
        self._state.keys[:] = [(seed, run) for run in runs]
        self._outputs = np.zeros(
            (self._state.targets.shape[0], self._state.weights.shape[1]), np.float32
        )
        arguments = self._model, self._state, True, 0, self._outputs
        live = cached_jit(simulate_steered, list_hooks(self._state), short_loops=True)
        live(*arguments)
        self._live = resolve_call(live, *arguments)
        self._shape = (len(runs), without.population.size)
        self._worth = np.array([region.energy for region in item_regions(without)] or [0.0])
        self.step = 0

    def begin(self, seed: int, generation: int) -> Numbers:
        """Let a generation be born; gives what it senses first, [world, agent, input]."""
        poison_state(self._state, math.prod(self._shape))
        self._state.keys[:, 0] = seed
        self._state.generation[0] = generation
        self.step = 0
        self._live(self._model, self._state, True, 0, self._outputs)
        return self._sensed()

    def act(self, outputs: Numbers) -> tuple[Numbers, npt.NDArray[np.float64]]:
        """A step in which these are the outputs, [world, agent, action]; what is sensed then, and energy eaten [world, agent]."""
        worlds, agents = self._shape
        self._outputs[:, : worlds * agents] = outputs.reshape(worlds * agents, -1).T
        before = self._state.eaten_in_life[:, : worlds * agents].copy()
        self._live(self._model, self._state, False, self.step, self._outputs)
        self.step += 1
        eaten = self._state.eaten_in_life[:, : worlds * agents] - before
        return self._sensed(), (self._worth @ eaten).reshape(worlds, agents)

    def _sensed(self) -> Numbers:
        worlds, agents = self._shape
        sensed: Numbers = (
            self._state.activations[: self._model.inputs, : worlds * agents]
            .T.reshape(worlds, agents, -1)
            .copy()
        )
        return sensed
