"""The inheritance `social-heredity`, in which parents teach their children.

Generations do not overlap, so the genome of a child contains its teacher: the reinforcement module
at birth is the action module of the parents at death. A rule that learns toward the reinforcement
module, for example `self-taught`, then imitates the parents' outputs for the inputs of the child.
The action module is inherited as in `darwinian`.

Our interpretation: variation applies to teachers as it applies to action modules. A teacher is
therefore recombined from both parents and mutated. With `evolution.variation = "copy"`, it comes
from one parent. The teachers of the first generation are drawn from N(0, 1). With
`learning.teacher = "shuffled"`, the parents of another agent teach. Without a reinforcement module
the scheme equals `darwinian`.

References
----------
.. [1] N. Le, "Organic selection and social heredity: the original Baldwin effect revisited", ALIFE
   2019. We do not know its parameters.
.. [2] J. M. Baldwin, "A new factor in evolution", American Naturalist 30 (1896).
"""

from __future__ import annotations

from typing import Any

from baldwinlab.evolution.inheritance import Darwinian, Weights


class SocialHeredity(Darwinian, name="social-heredity"):
    """The genome at birth is inherited, and the parents teach.

    The reinforcement module of a child is the learned action module of its parents.

    References
    ----------
    Baldwin 1896; Le 2019.
    """

    def wants_learned(self, experiment: Any) -> bool:
        return "reinforcement" in experiment.modules or super().wants_learned(experiment)

    @staticmethod
    def assign_teachers(part: Any, innate: Weights, learned: Weights, taught: Weights) -> None:
        for weight in range(learned.size):
            taught[weight] = learned[weight]
