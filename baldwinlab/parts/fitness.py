"""The kind of part that computes the fitness of agents, and its hook."""

from __future__ import annotations

from typing import Any, ClassVar

from baldwinlab.engine.phases import hook
from baldwinlab.parts.breeding import Numbers
from baldwinlab.parts.part import Part


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


class Fitness(Part):
    """Fitness of an agent, from its energy and the cost of learning."""

    kind: ClassVar[str] = "fitness"

    evaluate: ClassVar[Any] = staticmethod(evaluate.default)
