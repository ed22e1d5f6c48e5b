"""Selection of the parents of each child by a selection scheme.

A scheme fills `Generation.parents`. In `roulette`, the scheme of Le 2019, parents are drawn
independently and with replacement. `sort_by` is a heapsort of agents for schemes: compiled code,
without allocation and with a defined order of ties.

References
----------
Le 2019, section "Simulation 1: Evolution alone (EVO)". docs/explanation/model.md lists the other
interpretations of this section (R4).

.. [1] J. W. J. Williams, "Algorithm 232: Heapsort", Communications of the ACM 7 (1964): `sort_by`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from baldwinlab.engine import poison
from baldwinlab.engine.elements import for_element
from baldwinlab.engine.jit import cached_jit, compiled, jit_entry_point
from baldwinlab.engine.rng import SELECTION_STREAM, Stream
from baldwinlab.evolution.rng_key import Fitness, Parents, RunKeys, Uniforms, split_runs
from baldwinlab.experiment import BaseExperiment
from baldwinlab.parts.breeding import ITSELF, PartCall, RunArrays, list_part_calls
from baldwinlab.parts.lifetimes import Lifetimes, make_lifetimes
from baldwinlab.parts.selection import Generation, mark_survivors
from baldwinlab.parts.selection import select as select_by_scheme


def select(
    experiment: BaseExperiment,
    keys: RunKeys,
    fitness: Fitness,
    uniforms: Uniforms,
    lifetimes: Lifetimes | None = None,
    run_arrays: Sequence[RunArrays] | None = None,
) -> Parents:
    """Select two parents for each child of several runs, the fitter one first.

    - `fitness`: [run, agent].
    - `uniforms`: uniform numbers in (0, 1), [run, child, 2, 4].
    - `run_arrays` [run]: the scheme changes them.

    Returns agents, [run, child, 2]. If the two parents are equally fit, the order of the draws
    remains. A survivor has `ITSELF` as its second parent.
    """
    n_runs, n_agents = fitness.shape
    minimum = type(experiment.part("evolution.selection")).minimum_fitness
    setting = f"evolution.selection = {experiment.evolution.selection!r}"
    index = find_invalid_fitness(fitness.ravel(), minimum)
    if index >= 0:
        allowed = (
            "0 or more: choose rank or tournament, or a fitness that is never negative"
            if minimum == 0
            else "a finite number"
        )
        raise ValueError(
            f"{setting}: the fitness of agent {index % n_agents} is {fitness.flat[index]:g} and "
            f"must be {allowed}"
        )
    parents = np.full((n_runs, uniforms.shape[1], 2), -1, np.int32)
    if lifetimes is None:
        lifetimes = make_lifetimes(np.empty((n_runs, n_agents, 0, 0), np.float32))
    selections = Selections(keys, fitness, uniforms, parents)
    elite = experiment.evolution.elite
    for call in list_part_calls(experiment, "selection", n_runs, run_arrays):
        split_runs(call.runs, n_agents, partial(_select_range, call, elite, selections, lifetimes))
    if has_invalid_parent(parents.reshape(-1, 2), n_agents):
        raise ValueError(f"{setting} chose a parent that is none of the {n_agents} agents")
    return parents


class Selections(NamedTuple):
    """Arguments and results of the selection in several runs."""

    keys: RunKeys
    fitness: Fitness  # [run, agent].
    uniforms: Uniforms  # [run, child, 2, 4].
    parents: Parents  # Output, [run, child, 2].


class SelectionScratch(NamedTuple):
    """Memory that a selection uses for one run after another."""

    shares: Fitness  # [agent].
    order: npt.NDArray[np.int64]  # [agent].


def _select_range(
    call: PartCall,
    elite: int,
    selections: Selections,
    lifetimes: Lifetimes,
    first_run: int,
    end_run: int,
) -> None:
    """Fill the parents of a range of runs."""
    n_agents = selections.fitness.shape[1]
    scratch = SelectionScratch(poison.empty(n_agents), poison.empty(n_agents, np.int64))
    select_in_range = cached_jit(select_in_runs, call.code)
    select_in_range(call.values, elite, selections, scratch, lifetimes, first_run, end_run)


@compiled
def _select_with_lifetimes(
    scheme: Any,
    lifetimes: Lifetimes,
    run: int,
    elite: int,
    selections: Selections,
    scratch: SelectionScratch,
) -> None:
    keys = selections.keys
    generation = Generation(
        stream=Stream(keys.seed, keys.runs[run], keys.generation, SELECTION_STREAM),
        lifetimes=lifetimes,
        fitness=selections.fitness[run],
        uniforms=selections.uniforms[run],
        shares=scratch.shares,
        order=scratch.order,
        parents=selections.parents[run],
    )
    select_parents(scheme, elite, generation)


_select_in_run = for_element(_select_with_lifetimes)


def select_in_runs(
    scheme: Any,
    elite: int,
    selections: Selections,
    scratch: SelectionScratch,
    lifetimes: Lifetimes,
    first_run: int,
    end_run: int,
) -> None:
    """Fill the parents of a range of runs by a scheme."""
    for run in range(first_run, end_run):
        _select_in_run(scheme, lifetimes, run, run, elite, selections, scratch)


@compiled
def select_parents(scheme: Any, elite: int, generation: Generation) -> None:
    """Fill the parents by a scheme, the fitter one first. The elite replaces the first children."""
    select_by_scheme(scheme, generation)
    mark_survivors(scheme, generation, elite)
    fitness = generation.fitness
    parents = generation.parents
    for child in range(parents.shape[0]):
        first = parents[child, 0]
        second = parents[child, 1]
        # The second parent of a survivor is `ITSELF`, which is negative.
        if second >= 0 and fitness[second] > fitness[first]:
            parents[child, 0], parents[child, 1] = second, first


@jit_entry_point
def has_invalid_parent(parents: Parents, n_agents: int) -> bool:
    """Return whether a parent is not an index of an agent."""
    is_invalid = False
    for child in range(parents.shape[0]):
        first = parents[child, 0]
        second = parents[child, 1]
        is_second_valid = second == ITSELF or 0 <= second < n_agents
        is_valid = 0 <= first < n_agents and is_second_valid
        is_invalid = is_invalid or not is_valid
    return is_invalid


@jit_entry_point
def find_invalid_fitness(fitness: Fitness, minimum: float) -> int:
    """Return the first agent with a fitness that is not finite or is below `minimum`, or -1."""
    for agent in range(fitness.size):
        is_finite = -math.inf < fitness[agent] < math.inf
        if not (is_finite and fitness[agent] >= minimum):
            return agent
    return -1


# Numbers by which agents are sorted, [agent].
Keys = npt.NDArray[np.float64]
# [rank]: the agent with this rank.
Order = npt.NDArray[np.int64]


@compiled
def sort_by(keys: Keys, ties: Keys, order: Order) -> None:
    """Fill `order` with agents in ascending order of `keys`, then of `ties`, then of the index."""
    for agent in range(order.size):
        order[agent] = agent
    # Make a heap with the last agent at index 0. Then move the last agent of the heap to its end.
    for root in range(order.size // 2 - 1, -1, -1):
        _sift_down(keys, ties, order, root, order.size)
    for end in range(order.size - 1, 0, -1):
        order[0], order[end] = order[end], order[0]
        _sift_down(keys, ties, order, 0, end)


@compiled
def sort_from_fittest(fitness: Keys, ties: Keys, keys: Keys, order: Order) -> None:
    """Fill `order` with agents from the fittest on. `keys` [agent] is scratch."""
    for agent in range(fitness.size):
        keys[agent] = -fitness[agent]
    sort_by(keys, ties, order)


@compiled
def _sift_down(keys: Keys, ties: Keys, order: Order, root: Any, end: int) -> None:
    """Move the agent at `root` down the heap until both of its children come before it."""
    # The children of an agent in the heap are at the indices 2 * root + 1 and 2 * root + 2.
    while 2 * root + 1 < end:
        child = 2 * root + 1
        if child + 1 < end and _comes_before(keys, ties, order[child], order[child + 1]):
            child += 1
        if not _comes_before(keys, ties, order[root], order[child]):
            return
        order[root], order[child] = order[child], order[root]
        root = child


@compiled
def _comes_before(keys: Keys, ties: Keys, first: Any, second: Any) -> bool:
    """Return whether agent `first` comes before agent `second` in the order of `sort_by`."""
    if keys[first] != keys[second]:
        return bool(keys[first] < keys[second])
    if ties[first] != ties[second]:
        return bool(ties[first] < ties[second])
    return bool(first < second)
