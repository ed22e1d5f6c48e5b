"""Inheritance: what of a life is passed on, and, as a control, from whom teachers come."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, ClassVar, Final

import numpy as np
import numpy.typing as npt

from baldwinlab.engine import poison, rng
from baldwinlab.engine.jit import entry, kept
from baldwinlab.evolution.founders import WEIGHTS_OF_MODULE, draw_normal
from baldwinlab.evolution.rng_key import GenerationKey, Genome, Parents
from baldwinlab.evolution.sorting import Order, sort_by
from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.parts.evolution_parts import Inheritance, assign_teachers, breeding_part, inherit

Weights = npt.NDArray[np.float32]  # [weight], of the action module


class Darwinian(Inheritance, name="darwinian"):
    """The genome at birth is inherited.

    With `evolution.lamarckian_share`, this share of the learned change is inherited in addition.

    References
    ----------
    Lamarck 1809; Sasaki and Tokoro 1999.
    """

    derived: ClassVar[Mapping[str, Any]] = {
        "share": lambda part, experiment: float(experiment.evolution.lamarckian_share)
    }

    def wants_learned(self, experiment: BaseExperiment) -> bool:
        return experiment.evolution.lamarckian_share > 0

    @staticmethod
    def inherit(part: Any, born: Weights, learned: Weights, inherited: Weights) -> None:
        for weight in range(learned.size):
            kept = (1.0 - part.share) * np.float64(born[weight])
            inherited[weight] = np.float32(
                kept + np.float64(np.float32(part.share) * learned[weight])
            )

    @staticmethod
    def oracle(part: Any, born: Any, learned: Any) -> Any:
        return [old + part.share * (new - old) for old, new in zip(born, learned, strict=True)]


class NoInheritance(Inheritance, name="none"):
    """Nothing is inherited: each generation has new random genomes."""

    resamples_genomes: ClassVar[bool] = True

    def wants_learned(self, experiment: BaseExperiment) -> bool:
        return False


def inherit_genomes(experiment: BaseExperiment, genome: Genome, learned: Genome | None) -> Genome:
    """The genomes that are inherited: as they were born, or as inheritance makes them of what was `learned` [agent, weight]."""
    part = experiment.part("evolution.inheritance")
    if learned is None or not part.wants_learned(experiment):
        return genome
    modules = (
        2 if "reinforcement" in experiment.modules else 1
    )  # that inheritance changes, the first ones
    born = np.ascontiguousarray(genome[:, :modules])
    changed, inherited = born.copy(), genome.copy()
    poison.fill(changed[:, 0, : learned.shape[1]])
    values, code = breeding_part(experiment, "inheritance")
    kept(inherit_all, code)(values, born, learned, changed)
    inherited[:, :modules] = changed
    return inherited


def needs_simulation(experiment: BaseExperiment) -> bool:
    """Whether what is inherited cannot be known without living: what was learned, or by whom others were born in life."""
    return experiment.births_in_life or experiment.part("evolution.inheritance").wants_learned(
        experiment
    )


@entry
def remap_parents(origin: Parents, parents: Parents) -> None:
    """Put in the place of `parents` [child, 2] those of whom they descend by `origin` [agent, 2]: who was born when a life began.

    Of an agent that lives on, as both of its own parents, these are its own two.
    """
    for child in range(parents.shape[0]):
        one, other = parents[child, 0], parents[child, 1]
        if one >= 0 and other >= 0:
            parents[child, 0], parents[child, 1] = (
                origin[one, 0],
                origin[other, 1 if one == other else 0],
            )


def inherit_all(part: Any, genome: Genome, learned: Genome, inherited: Genome) -> None:
    """Fill the action modules of `inherited`, agent by agent, and the reinforcement modules where there are any."""
    for agent in range(learned.shape[0]):
        inherit(part, genome[agent, 0], learned[agent], inherited[agent, 0])
        if genome.shape[1] > 1:
            assign_teachers(part, genome[agent, 0], learned[agent], inherited[agent, 1])


def apply_teacher_control(experiment: BaseExperiment, genome: Genome, key: GenerationKey) -> Genome:
    """Apply the control `learning.teacher` to the reinforcement modules of a new generation."""
    if not isinstance(experiment, Experiment) or "reinforcement" not in experiment.modules:
        return genome
    return TEACHERS[experiment.learning.teacher](genome, key)


def inherit_teachers(genome: Genome, key: GenerationKey) -> Genome:
    """Every child has the teacher that it was born with."""
    return genome


def shuffle_teachers(genome: Genome, key: GenerationKey) -> Genome:
    """The children's teachers are dealt anew among them."""
    dealt = poison.empty(genome.shape, genome.dtype)
    permute_teachers(genome, _teacher_order(len(genome), key), dealt)
    return dealt


def _teacher_order(children: int, key: GenerationKey) -> Order:
    """Which child's teacher each gets."""
    order = poison.empty(children, np.int64)
    draws = key.uniforms(rng.TEACHER, (children, 1))[:, 0, 0]
    sort_by(draws, draws, order)
    return order


def draw_teachers(genome: Genome, key: GenerationKey) -> Genome:
    """Every child has a teacher from N(0, 1)."""
    dealt = genome.copy()
    draw_normal(key, WEIGHTS_OF_MODULE["reinforcement"], dealt, 1)
    return dealt


@entry
def permute_teachers(genome: Genome, order: Order, dealt: Genome) -> None:
    """Fill `dealt` with everybody's own modules, but for the reinforcement module, the second, of whom `order` names."""
    for child in range(genome.shape[0]):
        for module in range(genome.shape[1]):
            for weight in range(genome.shape[2]):
                dealt[child, module, weight] = genome[
                    order[child] if module == 1 else child, module, weight
                ]


def has_parent_teachers(experiment: Experiment) -> bool:
    """Whether reinforcement modules are made of what the generation before had learned."""
    return (
        "reinforcement" in experiment.modules
        and type(experiment.part("evolution.inheritance")).assign_teachers
        is not assign_teachers.default
    )


def find_teachers(experiment: Experiment, key: GenerationKey, parents: Parents) -> Parents | None:
    """Whose learned weights the teachers of a generation's children were passed on from, as `parents` [child, 2] are given.

    They are of the generation before. None where nobody's were. `key` is the children's.
    """
    if not has_parent_teachers(experiment) or experiment.learning.teacher == "fresh":
        return None
    return (
        parents[_teacher_order(len(parents), key)]
        if experiment.learning.teacher == "shuffled"
        else parents
    )


TEACHERS: Final[Mapping[str, Callable[[Genome, GenerationKey], Genome]]] = {
    "inherited": inherit_teachers,
    "shuffled": shuffle_teachers,
    "fresh": draw_teachers,
}
