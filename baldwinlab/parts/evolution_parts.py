"""The kinds of part that breed: selection, variation, inheritance and fitness, and the hooks of each.

They see a whole population at once, on the processor, in float64 where nothing else is said. Genomes are float32
[agent, module, weight]; uniform numbers come in as arrays, so a hook draws none of its own.
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
from baldwinlab.parts.agent_parts import Part, compiled_values

Numbers = npt.NDArray[np.float64]
ITSELF: Final = (
    -2
)  # in the place of a second parent: the child is its first parent, which lives on unchanged


@hook
def select(
    part: Any, fitness: Numbers, uniforms: Numbers, shares: Numbers, order: Any, parents: Any
) -> None:
    """Fill `parents` int32 [child, 2] with agents. `uniforms` is [child, draw, 4] in (0, 1), of two draws.

    `shares` float64 [agent] and `order` int64 [agent] are scratch. Where the second parent is `ITSELF`, the first lives on.
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
    """As `select`, which it is unless the scheme says otherwise, with the genomes [agent, module, weight] to look at."""
    select(part, fitness, uniforms, shares, order, parents)


@hook
def mark_survivors(
    part: Any, count: int, fitness: Numbers, uniforms: Numbers, parents: Any
) -> None:
    """Let the `count` fittest live on, as the first children: of equals anybody."""
    keep_first(count, fitness, uniforms[:, 1, 3], parents)


@hook
def vary(part: Any, fitter: Any, other: Any, draws: Numbers, gate: float, child: Any) -> None:
    """Fill one `child` [module, weight] from its parents'. `draws` is [module and weight, 4] in (0, 1), and `gate` one number."""


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
    """Fill all `children` [child, module, weight], one after another, by `vary`; `draws` is scratch, and `key` theirs.

    A variation has its own where children must know of each other. Who lives on is then left to it, too.
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
    """Make `genome` [agent, module, weight], all of it drawn from N(0, 1), the founders' genomes: as it is."""


@hook
def inherit(part: Any, born: Any, learned: Any, inherited: Any) -> None:
    """Fill the action module that an agent's children inherit, [weight], from what it was born with and what it had learned."""


@hook
def assign_teachers(part: Any, born: Any, learned: Any, taught: Any) -> None:
    """Change the reinforcement module that an agent's children are born with, `taught` [weight], its own until then.

    `make_batch` and `learned` are the agent's action module, at birth and at death.
    """


@hook
def evaluate(part: Any, energy: Numbers, cost: Numbers, fitness: Numbers) -> None:
    """Fill `fitness` [agent] from the energy that agents gained in life, and what learning cost them."""


@compiled
def keep_first(count: int, fitness: Numbers, ties: Numbers, parents: Any) -> None:
    """Let the `count` agents live on that come first: the fittest, then those of the least tie, then of the least number."""
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
    """Fill `into` [module, weight] with one `genome`."""
    for module in range(genome.shape[0]):
        for weight in range(genome.shape[1]):
            into[module, weight] = genome[module, weight]


class Selection(Part):
    """Who become parents: two for each child, drawn independently; afterwards the fitter one is put first. And who live on."""

    kind: ClassVar[str] = "selection"
    least: ClassVar[float] = -math.inf  # the lowest fitness that it copes with
    has_groups: ClassVar[bool] = (
        False  # whether parents are always of the child's own group, such as one half of the population
    )

    select: ClassVar[Any] = staticmethod(select.default)
    select_with_genomes: ClassVar[Any] = staticmethod(select_with_genomes.default)
    mark_survivors: ClassVar[Any] = staticmethod(mark_survivors.default)

    @classmethod
    def mixing_settings(cls, experiment: Any) -> list[str]:
        """Return the settings of an experiment that mix the groups which this selection keeps apart."""
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
    """What children have of their parents, and what is new."""

    kind: ClassVar[str] = "variation"
    settings: ClassVar[tuple[str, ...]] = (
        "mutation_gate",
        "mutation_rate",
        "mutation_size",
    )  # of `evolution`, that it heeds

    init_founders: ClassVar[Any] = staticmethod(init_founders.default)
    vary: ClassVar[Any] = staticmethod(vary.default)
    vary_population: ClassVar[Any] = staticmethod(vary_population.default)


class Inheritance(Part):
    """What of a life is passed on."""

    kind: ClassVar[str] = "inheritance"
    resamples_genomes: ClassVar[bool] = False  # nothing: every generation begins with fresh genomes

    def wants_learned(self, experiment: Any) -> bool:
        """Whether it matters what weights an agent dies with."""
        return True

    inherit: ClassVar[Any] = staticmethod(inherit.default)
    assign_teachers: ClassVar[Any] = staticmethod(assign_teachers.default)


class Fitness(Part):
    """What a life was worth."""

    kind: ClassVar[str] = "fitness"

    evaluate: ClassVar[Any] = staticmethod(evaluate.default)


@lru_cache(maxsize=64)
def breeding_part(experiment: Any, field: str) -> tuple[Any, tuple[Callable[..., Any], ...]]:
    """The part that `evolution.FIELD` chooses, as its hooks get it; and what is compiled in with it: its type and its hook."""
    part = experiment.part(f"evolution.{field}")
    return compiled_values(part, experiment, _no_arrays), (part.Compiled, *type(part).hooks())


def _no_arrays(array: Any) -> Any:
    raise TypeError("a part that breeds has no arrays of its own")
