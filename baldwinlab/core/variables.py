"""Schema of the recorded variables: dimensions, type, unit and meaning."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple, Self

import numpy as np

from baldwinlab.core.deferred import xr

PARENT_NAMES = ("fitter", "other")
PER_AGENT_DIMS = ("generation", "agent")
"""Dimensions of a variable with one value per agent and generation."""

# Meanings of the coordinates of a dataset.
DIMENSION_MEANINGS: Mapping[str, str] = {
    "condition": "name of the condition",
    "run": "number of the run",
    "generation": "number of the generation, from 0",
    "agent": "number of the agent in its generation",
    "parent": "first or second parent",
    "window": "first step of the window",
}


class Variable(NamedTuple):
    """A recorded variable.

    Attributes
    ----------
    dims : tuple of str
        Dimensions, for example `PER_AGENT_DIMS`.
    dtype : type
        NumPy type of the values.
    unit : str
        Unit, "1" for a number without unit.
    meaning : str
        Meaning, a noun phrase.
    """

    dims: tuple[str, ...]
    dtype: type[np.generic]
    unit: str
    meaning: str

    @classmethod
    def share(cls, meaning: str) -> Self:
        """Declare a fraction of each agent, from 0 to 1, as float32.

        Parameters
        ----------
        meaning : str
            Meaning, a noun phrase.
        """
        return cls.quantity("1", meaning)

    @classmethod
    def flag(cls, meaning: str) -> Self:
        """Declare a property of each agent as int32: 1 or 0. The mean over agents is a fraction.

        Parameters
        ----------
        meaning : str
            Meaning, a noun phrase.
        """
        return cls.integer("1", meaning)

    @classmethod
    def integer(cls, unit: str, meaning: str) -> Self:
        """Declare an integer of each agent, as int32.

        Parameters
        ----------
        unit : str
            Unit of the values.
        meaning : str
            Meaning, a noun phrase.
        """
        return cls(PER_AGENT_DIMS, np.int32, unit, meaning)

    @classmethod
    def quantity(cls, unit: str, meaning: str) -> Self:
        """Declare a real number of each agent, as float32.

        Parameters
        ----------
        unit : str
            Unit of the values.
        meaning : str
            Meaning, a noun phrase.
        """
        return cls(PER_AGENT_DIMS, np.float32, unit, meaning)


RUN_VARIABLES: Mapping[str, Variable] = {
    "food_eaten": Variable.integer("items", "items eaten in life"),
    "energy": Variable(
        ("generation", "agent"),
        np.float64,
        "energy",
        "fitness: energy of the items eaten in life minus the cost of learning",
    ),
    "parents": Variable(
        ("generation", "agent", "parent"),
        np.int32,
        "1",
        "agents of the previous generation; -1 without parents",
    ),
    "genome": Variable(
        ("generation", "agent", "module", "weight"),
        np.float32,
        "1",
        "weights at birth; NaN in generations that are not stored",
    ),
}

# Variables of a record, which stores only the genomes of some generations. The variable with the
# fitness of an agent is called `energy`.
RECORD_VARIABLES: Mapping[str, Variable] = {
    name: variable for name, variable in RUN_VARIABLES.items() if name != "genome"
} | {
    "kept_genome": RUN_VARIABLES["genome"]._replace(
        dims=("kept_generation", "agent", "module", "weight")
    )
}

SPECIES_VARIABLE = Variable.integer(
    "1", "index of the species of the agent, in the order of the settings"
)

# Prefix of the variables with the run arrays of parts. An extension of the run reads these arrays.
RUN_ARRAY_PREFIX = "run_array."
# Variables in the records of every model.
COMMON_RECORD_VARIABLES = ("energy", "parents", "kept_genome")

# Variables in the records of experiments whose agents can die during a lifetime.
DEATH_VARIABLES: Mapping[str, Variable] = {
    "alive": Variable.flag("1 if the agent was alive at the end of the lifetime, else 0"),
    "age": Variable.integer("steps", "steps from birth to death or to the end of the lifetime"),
}

_SERIES_DIMS = ("generation", "window")
TIME_SERIES_VARIABLES: Mapping[str, Variable] = {
    "agents_alive": Variable(
        _SERIES_DIMS, np.float64, "agents", "number of agents alive at the end of the window"
    ),
    "births": Variable(
        _SERIES_DIMS, np.float64, "agents", "number of births during life in the window"
    ),
    "energy_gained": Variable(
        _SERIES_DIMS, np.float64, "energy", "energy of the items that all agents ate in the window"
    ),
}
"""Variables of `record.every`: sums over the agents of a run, means over repeated lifetimes."""


def window_coordinates(experiment: Any) -> dict[str, Any]:
    """Return the coordinate `window` of `record.every`, or {} if this setting is not set."""
    interval = getattr(experiment.record, "every", None)
    if interval is None:
        return {}
    return {"window": np.arange(0, experiment.steps, interval, dtype=np.int32)}


def record_variables(experiment: Any) -> Mapping[str, Variable]:
    """Return the variables of the records of an experiment by name.

    The result includes the variables of the model, the number of eaten items of each kind, and the
    genes of parts. An experiment with species has the variables of all species.
    """
    if members := experiment.species_experiments():
        combined = {"species": SPECIES_VARIABLE}
        for member in members:
            combined |= record_variables(member)
        if len({_fitness_variable(member) for member in members}) > 1:
            combined["energy"] = combined["energy"]._replace(unit="1", meaning="fitness")
        if experiment.has_deaths:
            combined |= DEATH_VARIABLES
        return combined
    return dict(_model_variables(experiment)) | _gene_variables(experiment)


def _gene_variables(experiment: Any) -> dict[str, Variable]:
    """Return a variable for each gene of a part."""
    return {
        gene_variable(name): Variable(
            PER_AGENT_DIMS, np.float32, gene.unit, gene.help or f"gene {name} at birth"
        )
        for name, gene in experiment.genes.items()
    }


def gene_variable(name: str) -> str:
    """Return the name of the variable with the values of a gene of a part."""
    return f"gene_{name}"


def eaten_variable(kind: str) -> str:
    """Return the name of the variable with the number of eaten items of a kind or species."""
    return f"{kind}_eaten"


def _model_variables(experiment: Any) -> Mapping[str, Variable]:
    """Return the variables of an experiment without the variables of genes."""
    fitness = _fitness_variable(experiment)
    if experiment.model != "miniworld":
        return (
            {name: RECORD_VARIABLES[name] for name in RECORD_VARIABLES if name != "food_eaten"}
            | {"energy": fitness}
            | dict(experiment.model_part.records)
        )
    item_kinds = {
        item.kind for feature in experiment.parts("world.features") for item in feature.items()
    }
    food_eaten = RECORD_VARIABLES["food_eaten"]
    added_variables = {
        eaten_variable(kind): food_eaten._replace(meaning=f"items of {kind} eaten in life")
        for kind in item_kinds
    }
    added_variables |= {
        name: Variable(
            PER_AGENT_DIMS, np.dtype(array.dtype).type, array.unit, array.help or f"record {name}"
        )
        for name, array in experiment.part_records.items()
    }
    if experiment.births_in_life:
        added_variables["born"] = Variable.integer(
            "agents", "number of births in the place of the agent during life"
        )
    if experiment.has_deaths:
        added_variables |= DEATH_VARIABLES
    added_variables |= {
        eaten_variable(prey.species): food_eaten._replace(meaning=f"agents of {prey.species} eaten")
        for prey in experiment.eats.prey
    }
    if experiment.lifetime.repeats > 1:
        added_variables = {
            name: variable._replace(
                dtype=np.float64, meaning=f"{variable.meaning}, mean over the lifetimes"
            )
            for name, variable in ({"food_eaten": food_eaten} | added_variables).items()
        }
    if experiment.record.every is not None:
        added_variables |= TIME_SERIES_VARIABLES
    return dict(RECORD_VARIABLES) | {"energy": fitness} | added_variables


def _fitness_variable(experiment: Any) -> Variable:
    """Return the variable `energy` with the meaning of the fitness in use."""
    fitness = RECORD_VARIABLES["energy"]
    names = dict.fromkeys(segment.evolution.fitness for _, segment in experiment.segments())
    if list(names) != ["energy"]:
        # A part does not declare the unit of its fitness.
        return fitness._replace(unit="1", meaning=f"fitness {', then '.join(map(repr, names))}")
    if experiment.model != "miniworld":
        return fitness._replace(unit="1", meaning=experiment.model_part.payoff)
    return fitness


_PER_STEP = ("step", "agent")
_ITEM_POSITION = Variable(
    ("step", "item"), np.float32, "units of length", "position at the beginning of the step"
)
_WEIGHTS = Variable(("agent", "module", "weight"), np.float32, "1", "weights at birth")
TRACE_VARIABLES: Mapping[str, Variable] = {
    "x": Variable(_PER_STEP, np.float32, "units of length", "x position when the agent senses"),
    "y": Variable(
        _PER_STEP, np.float32, "units of length", "y position when the agent senses, downward"
    ),
    "heading": Variable(
        _PER_STEP,
        np.float32,
        "degrees",
        "heading when the agent senses, clockwise from +x, in [0, 360)",
    ),
    "item_x": _ITEM_POSITION,
    "item_y": _ITEM_POSITION,
    "sensor": Variable(
        ("step", "agent", "side"), np.int8, "1", "inputs; for food, 1 if an item is in the sector"
    ),
    "output": Variable(
        ("step", "agent", "action"),
        np.float32,
        "1",
        "outputs of the action module, before learning",
    ),
    "action": Variable(_PER_STEP, np.int8, "1", "0 left, 1 forward, 2 right"),
    "eaten": Variable(_PER_STEP, np.int32, "items", "items eaten in this step"),
    "weight_birth": _WEIGHTS,
    "weight_death": _WEIGHTS._replace(meaning="weights after the last step"),
}

ALIVE_IN_STEP = Variable(
    _PER_STEP,
    np.int8,
    "1",
    "1 if the agent is alive at the beginning of the step, else 0, and x and y are NaN",
)
"""Variable `alive` in the traces of experiments whose agents can die during a lifetime."""
SPECIES_IN_TRACE = SPECIES_VARIABLE._replace(dims=("agent",))
"""Variable `species` in the traces of experiments with species."""


def trace_variables(experiment: Any) -> Mapping[str, Variable]:
    """Return the variables of a trace by name: `TRACE_VARIABLES`, with these changes.

    The inputs are float32 if an input is real-valued, or if there are several species. Traces with
    deaths have `alive`, and traces with species have `species` and the numbers of eaten agents.
    """
    declared = dict(TRACE_VARIABLES)
    sensor = declared["sensor"]
    members = experiment.species_experiments()
    if members:
        declared["sensor"] = sensor._replace(
            dtype=np.float32, meaning="inputs; NaN for inputs of other species"
        )
        declared["species"] = SPECIES_IN_TRACE
    elif experiment.real_valued:
        declared["sensor"] = sensor._replace(dtype=np.float32, meaning="inputs")
    if experiment.has_deaths:
        declared["alive"] = ALIVE_IN_STEP
    eaten = declared["eaten"]
    for member in members:
        for prey in member.eats.prey:
            declared["eaten"] = eaten._replace(
                unit="items and agents", meaning="items and agents eaten in this step"
            )
            declared[eaten_variable(prey.species)] = eaten._replace(
                unit="agents", meaning=f"agents of {prey.species} eaten in this step"
            )
    return declared


WEIGHT_ORDER = (
    "layer by layer, from the inputs; within a layer, by source unit, then by"
    " target unit; with biases, the biases of a layer follow its weights; "
    "with an evolved learning rate, the last entry of the action module is "
    "its gene, log10 of the rate divided by learning.rate"
)

# Attribute of a run that ended early: the name of the stop part that ended the run.
STOP_ATTRIBUTE = "stopped_by"
# Coordinate [condition, run] of studies with a stop part: number of simulated generations.
GENERATION_COUNT = "n_generations"
GENERATION_COUNT_ATTRIBUTES = {
    "units": "generations",
    "long_name": "number of simulated generations of the run",
}


def describe_weight_order(experiment: Any) -> str:
    """Return a text that describes the order of the entries of a module of a genome."""
    if not experiment.gene_names:
        return WEIGHT_ORDER
    names = ", ".join(experiment.gene_names)
    return f"{WEIGHT_ORDER}; the last entries of the first module are the genes of parts: {names}"


def make_dataset(
    variables: Mapping[str, Variable], arrays: Mapping[str, Any], attributes: Mapping[str, Any]
) -> xr.Dataset:
    """Return a dataset of arrays with the declared dimensions, types, units and meanings.

    Raises `KeyError` if a name is not declared.
    """
    data = {}
    for name, array in arrays.items():
        dims, dtype, unit, meaning = variables[name]
        data[name] = (dims, np.asarray(array, dtype), {"units": unit, "long_name": meaning})
    return xr.Dataset(data, attrs=dict(attributes))
