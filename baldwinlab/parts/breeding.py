"""Functions for parts that create generations, and the kinds fitness, inheritance and stop.

The kinds `selection` and `variation` have their own modules. The hooks of these parts run on the
CPU and read the entire population. Numbers are float64 unless stated otherwise. Genomes are float32
[agent, module, weight]. The caller passes random numbers as arrays. `vary_population` draws random
numbers with `brood.key`, and a selection can draw further random numbers from `generation.stream`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, ClassVar, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from baldwinlab.core.object_cache import cache_per_object
from baldwinlab.engine.jit import compiled
from baldwinlab.engine.phases import hook
from baldwinlab.parts.lifetimes import Lifetimes
from baldwinlab.parts.part import Part, compiled_values
from baldwinlab.parts.world_features import end_step

Numbers = npt.NDArray[np.float64]
RunArrays = dict[str, npt.NDArray[Any]]
"""Arrays of a run by name FIELD.PART.ARRAY, for example "stop.stagnation.largest"."""
# Value of the second parent that marks a survivor: the child is the unchanged first parent.
ITSELF: Final = -2


@compiled
def copy_genome(genome: Any, into: Any) -> None:
    """Copy a genome [module, weight]."""
    for module in range(genome.shape[0]):
        for weight in range(genome.shape[1]):
            into[module, weight] = genome[module, weight]


def breeding_part(
    experiment: Any, field: str, run_arrays: RunArrays | None = None
) -> tuple[Any, tuple[Callable[..., Any], ...]]:
    """Return the values and the compiled functions of a part that creates generations.

    - `field`: field of the table `evolution` that names the part, such as "selection".
    - `run_arrays`: arrays of the run. The function adds missing arrays of the part to this dict.
      Without a dict, the part has new arrays.

    Returns (values, code). `values` is the first argument of the hooks, with arrays of the run and
    None for other arrays. `code` has the type of `values` and all hooks, for `cached_jit`.
    """
    values, code = _compile_part(experiment, field)
    if not has_run_arrays(type(values).part):
        return values, code
    part = experiment.part(f"evolution.{field}")
    declared = {name: array for name, array in part.arrays.items() if array.owner == "run"}
    stored = {} if run_arrays is None else run_arrays
    arrays = {}
    for name, array in declared.items():
        key = f"{field}.{part.name}.{name}"
        if key not in stored:
            shape = [getattr(part, row) if isinstance(row, str) else row for row in array.rows]
            stored[key] = np.full(shape, array.fill, array.dtype)
        arrays[name] = stored[key]
    return values._replace(**arrays), code


class PartCall(NamedTuple):
    """How to call the hooks of a part that creates generations, for some runs of a batch."""

    values: Any  # The first argument of the hooks.
    code: tuple[Callable[..., Any], ...]
    runs: range


def list_part_calls(
    experiment: Any, field: str, n_runs: int, run_arrays: Sequence[RunArrays] | None = None
) -> list[PartCall]:
    """Return how to call a part for `n_runs` runs: one call, or one per run with its arrays.

    `run_arrays` [run]: see `breeding_part`.
    """
    if not has_run_arrays(experiment.part(f"evolution.{field}")):
        return [PartCall(*_compile_part(experiment, field), range(n_runs))]
    return [
        PartCall(
            *breeding_part(experiment, field, None if run_arrays is None else run_arrays[run]),
            range(run, run + 1),
        )
        for run in range(n_runs)
    ]


@cache_per_object
def _compile_part(experiment: Any, field: str) -> tuple[Any, tuple[Callable[..., Any], ...]]:
    part = experiment.part(f"evolution.{field}")
    values = compiled_values(part, experiment, lambda array: None)
    return values, (part.Compiled, *type(part).hooks())


def has_run_arrays(part: Any) -> bool:
    """Return whether a part has arrays of the run, whose owner is "run"."""
    return any(array.owner == "run" for array in part.arrays.values())


def uses_run_arrays(experiment: Any) -> bool:
    """Return whether a part of the evolution of an experiment has arrays of the run."""
    fields = ("selection", "variation", "inheritance", "fitness", "stop")
    return any(has_run_arrays(experiment.part(f"evolution.{field}")) for field in fields)


@hook
def evaluate(part: Any, lifetimes: Lifetimes, fitness: Numbers) -> None:
    """Compute the fitness of all agents.

    Per population, at the end of a lifetime.

    Parameters
    ----------
    part : NamedTuple
        Numeric settings and derived values of the part.
    lifetimes : Lifetimes
        Energy, cost of learning, eaten items, final position, records and genomes. Read only.
    fitness : array, float64 [agent]
        Output: fitness of each agent.
    """


class Fitness(Part):
    """Fitness of an agent, from the results of its lifetime."""

    kind: ClassVar[str] = "fitness"

    evaluate: ClassVar[Any] = staticmethod(evaluate.default)
    end_step: ClassVar[Any] = staticmethod(end_step.default)


@hook
def inherit(part: Any, innate_genome: Any, learned: Any, inherited_genome: Any) -> None:
    """Compute the genome that the children of an agent inherit.

    Per agent, between two generations. The simulation calls it if `wants_learned` returns True.

    Parameters
    ----------
    part : NamedTuple
        Numeric settings and derived values of the part.
    innate_genome : array, float32 [module, weight]
        Genome of the agent at birth, with all modules and genes. Read only. Module 0 is the action
        module. `innate_genome[0, part.NAME]` is the gene NAME of the part.
    learned : array, float32 [weight]
        Action module of the agent at death, without genes. Read only.
    inherited_genome : array, float32 [module, weight]
        Output: the inherited genome, which is a copy of `innate_genome` except for the weights of
        the action module. The hook must write these weights, and may change other entries.
    """


@hook
def assign_teachers(part: Any, innate: Any, learned: Any, taught: Any) -> None:
    """Change the reinforcement module that the children of an agent inherit.

    Per agent, between two generations. The simulation calls it if `wants_learned` returns True and
    the genome has a reinforcement module.

    Parameters
    ----------
    part : NamedTuple
        Numeric settings and derived values of the part.
    innate : array, float32 [weight]
        Action module of the agent at birth. Read only.
    learned : array, float32 [weight]
        Action module of the agent at death. Read only.
    taught : array, float32 [weight]
        Input and output: the reinforcement module of the agent.
    """


class Inheritance(Part):
    """Inheritance, which computes the genomes of children from innate and learned weights.

    Attributes
    ----------
    resamples_genomes : bool
        True if children inherit nothing. The genomes of every generation are then random.
    """

    kind: ClassVar[str] = "inheritance"
    resamples_genomes: ClassVar[bool] = False

    def wants_learned(self, experiment: Any) -> bool:
        """Return whether `inherit` and `assign_teachers` use the weights at death.

        If the result is False, the simulation does not collect the weights at death.

        Parameters
        ----------
        experiment : BaseExperiment
            Experiment with the inheritance.

        Returns
        -------
        bool
            The default method returns True.
        """
        return True

    inherit: ClassVar[Any] = staticmethod(inherit.default)
    assign_teachers: ClassVar[Any] = staticmethod(assign_teachers.default)


@hook
def should_stop(part: Any, lifetimes: Lifetimes, fitness: Numbers, generation: int) -> bool:
    """Return whether a run stops after this generation.

    Per population, after the fitness of a generation has been computed.

    Parameters
    ----------
    part : NamedTuple
        Numeric settings and derived values of the part.
    lifetimes : Lifetimes
        Results of the lifetimes. Read only.
    fitness : array, float64 [agent]
        Fitness of each agent. Read only.
    generation : int
        Number of the generation, from 0.

    Returns
    -------
    bool
        True if this generation is the last one of the run.
    """
    return False


class Stop(Part):
    """Stop: the condition under which a run ends before `evolution.generations`."""

    kind: ClassVar[str] = "stop"

    should_stop: ClassVar[Any] = staticmethod(should_stop.default)
