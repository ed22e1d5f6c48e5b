"""The kind of part that selects the parents of each child, and the hooks of this kind."""

from __future__ import annotations

import ast
import math
from functools import cache
from typing import Any, ClassVar, NamedTuple

import numpy as np
import numpy.typing as npt

from baldwinlab.engine.jit import compiled
from baldwinlab.engine.phases import hook
from baldwinlab.engine.rng import Stream
from baldwinlab.parts.breeding import ITSELF, Numbers
from baldwinlab.parts.lane_check import find_definition
from baldwinlab.parts.lifetimes import Lifetimes
from baldwinlab.parts.part import Part
from baldwinlab.parts.variation import vary_population
from baldwinlab.parts.world_features import end_step


class Generation(NamedTuple):
    """A population at the end of a lifetime, and the selected parents of the next generation.

    Attributes
    ----------
    stream : Stream
        Key of further random numbers, which `draw(stream, number)` returns.
    lifetimes : Lifetimes
        Energy, cost of learning, eaten items, final position, records and genomes. Read only.
    fitness : array, float64 [agent]
        Fitness of each agent. Read only.
    uniforms : array, float64 [child, 2, 4]
        Random numbers in (0, 1). Read only.
    shares : array, float64 [agent]
        Scratch memory.
    order : array, int64 [agent]
        Scratch memory.
    parents : array, int32 [child, 2]
        Output: indices of the two parents of each child.
    """

    stream: Stream
    lifetimes: Lifetimes
    fitness: Numbers
    uniforms: Numbers
    shares: Numbers
    order: npt.NDArray[np.int64]
    parents: npt.NDArray[np.int32]


@hook
def select(part: Any, generation: Generation) -> None:
    """Select two parents for each child.

    Per population, between two generations.

    Parameters
    ----------
    part : NamedTuple
        Numeric settings and derived values of the part.
    generation : Generation
        Fitness, results of lifetimes, and random numbers. The hook fills `generation.parents`. Then
        the engine puts the fitter parent first. If the second parent of a child is `ITSELF`, the
        first parent survives unchanged.
    """


@hook
def mark_survivors(part: Any, generation: Generation, count: int) -> None:
    """Mark the agents that survive unchanged.

    Per population, after `select`, also if `count` is 0. By default the `count` fittest agents
    survive, with ties broken at random.

    Parameters
    ----------
    part : NamedTuple
        Numeric settings and derived values of the part.
    generation : Generation
        The generation with its parents. The hook sets the first `count` rows of
        `generation.parents` to (agent, `ITSELF`).
    count : int
        Number of survivors: the setting `evolution.elite`.
    """
    mark_fittest(count, generation.fitness, generation.uniforms[:, 1, 3], generation.parents)


@cache
def reads_lifetimes(selection: Any) -> bool:
    """Return whether the source of the hook `select` of a class reads results of lifetimes.

    The result is also True without a source, or if the hook passes its generation to a function.
    """
    definition = find_definition(selection.select)
    if definition is None:
        return True
    argument = definition.args.args[1].arg
    fields = [node for node in ast.walk(definition) if isinstance(node, ast.Attribute)]
    owners = [field.value for field in fields]
    passes_generation = any(
        isinstance(node, ast.Name) and node.id == argument and node not in owners
        for node in ast.walk(definition)
    )
    return passes_generation or any(field.attr == "lifetimes" for field in fields)


@compiled
def mark_fittest(count: int, fitness: Numbers, ties: Numbers, parents: Any) -> None:
    """Mark the fittest agents as survivors.

    - `fitness`: [agent].
    - `ties` [agent]: agents with the same fitness survive in ascending order of these numbers, then
      of the index of the agent.
    - `parents` [child, 2]: output: the function sets the first `count` rows to (agent, `ITSELF`).
    """
    # -1 is no agent: there is no previous survivor, or no candidate yet.
    previous = -1
    for survivor in range(count):
        best = -1
        for agent in range(fitness.size):
            is_candidate = previous < 0 or _comes_before(fitness, ties, previous, agent)
            if is_candidate and (best < 0 or _comes_before(fitness, ties, agent, best)):
                best = agent
        parents[survivor, 0] = best
        parents[survivor, 1] = ITSELF
        previous = best


@compiled
def _comes_before(fitness: Numbers, ties: Numbers, first: int, second: int) -> bool:
    if fitness[first] != fitness[second]:
        return bool(fitness[first] > fitness[second])
    if ties[first] != ties[second]:
        return bool(ties[first] < ties[second])
    return first < second


class Selection(Part):
    """Selection: the parents of each child, and the survivors.

    Attributes
    ----------
    minimum_fitness : float
        Lowest fitness that the selection accepts.
    has_groups : bool
        True if both parents of a child come from the group of the child, such as one half of the
        population.
    reads_only_genomes : bool
        True if `select` reads no results of lifetimes except `generation.lifetimes.genome`, and
        the part has no arrays of the run. The selection of stored generations can then be repeated
        without their lifetimes.
    """

    kind: ClassVar[str] = "selection"
    minimum_fitness: ClassVar[float] = -math.inf
    has_groups: ClassVar[bool] = False
    reads_only_genomes: ClassVar[bool] = False

    select: ClassVar[Any] = staticmethod(select.default)
    mark_survivors: ClassVar[Any] = staticmethod(mark_survivors.default)
    end_step: ClassVar[Any] = staticmethod(end_step.default)

    @classmethod
    def mixing_settings(cls, experiment: Any) -> list[str]:
        """Return the settings of an experiment that would mix the groups of the selection.

        Parameters
        ----------
        experiment : BaseExperiment
            Experiment with the selection.

        Returns
        -------
        list of str
            Settings, as a user writes them. Empty if the selection has no groups.
        """
        if not cls.has_groups:
            return []
        evolution = experiment.evolution
        variation = type(experiment.part("evolution.variation"))
        learning = getattr(experiment, "learning", None)
        default_survivors = cls.mark_survivors is mark_survivors.default
        # Whether each setting mixes the groups.
        mixes_groups = {
            f"evolution.elite = {evolution.elite}": evolution.elite > 0 and default_survivors,
            f"evolution.variation = {evolution.variation!r}": (
                variation.vary_population is not vary_population.default
            ),
            "learning.teacher = 'shuffled'": getattr(learning, "teacher", "") == "shuffled",
            "world.features with births in mid-life": experiment.births_in_life,
        }
        return [setting for setting, is_mixing in mixes_groups.items() if is_mixing]
