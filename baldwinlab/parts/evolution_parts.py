"""Kinds of part that create generations: selection, variation, inheritance and fitness.

Their hooks run on the CPU and see the whole population. Numbers are float64 unless stated
otherwise.
Genomes are float32 [agent, module, weight]. Random numbers are passed as arrays, so hooks draw
none,
except that `vary_population` may draw by its key.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache
from typing import Any, ClassVar, Final

import numpy as np
import numpy.typing as npt

from baldwinlab.engine import rng
from baldwinlab.engine.jit import compiled
from baldwinlab.engine.phases import hook
from baldwinlab.parts.part import Part, compiled_values

Numbers = npt.NDArray[np.float64]
# Value of the second parent that marks a survivor: the child is its first parent, unchanged.
ITSELF: Final = -2


@hook
def select(
    part: Any, fitness: Numbers, uniforms: Numbers, shares: Numbers, order: Any, parents: Any
) -> None:
    """Select two parents for each child.

    Per population, between two generations.

    Parameters
    ----------
    part : NamedTuple
        Numeric settings and derived values of the part.
    fitness : array, float64 [agent]
        Fitness of each agent. Read only.
    uniforms : array, float64 [child, 2, 4]
        Random numbers in (0, 1). Read only.
    shares : array, float64 [agent]
        Scratch memory.
    order : array, int64 [agent]
        Scratch memory.
    parents : array, int32 [child, 2]
        Output: indices of the two parents of each child. The hook fills it. The engine puts the
        fitter
        parent first afterwards. If the second value is `ITSELF`, the first agent survives
        unchanged.
    """


@hook
def select_with_genomes(
    part: Any,
    genome: Any,
    fitness: Numbers,
    uniforms: Numbers,
    shares: Numbers,
    order: Any,
    parents: Any,
) -> None:
    """Select two parents for each child, with access to the genomes.

    Per population, between two generations. By default it calls `select`.

    Parameters
    ----------
    part : NamedTuple
        Numeric settings and derived values of the part.
    genome : array, float32 [agent, module, weight]
        Genomes of all agents. Read only.
    fitness : array, float64 [agent]
        Fitness of each agent. Read only.
    uniforms : array, float64 [child, 2, 4]
        Random numbers in (0, 1). Read only.
    shares : array, float64 [agent]
        Scratch memory.
    order : array, int64 [agent]
        Scratch memory.
    parents : array, int32 [child, 2]
        Output: indices of the two parents of each child. The hook fills it. The engine puts the
        fitter
        parent first afterwards. If the second value is `ITSELF`, the first agent survives
        unchanged.
    """
    select(part, fitness, uniforms, shares, order, parents)


@hook
def mark_survivors(
    part: Any, count: int, fitness: Numbers, uniforms: Numbers, parents: Any
) -> None:
    """Mark the agents that survive unchanged.

    Per population, after selection, if `evolution.elite` is above 0. By default the `count` fittest
    survive, with ties broken at random.

    Parameters
    ----------
    part : NamedTuple
        Numeric settings and derived values of the part.
    count : int
        Number of survivors: the setting `evolution.elite`.
    fitness : array, float64 [agent]
        Fitness of each agent. Read only.
    uniforms : array, float64 [child, 2, 4]
        Random numbers in (0, 1). Read only.
    parents : array, int32 [child, 2]
        Output: the hook sets the first `count` rows to (agent, `ITSELF`).
    """
    keep_first(count, fitness, uniforms[:, 1, 3], parents)


@hook
def vary(part: Any, fitter: Any, second: Any, draws: Numbers, gate: float, child: Any) -> None:
    """Create one child from two parents.

    Per child, by the default `vary_population`. It must write every entry of `child`.

    Parameters
    ----------
    part : NamedTuple
        Numeric settings and derived values of the part.
    fitter, second : array, float32 [module, weight]
        Genomes of the parents, the fitter one first. Read only.
    draws : array, float64 [module and weight, 4]
        Random numbers in (0, 1), four per gene. Read only.
    gate : float
        Random number in (0, 1), one per child.
    child : array, float32 [module, weight]
        Output: the genome of the child.
    """


@hook
def vary_population(
    part: Any,
    key: Any,
    genome: Any,
    fitness: Numbers,
    parents: Any,
    draws: Numbers,
    children: Any,
) -> None:
    """Create all children.

    Per population, after selection. By default it copies survivors and calls `vary` for each other
    child.
    A variation overrides it if children depend on each other. Then it must copy the survivors, too.

    Parameters
    ----------
    part : NamedTuple
        Numeric settings and derived values of the part.
    key : GenerationKey
        Key of the random numbers: `seed`, `run` and `generation`.
    genome : array, float32 [agent, module, weight]
        Genomes of all agents. Read only.
    fitness : array, float64 [agent]
        Fitness of each agent. Read only.
    parents : array, int32 [child, 2]
        Indices of the parents. Read only.
    draws : array, float64 [module and weight, 4]
        Scratch memory for random numbers.
    children : array, float32 [child, module, weight]
        Output: the genomes of all children.
    """
    seed, run, generation = key.seed, key.run, key.generation
    for child in range(children.shape[0]):
        if parents[child, 1] == ITSELF:
            copy_genome(genome[parents[child, 0]], children[child])
            continue
        rng.draw_uniforms(seed, run, generation, rng.INHERITANCE, child, draws)
        gate = rng.uniform(rng.philox(0, child, generation, rng.MUTATION_GATE, seed, run)[0])
        vary(
            part, genome[parents[child, 0]], genome[parents[child, 1]], draws, gate, children[child]
        )


@hook
def init_founders(part: Any, genome: Any) -> None:
    """Change the genomes of the founders.

    Per population, in the first generation. By default the genomes stay as they are drawn.

    Parameters
    ----------
    part : NamedTuple
        Numeric settings and derived values of the part.
    genome : array, float32 [agent, module, weight]
        Genomes drawn from N(0, 1). The hook changes them.
    """


@hook
def inherit(part: Any, innate: Any, learned: Any, inherited: Any) -> None:
    """Compute the action module that the children of an agent inherit.

    Per agent, between two generations, if `wants_learned` is true.

    Parameters
    ----------
    part : NamedTuple
        Numeric settings and derived values of the part.
    innate : array, float32 [weight]
        Action module of the agent at birth. Read only.
    learned : array, float32 [weight]
        Action module of the agent at death. Read only.
    inherited : array, float32 [weight]
        Output: the inherited action module.
    """


@hook
def assign_teachers(part: Any, innate: Any, learned: Any, taught: Any) -> None:
    """Change the reinforcement module that the children of an agent inherit.

    Per agent, between two generations, if the genome has a second module.

    Parameters
    ----------
    part : NamedTuple
        Numeric settings and derived values of the part.
    innate : array, float32 [weight]
        Action module of the agent at birth. Read only.
    learned : array, float32 [weight]
        Action module of the agent at death. Read only.
    taught : array, float32 [weight]
        Reinforcement module of the agent. The hook changes it.
    """


@hook
def evaluate(part: Any, energy: Numbers, cost: Numbers, fitness: Numbers) -> None:
    """Compute the fitness of all agents.

    Per population, at the end of a lifetime.

    Parameters
    ----------
    part : NamedTuple
        Numeric settings and derived values of the part.
    energy : array, float64 [agent]
        Energy gained during the lifetime, or the payoff of the model. Read only.
    cost : array, float64 [agent]
        Cost of learning, in energy. Read only.
    fitness : array, float64 [agent]
        Output: fitness of each agent.
    """


@compiled
def keep_first(count: int, fitness: Numbers, ties: Numbers, parents: Any) -> None:
    """Mark the `count` fittest agents as survivors, ties by `ties` and then by index."""
    last = -1
    for place in range(count):
        next_one = -1
        for agent in range(fitness.size):
            ahead = last < 0 or _comes_before(fitness, ties, last, agent)
            if ahead and (next_one < 0 or _comes_before(fitness, ties, agent, next_one)):
                next_one = agent
        parents[place, 0], parents[place, 1], last = next_one, ITSELF, next_one


@compiled
def _comes_before(fitness: Numbers, ties: Numbers, a: int, b: int) -> bool:
    if fitness[a] != fitness[b]:
        return bool(fitness[a] > fitness[b])
    if ties[a] != ties[b]:
        return bool(ties[a] < ties[b])
    return a < b


@compiled
def copy_genome(genome: Any, into: Any) -> None:
    """Copy a genome [module, weight] to `into`."""
    for module in range(genome.shape[0]):
        for weight in range(genome.shape[1]):
            into[module, weight] = genome[module, weight]


class Selection(Part):
    """Selection: the parents of each child, and the survivors.

    Attributes
    ----------
    least : float
        Lowest fitness that the selection accepts.
    has_groups : bool
        True if both parents of a child come from the group of the child, such as one half of the
        population.
    """

    kind: ClassVar[str] = "selection"
    least: ClassVar[float] = -math.inf
    has_groups: ClassVar[bool] = False

    select: ClassVar[Any] = staticmethod(select.default)
    select_with_genomes: ClassVar[Any] = staticmethod(select_with_genomes.default)
    mark_survivors: ClassVar[Any] = staticmethod(mark_survivors.default)

    @classmethod
    def mixing_settings(cls, experiment: Any) -> list[str]:
        """Return the settings of an experiment that would mix the groups of the selection."""
        evolution, variation = experiment.evolution, experiment.part("evolution.variation")
        varies_alone = type(variation).vary_population is vary_population.default
        mixing = {
            f"evolution.elite = {evolution.elite}": evolution.elite > 0
            and cls.mark_survivors is mark_survivors.default,
            f"evolution.variation = {evolution.variation!r}": not varies_alone,
            "learning.teacher = 'shuffled'": getattr(
                getattr(experiment, "learning", None), "teacher", ""
            )
            == "shuffled",
            "world.features with births in mid-life": experiment.births_in_life,
        }
        return [setting for setting, mixes in mixing.items() if mixes] if cls.has_groups else []


class Variation(Part):
    """Variation: the genomes of the founders and of the children.

    Attributes
    ----------
    settings : tuple of str
        Settings of the table `evolution` that the variation uses.
    """

    kind: ClassVar[str] = "variation"
    settings: ClassVar[tuple[str, ...]] = (
        "mutation_gate",
        "mutation_rate",
        "mutation_size",
    )

    init_founders: ClassVar[Any] = staticmethod(init_founders.default)
    vary: ClassVar[Any] = staticmethod(vary.default)
    vary_population: ClassVar[Any] = staticmethod(vary_population.default)


class Inheritance(Part):
    """Inheritance: the effect of learning on the genomes of the children.

    Attributes
    ----------
    resamples_genomes : bool
        True if nothing is inherited: every generation has random genomes.
    """

    kind: ClassVar[str] = "inheritance"
    resamples_genomes: ClassVar[bool] = False

    def wants_learned(self, experiment: Any) -> bool:
        """Return whether `inherit` and `assign_teachers` use the weights at death.

        If it is false in an experiment, learned weights are not collected.
        """
        return True

    inherit: ClassVar[Any] = staticmethod(inherit.default)
    assign_teachers: ClassVar[Any] = staticmethod(assign_teachers.default)


class Fitness(Part):
    """Fitness of an agent, from its energy and the cost of learning."""

    kind: ClassVar[str] = "fitness"

    evaluate: ClassVar[Any] = staticmethod(evaluate.default)


@lru_cache(maxsize=64)
def breeding_part(experiment: Any, field: str) -> tuple[Any, tuple[Callable[..., Any], ...]]:
    """Return the part at `evolution.FIELD` for its hooks, and its type and hooks to compile."""
    part = experiment.part(f"evolution.{field}")
    return compiled_values(part, experiment, _no_arrays), (part.Compiled, *type(part).hooks())


def _no_arrays(array: Any) -> Any:
    raise TypeError("a part that breeds has no arrays of its own")
