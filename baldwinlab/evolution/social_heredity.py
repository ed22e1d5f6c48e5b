"""Social heredity: the young are taught by their elders.

Generations do not overlap here, so whoever is to be taught by its parents must bring them along: at birth, a child's
reinforcement module is what its parents' action modules had become by their death. With a rule that learns towards that
module, such as `self-taught`, a child then imitates, on its own input, what its parents would do. What the parents had learned
is not in its action module: that is inherited as ever.

Readings of ours: whatever variation makes of two parents' modules, it makes of teachers too, so a child's teacher is mixed of
both and remembered with the errors of mutation (with `evolution.variation = "copy"`, it is one parent's alone). The first
generation has elders of N(0, 1). With `learning.teacher = "shuffled"` it is the elders of another agent that teach. Without
a reinforcement module no agent is taught, and the scheme equals `darwinian`.

Source: N. Le, "Organic selection and social heredity: the original Baldwin effect revisited", ALIFE 2019 (its numbers are not
known to us); the idea: J. M. Baldwin, "A new factor in evolution", American Naturalist 30 (1896).
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
    def assign_teachers(part: Any, born: Weights, learned: Weights, taught: Weights) -> None:
        for weight in range(learned.size):
            taught[weight] = learned[weight]

    @staticmethod
    def oracle(part: Any, born: Any, learned: Any) -> Any:
        return Darwinian.oracle(part, born, learned), learned
