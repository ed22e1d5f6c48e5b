"""The kinds of part that breed: selection, variation, inheritance and fitness, and the phases of each.

They see a whole population at once, on the processor, in float64 where nothing else is said. Genomes are float32
[agent, module, weight]; uniform numbers come in as arrays, so a phase draws none of its own.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from baldwinlab.engine.phases import phase
from baldwinlab.parts.kinds import Part, compiled_values

Numbers = npt.NDArray[np.float64]


@phase
def select(part: Any, fitness: Numbers, uniforms: Numbers, shares: Numbers, order: Any, parents: Any) -> None:
    """Fill `parents` int32 [child, 2] with agents. `uniforms` is [child, draw, 4] in (0, 1), of two draws.

    `shares` float64 [agent] and `order` int64 [agent] are scratch.
    """


@phase
def vary(part: Any, fitter: Any, other: Any, draws: Numbers, gate: float, child: Any) -> None:
    """Fill one `child` [module, weight] from its parents'. `draws` is [module and weight, 4] in (0, 1), and `gate` one number."""


@phase
def pass_on(part: Any, born: Any, learned: Any, inherited: Any) -> None:
    """Fill the action module that an agent's children inherit, [weight], from what it was born with and what it had learned."""


@phase
def teach(part: Any, born: Any, learned: Any, taught: Any) -> None:
    """Change the reinforcement module that an agent's children are born with, `taught` [weight], its own until then.

    `born` and `learned` are the agent's action module, at birth and at death.
    """


@phase
def evaluate(part: Any, energy: Numbers, cost: Numbers, fitness: Numbers) -> None:
    """Fill `fitness` [agent] from the energy that agents gained in life, and what learning cost them."""


class Selection(Part):
    """Who become parents: two for each child, drawn independently; afterwards the fitter one is put first."""

    kind: ClassVar[str] = "selection"
    least: ClassVar[float] = -math.inf  # the lowest fitness that it copes with

    select: ClassVar[Any] = staticmethod(select.default)


class Variation(Part):
    """What children have of their parents, and what is new."""

    kind: ClassVar[str] = "variation"
    settings: ClassVar[tuple[str, ...]] = ("mutation_gate", "mutation_rate", "mutation_size")  # of `evolution`, that it heeds

    vary: ClassVar[Any] = staticmethod(vary.default)


class Inheritance(Part):
    """What of a life is passed on."""

    kind: ClassVar[str] = "inheritance"
    afresh: ClassVar[bool] = False  # nothing: every generation begins with fresh genomes

    def wants_learned(self, experiment: Any) -> bool:
        """Whether it matters what weights an agent dies with."""
        return True

    pass_on: ClassVar[Any] = staticmethod(pass_on.default)
    teach: ClassVar[Any] = staticmethod(teach.default)


class Fitness(Part):
    """What a life was worth."""

    kind: ClassVar[str] = "fitness"

    evaluate: ClassVar[Any] = staticmethod(evaluate.default)


@lru_cache(maxsize=64)
def breeding_part(experiment: Any, field: str) -> tuple[Any, tuple[Callable[..., Any], ...]]:
    """The part that `evolution.FIELD` chooses, as its phases get it; and what is compiled in with it: its type and its phase."""
    part = experiment.part(f"evolution.{field}")
    return compiled_values(part, experiment, _no_arrays), (part.Compiled, *type(part).phases())


def _no_arrays(array: Any) -> Any:
    raise TypeError("a part that breeds has no arrays of its own")
