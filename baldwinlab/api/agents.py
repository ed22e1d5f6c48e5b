"""Read the genomes of stored agents as labeled arrays, and evaluate the networks of agents."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from baldwinlab.core.deferred import xr
from baldwinlab.core.errors import RefusedError
from baldwinlab.core.names import list_names
from baldwinlab.core.numbers import require_whole_number
from baldwinlab.core.variables import RUN_VARIABLES, TRACE_VARIABLES
from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.models.miniworld.species import make_species_batch
from baldwinlab.parts.networks import forward
from baldwinlab.simulation.reevaluation import make_batch, restore_genomes
from baldwinlab.simulation.replay import require_generation
from baldwinlab.studies.records import StudyError
from baldwinlab.studies.store import StudyStore

NETWORK_MODULES: Final = ("action", "reinforcement")
"""Names of the modules of a genome that are networks."""


class AgentNetwork:
    """The network of one agent at birth, before any learning. A call with inputs returns outputs.

    Attributes
    ----------
    inputs, outputs : tuple of str
        Names of the inputs and of the outputs. Each output is named after an action.
    weights : xarray.DataArray
        The weights [weight] at birth, layer by layer.
    """

    def __init__(self, experiment: Experiment, part: Any, weights: npt.NDArray[np.float32]) -> None:
        """Make a network."""
        self.inputs = experiment.inputs
        self.outputs = experiment.actions
        self.weights = xr.DataArray(weights, dims="weight")
        self._part = part
        self._n_units = sum(experiment.layer_sizes)

    def __call__(self, inputs: npt.ArrayLike) -> xr.DataArray:
        """Evaluate the network with the arithmetic of the engine.

        Parameters
        ----------
        inputs : array_like
            Array [input] or [step, input] of numbers from 0 to 1. A recurrent network starts each
            call without memory, like a newborn, and remembers the previous steps of the call.

        Returns
        -------
        xarray.DataArray
            The outputs: [action], or [step, action] if `inputs` has steps.

        Raises
        ------
        RefusedError
            The inputs have another shape, or a number below 0 or above 1.
        """
        array = self._check_inputs(inputs)
        inputs_by_step = np.atleast_2d(array)
        # The engine uses arrays [weight, lane] and [unit, lane]. A lane is the column of one agent.
        weights = self.weights.values[:, None]
        activations = np.zeros((self._n_units, 1), np.float32)
        outputs = np.empty((len(inputs_by_step), len(self.outputs)), np.float32)
        lane = 0
        for step, values in enumerate(inputs_by_step):
            activations[: len(self.inputs), lane] = values
            # `forward` reads and writes `activations`. They keep the previous step of this call.
            forward(self._part, weights, activations, lane)
            outputs[step] = activations[-len(self.outputs) :, lane]
        variable = TRACE_VARIABLES["output"]
        attributes = {"units": variable.unit, "long_name": "outputs of the network"}
        result = xr.DataArray(
            outputs, {"action": list(self.outputs)}, ("step", "action"), attrs=attributes
        )
        has_steps = array.ndim == 2
        return result if has_steps else result[0]

    def _check_inputs(self, inputs: npt.ArrayLike) -> npt.NDArray[np.float32]:
        """Return the inputs as an array. Raise RefusedError for a wrong shape or value."""
        n_inputs = len(self.inputs)
        try:
            array = np.asarray(inputs, np.float32)
        except (TypeError, ValueError):
            raise RefusedError(
                f"inputs must be {n_inputs} numbers, or an array [step, input]"
            ) from None
        if array.ndim not in (1, 2) or array.shape[-1] != n_inputs:
            names = ", ".join(self.inputs)
            raise RefusedError(
                f"inputs have the shape {array.shape}; it must be [{n_inputs}] or "
                f"[step, {n_inputs}]: {names}"
            )
        # A comparison with NaN is false, so NaN is refused.
        if not ((array >= 0) & (array <= 1)).all():
            raise RefusedError("inputs must be numbers from 0 to 1, like those of senses")
        return array

    def __repr__(self) -> str:
        """Return the names of inputs and outputs, and the number of weights."""
        inputs = ", ".join(self.inputs)
        outputs = ", ".join(self.outputs)
        return f"<AgentNetwork: {inputs} -> {outputs}, {self.weights.size} weights>"


def read_genomes(
    study: StudyStore, condition: str, run: int, generation: int, agent: int | Sequence[int] | None
) -> xr.DataArray:
    """Return genomes, for `Study.genomes`. `agent`: an index, several indices, or None for all."""
    experiment = study.experiment(condition)
    require_generation(experiment, generation)
    for agent_index in _list_agents(agent):
        require_whole_number("agent", agent_index, experiment.population.size - 1)
    array = _read_genome_array(study, condition, run, generation)
    variable = RUN_VARIABLES["genome"]
    genomes = xr.DataArray(
        array,
        {"agent": np.arange(len(array)), "module": list(experiment.modules)},
        ("agent", "module", "weight"),
        attrs={"units": variable.unit, "long_name": "weights at birth"},
    )
    genomes = genomes.assign_coords(condition=condition, run=run, generation=generation)
    return genomes if agent is None else genomes.sel(agent=agent)


def _list_agents(agent: int | Sequence[int] | None) -> Sequence[int]:
    """Return the given indices as a sequence. It is empty for None, which needs no check."""
    if agent is None:
        return []
    return agent if isinstance(agent, Sequence | np.ndarray) else [agent]


def make_network(
    study: StudyStore, condition: str, run: int, generation: int, agent: int, *, module: str
) -> AgentNetwork:
    """Return a network of one agent at birth, for `baldwinlab.api.study.Study.network`."""
    experiment = _require_forager(study.experiment(condition))
    require_generation(experiment, generation)
    require_whole_number("agent", agent, experiment.population.size - 1)
    experiment = experiment.at(generation)
    _require_network(experiment, condition, module)
    study.require_parts(condition)
    genomes = _read_genome_array(study, condition, run, generation)
    lane = agent
    if experiment.population.species:
        species = study.record(condition, run)["species"].values[generation]
        index = int(species[agent])
        name_of_species = experiment.population.species[index].name
        batch = make_species_batch(experiment, study.seed, run, generation, genomes, species)
        experiment = batch.members[index]
        _require_network(experiment, name_of_species, module)
        newborns = batch.states[index]
        # The agents of a species are contiguous. In the batch of the species, the first has lane 0.
        lane -= int(np.argmax(species == index))
    else:
        # The first lanes are the agents in the first lifetime, in the order of their indices.
        newborns = make_batch(experiment, study.seed, [run], generation, genomes[None]).state
    # `genes` [weight, lane] starts with the weights of the reinforcement network.
    weights_by_agent = newborns.weights if module == "action" else newborns.genes
    weights = weights_by_agent[: experiment.weight_count, lane].copy()
    return AgentNetwork(experiment, newborns.network, weights)


def _require_network(experiment: Experiment, name: str, module: str) -> None:
    """Raise RefusedError if the agents of a condition or of a species do not have a network."""
    networks = [network for network in experiment.modules if network in NETWORK_MODULES]
    if module not in networks:
        names = list_names(module, networks)
        raise RefusedError(f"module = {module!r} is not a network of {name}; {names}")


def _read_genome_array(
    study: StudyStore, condition: str, run: int, generation: int
) -> npt.NDArray[np.float32]:
    """Return the genomes [agent, module, weight] of a generation, from a file or computed."""
    record = study.record(condition, run)
    is_computed = generation not in record["kept_generation"].values
    if is_computed:
        study.require_parts(condition)
    return restore_genomes(study.experiment(condition), record, generation)


def _require_forager(experiment: BaseExperiment) -> Experiment:
    if not isinstance(experiment, Experiment):
        raise RefusedError(
            f"{experiment.name} has the model {experiment.model!r}; only agents of the model "
            "'miniworld' have a network that can be evaluated"
        )
    return experiment


def select_condition(study: StudyStore, condition: str | None) -> str:
    """Return `condition`, or the only condition of the study if it is None."""
    names = list(study.experiments)
    if condition is None and len(names) > 1:
        raise StudyError(f"{study.location}: condition is missing; {list_names(names[0], names)}")
    return names[0] if condition is None else condition
