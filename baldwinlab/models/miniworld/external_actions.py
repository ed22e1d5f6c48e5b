"""Simulate agents with actions of an external program, for Gymnasium and PettingZoo."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from baldwinlab.core.errors import RefusedError
from baldwinlab.engine.jit import cached_jit, resolve_call
from baldwinlab.engine.reference import as_pointer
from baldwinlab.engine.simd import get, lanes_in_block, put, simd_block
from baldwinlab.experiment import Experiment
from baldwinlab.experiment.miniworld import count_worlds
from baldwinlab.experiment.species import require_single_species
from baldwinlab.models.miniworld.allocation import (
    iterate_arrays,
    list_hooks,
    make_model,
    make_state,
    poison_state,
)
from baldwinlab.models.miniworld.backends.cpu import PopulationView
from baldwinlab.models.miniworld.birth import init_generation
from baldwinlab.models.miniworld.regions import eaten_energies
from baldwinlab.models.miniworld.state import Floats, MiniWorldModel, State
from baldwinlab.models.miniworld.step import (
    act_and_learn,
    all_agents,
    end_step_of_features,
    sense_environment,
)

# float32 array [world, agent, input] or [world, agent, action].
Numbers = npt.NDArray[np.float32]


def simulate_steered(
    model: MiniWorldModel, state: State, is_start: bool, step: int, outputs: Floats
) -> None:
    """Take a step with the given `outputs` [action, lane], then set the inputs of the next step.

    If `is_start`, initialize the generation instead of taking a step.
    """
    model = as_pointer(model)
    state = as_pointer(state)
    agents = all_agents(model, state)
    if is_start:
        init_generation(model, state)
        sense_environment(agents, model, state, step)
        return
    actions = outputs.shape[0]
    first_output = state.activations.shape[0] - actions
    for first in range(0, state.positions.shape[1], lanes_in_block()):
        for action in range(actions):
            put(
                state.activations,
                first_output + action,
                simd_block(first),
                get(outputs, action, simd_block(first)),
            )
    act_and_learn(agents, model, state, step)
    for world in range(model.worlds):
        end_step_of_features(state.features, model, state, world, step)
    sense_environment(agents, model, state, step + 1)


def require_external_actions(experiment: Experiment) -> None:
    """Raise RefusedError if an external program cannot set the actions of an experiment."""
    require_single_species(experiment, "an environment with external actions")
    if experiment.births_in_life:
        raise RefusedError("external actions do not apply: world.features has births during life")
    if experiment.lifetime.update == "sequential":
        raise RefusedError(
            'external actions do not apply: lifetime.update = "sequential". Use "simultaneous"'
        )
    if count_worlds(experiment) > 1:
        raise RefusedError(
            "external actions do not apply: population.worlds and lifetime.repeats must be 1, "
            "because an environment is one world"
        )


class SteeredBatch:
    """A batch of worlds of one experiment. The agents take external actions and do not learn.

    A pickle contains the experiment and the arrays. The process that reads a pickle compiles the
    code, or loads the code from the cache.
    """

    def __init__(self, experiment: Experiment, seed: int, runs: Sequence[int]) -> None:
        """Compile the simulation. Raise the error of `require_external_actions`."""
        require_external_actions(experiment)
        without_learning = experiment.replace(
            learning={"rule": "none"}, evolution={"lamarckian_share": 0}
        )
        self.experiment = without_learning
        self._model = make_model(without_learning, len(runs))
        self._state = make_state(without_learning, len(runs))
        self._state.keys[:] = [(seed, run) for run in runs]
        self._outputs = np.zeros(
            (self._state.targets.shape[0], self._state.weights.shape[1]), np.float32
        )
        # The call compiles the code. `begin` initializes the generation again.
        arguments = self._model, self._state, True, 0, self._outputs
        simulate = cached_jit(simulate_steered, list_hooks(self._state), short_loops=True)
        simulate(*arguments)
        self._simulate = resolve_call(simulate, *arguments)
        self._shape = (len(runs), without_learning.population.size)
        self._item_energies = np.array(eaten_energies(without_learning) or [0.0])
        self.view = PopulationView(self._model, self._state, self._shape)
        self.step = 0

    def __reduce__(self) -> Any:
        runs = self._state.keys[:, 1].tolist()
        arrays = [array.copy() for array in iterate_arrays(self._state)]
        return _restore_batch, (self.experiment, runs, self.step, arrays)

    def begin(self, seed: int, generation: int) -> Numbers:
        """Initialize a generation, and return the first inputs [world, agent, input]."""
        poison_state(self._state, math.prod(self._shape))
        self._state.keys[:, 0] = seed
        self._state.generation[0] = generation
        self.step = 0
        self._simulate(self._model, self._state, True, 0, self._outputs)
        return self._inputs()

    def act(self, outputs: Numbers) -> tuple[Numbers, npt.NDArray[np.float64]]:
        """Take a step with the outputs [world, agent, action].

        Return the next inputs [world, agent, input], and the energy of the items eaten in the step
        [world, agent].
        """
        worlds, agents = self._shape
        self._outputs[:, : worlds * agents] = outputs.reshape(worlds * agents, -1).T
        eaten_before = self._state.eaten_in_life[:, : worlds * agents].copy()
        self._simulate(self._model, self._state, False, self.step, self._outputs)
        self.step += 1
        eaten = self._state.eaten_in_life[:, : worlds * agents] - eaten_before
        return self._inputs(), (self._item_energies @ eaten).reshape(worlds, agents)

    def _inputs(self) -> Numbers:
        """Return the current inputs [world, agent, input]."""
        worlds, agents = self._shape
        inputs: Numbers = (
            self._state.activations[: self._model.inputs, : worlds * agents]
            .T.reshape(worlds, agents, -1)
            .copy()
        )
        return inputs


def _restore_batch(
    experiment: Experiment, runs: Sequence[int], step: int, arrays: Sequence[npt.NDArray[Any]]
) -> SteeredBatch:
    """Return a batch with the given arrays, which include the seed and the generation."""
    batch = SteeredBatch(experiment, 0, runs)
    batch.step = step
    for array, values in zip(iterate_arrays(batch._state), arrays, strict=True):
        array[...] = values
    return batch
