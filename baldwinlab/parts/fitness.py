"""The kind of part that computes the fitness of agents, and its hook."""

from __future__ import annotations

from typing import Any, ClassVar

from baldwinlab.engine.phases import hook
from baldwinlab.parts.breeding import Numbers
from baldwinlab.parts.lifetimes import Lifetimes
from baldwinlab.parts.part import Part
from baldwinlab.parts.world_features import end_step


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
