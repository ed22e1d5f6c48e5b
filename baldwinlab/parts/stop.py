"""The kind of part that decides whether a run stops before its last generation, and its hook."""

from __future__ import annotations

from typing import Any, ClassVar

from baldwinlab.engine.phases import hook
from baldwinlab.parts.breeding import Numbers
from baldwinlab.parts.lifetimes import Lifetimes
from baldwinlab.parts.part import Part


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
