"""The kind of part that computes the genomes that children inherit, and its hooks."""

from __future__ import annotations

from typing import Any, ClassVar

from baldwinlab.engine.phases import hook
from baldwinlab.parts.part import Part


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
