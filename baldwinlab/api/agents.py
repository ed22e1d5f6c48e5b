"""Stored agents: their genomes as labelled arrays, and their networks, evaluated on any inputs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from baldwinlab.core.errors import ArgumentError, RefusedError
from baldwinlab.core.suggestions import list_names
from baldwinlab.core.variables import RUN, TRACE
from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.parts.agent_parts import forward
from baldwinlab.simulation.reevaluation import born, stored_genome
from baldwinlab.studies.records import StudyError
from baldwinlab.studies.store import StudyStore

NETWORKS = ("action", "reinforcement")  # the modules of a genome that are networks


class AgentNetwork:
    """The network of one agent at birth, before it learned. Call it with inputs to get its outputs.

    Attributes
    ----------
    inputs, outputs
        The names of the inputs and of the outputs, which are the actions of the agent.
    weights
        The weights, one layer after the other.
    """

    def __init__(self, experiment: Experiment, part: Any, weights: npt.NDArray[np.float32]) -> None:
        """Make a network of compiled values of its kind (`part`) and its weights."""
        self.inputs, self.outputs = experiment.inputs, experiment.actions
        self.weights = xr.DataArray(weights, dims="weight")
        self._part, self._units = part, sum(experiment.layer_sizes)

    def __call__(self, inputs: npt.ArrayLike) -> xr.DataArray:
        """Evaluate the network with the arithmetic of the engine.

        Parameters
        ----------
        inputs
            Numbers from 0 to 1: one for each input, or an array [step, input]. A recurrent network starts each call
            without memory, as a newborn does, and remembers from step to step.

        Returns
        -------
        xarray.DataArray
            The outputs, with the dimension `action`, and `step` if `inputs` has it.

        Raises
        ------
        RefusedError
            For another shape, or a number outside of 0 to 1.
        """
        given = self._checked(inputs)
        steps = np.atleast_2d(given)
        weights = self.weights.values[:, None]
        activations = np.zeros((self._units, 1), np.float32)
        outputs = np.empty((len(steps), len(self.outputs)), np.float32)
        for step, values in enumerate(steps):
            activations[: len(self.inputs), 0] = values
            forward(self._part, weights, activations, 0)
            outputs[step] = activations[-len(self.outputs) :, 0]
        variable = TRACE["output"]
        attributes = {"units": variable.unit, "long_name": "outputs of the network"}
        found = xr.DataArray(
            outputs, {"action": list(self.outputs)}, ("step", "action"), attrs=attributes
        )
        return found[0] if given.ndim == 1 else found

    def _checked(self, inputs: npt.ArrayLike) -> npt.NDArray[np.float32]:
        count = len(self.inputs)
        try:
            given = np.asarray(inputs, np.float32)
        except (TypeError, ValueError):
            raise RefusedError(
                f"inputs must be {count} numbers, or an array [step, input]"
            ) from None
        if given.ndim not in (1, 2) or given.shape[-1] != count:
            names = ", ".join(self.inputs)
            raise RefusedError(
                f"inputs of shape {given.shape} must be [{count}] or [step, {count}]: {names}"
            )
        if not ((given >= 0) & (given <= 1)).all():
            raise RefusedError("inputs must be numbers from 0 to 1, as those of senses are")
        return given

    def __repr__(self) -> str:
        return f"<AgentNetwork: {', '.join(self.inputs)} -> {', '.join(self.outputs)}, {self.weights.size} weights>"


def read_genomes(
    study: StudyStore, condition: str, run: int, generation: int, agent: int | Sequence[int] | None
) -> xr.DataArray:
    """Return the genomes of a generation, as `baldwinlab.api.study.Study.genomes` does."""
    experiment = study.experiment(condition)
    _require_index("generation", generation, experiment.evolution.generations)
    for each in (
        agent if isinstance(agent, Sequence | np.ndarray) else [0 if agent is None else agent]
    ):
        _require_index("agent", each, experiment.population.size)
    genome = _genome(study, condition, run, generation)
    variable = RUN["genome"]
    found = xr.DataArray(
        genome,
        {"agent": np.arange(len(genome)), "module": list(experiment.modules)},
        ("agent", "module", "weight"),
        attrs={"units": variable.unit, "long_name": "weights at birth"},
    )
    found = found.assign_coords(condition=condition, run=run, generation=generation)
    return found if agent is None else found.sel(agent=agent)


def make_network(
    study: StudyStore, condition: str, run: int, generation: int, agent: int, module: str
) -> AgentNetwork:
    """Return the network of an agent, as `baldwinlab.api.study.Study.network` does."""
    experiment = _foragers(study.experiment(condition))
    _require_index("generation", generation, experiment.evolution.generations)
    _require_index("agent", agent, experiment.population.size)
    networks = [name for name in experiment.modules if name in NETWORKS]
    if module not in networks:
        names = list_names(module, networks)
        raise RefusedError(f"module = {module!r} is no network of {condition}; {names}")
    study.require_parts(condition)
    genome = _genome(study, condition, run, generation)
    newborns = born(experiment, study.seed, [run], generation, genome[None]).state
    source = newborns.weights if module == "action" else newborns.genes
    weights = source[: experiment.weight_count, agent].copy()
    return AgentNetwork(experiment, newborns.network, weights)


def _genome(
    study: StudyStore, condition: str, run: int, generation: int
) -> npt.NDArray[np.float32]:
    """Return the genomes [agent, module, weight] of a generation: as stored, or bred again of the stored ones before."""
    record = study.record(condition, run)
    if generation not in record["kept_generation"].values:
        study.require_parts(condition)
    return stored_genome(study.experiment(condition), record, generation)


def _foragers(experiment: BaseExperiment) -> Experiment:
    if not isinstance(experiment, Experiment):
        raise RefusedError(
            f"{experiment.name} is of the model {experiment.model!r}; only agents of the model 'miniworld' have a "
            "network that can be evaluated"
        )
    return experiment


def _require_index(name: str, value: int, count: int) -> None:
    value = int(value) if isinstance(value, np.integer) else value
    if not isinstance(value, int) or isinstance(value, bool) or not 0 <= value < count:
        raise ArgumentError(name, value, f"must be a whole number from 0 to {count - 1}")


def only_condition(study: StudyStore, condition: str | None) -> str:
    """Return a condition, or the only one of a study where none is given. Raises StudyError where there are several."""
    names = list(study.experiments)
    if condition is None and len(names) > 1:
        raise StudyError(f"{study.directory}: condition is missing; {list_names(names[0], names)}")
    return names[0] if condition is None else condition
