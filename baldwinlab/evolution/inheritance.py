"""Inheritance of genomes and learned weights, and the control of teachers (`learning.teacher`).

With `social-heredity`, parents teach their children. Generations do not overlap, so the genome of a
child contains its teacher: the reinforcement module at birth is the action module of the parents at
death. A rule that learns toward the reinforcement module, for example `self-taught`, then imitates
the parents' outputs for the inputs of the child. The action module is inherited as in `darwinian`.

Our interpretation: variation applies to teachers as it applies to action modules. A teacher is
therefore recombined from both parents and mutated. With `evolution.variation = "copy"`, a teacher
comes from one parent. The teachers of the first generation are drawn from N(0, 1). With
`learning.teacher = "shuffled"`, the parents of another agent teach. Without a reinforcement module
the scheme equals `darwinian`.

References
----------
.. [1] N. Le, "Organic selection and social heredity: the original Baldwin effect revisited", ALIFE
   2019. We do not know its parameters.
.. [2] J. M. Baldwin, "A new factor in evolution", American Naturalist 30 (1896).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, Final

import numpy as np
import numpy.typing as npt

from baldwinlab.engine import poison, rng
from baldwinlab.engine.jit import cached_jit, jit_entry_point
from baldwinlab.evolution.founders import PURPOSE_BY_MODULE, draw_module
from baldwinlab.evolution.rng_key import GenerationKey, Genome, Parents
from baldwinlab.evolution.selection import Order, sort_by
from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.parts.breeding import (
    Inheritance,
    RunArrays,
    assign_teachers,
    breeding_part,
    has_run_arrays,
    inherit,
)
from baldwinlab.parts.selection import reads_lifetimes
from baldwinlab.parts.variation import OneGenome

# Weights of the action module, [weight].
Weights = npt.NDArray[np.float32]
# Index of the reinforcement module, if the genome has one. The action module has the index 0.
REINFORCEMENT_MODULE: Final = 1


class Darwinian(Inheritance, name="darwinian"):
    """The genome at birth is inherited.

    In addition, the fraction `evolution.lamarckian_share` of the change by learning is inherited.

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
    def inherit(
        part: Any, innate_genome: OneGenome, learned: Weights, inherited_genome: OneGenome
    ) -> None:
        for weight in range(learned.size):
            weighted_innate = (1.0 - part.share) * np.float64(innate_genome[0, weight])
            acquired = np.float64(np.float32(part.share) * learned[weight])
            inherited_genome[0, weight] = np.float32(weighted_innate + acquired)


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


class NoInheritance(Inheritance, name="none"):
    """Nothing is inherited: each generation has new random genomes."""

    resamples_genomes: ClassVar[bool] = True

    def wants_learned(self, experiment: BaseExperiment) -> bool:
        return False


def apply_inheritance(
    experiment: BaseExperiment,
    genome: Genome,
    learned: Genome | None,
    run_arrays: RunArrays | None = None,
) -> Genome:
    """Return the inherited genomes, from the genomes at birth and `learned`.

    `learned` [agent, weight] is the action module at death, or None if it is not needed. The part
    changes `run_arrays`, the arrays of the run.
    """
    part = experiment.part("evolution.inheritance")
    if learned is None or not part.wants_learned(experiment):
        return genome
    innate = np.ascontiguousarray(genome)
    inherited = innate.copy()
    poison.fill(inherited[:, 0, : learned.shape[1]])
    compiled_part, code = breeding_part(experiment, "inheritance", run_arrays)
    has_teachers = "reinforcement" in experiment.modules
    cached_jit(inherit_all, code)(compiled_part, has_teachers, innate, learned, inherited)
    return inherited


def needs_simulation(experiment: BaseExperiment) -> bool:
    """Return whether the genomes of a generation require the simulation of earlier generations.

    The result is True if learned weights are inherited, agents are born during a lifetime, the
    selection reads results of lifetimes, or a part of reproduction has arrays of the run. With
    several species, it is True because a simulation also determines the species of each agent.
    """
    if experiment.population.species or experiment.births_in_life:
        return True
    return any(
        segment.part("evolution.inheritance").wants_learned(segment)
        or selects_by_lifetimes(segment)
        for _, segment in experiment.segments()
    )


def selects_by_lifetimes(experiment: BaseExperiment) -> bool:
    """Return whether reproduction reads results of lifetimes, or arrays of the run."""
    members = experiment.species_experiments() or (experiment,)
    return any(_reads_lifetimes(member) for member in members)


def _reads_lifetimes(experiment: BaseExperiment) -> bool:
    selection: Any = type(experiment.part("evolution.selection"))
    if reads_lifetimes(selection) and not selection.reads_only_genomes:
        return True
    parts = [experiment.part(f"evolution.{field}") for field in ("selection", "variation")]
    return any(has_run_arrays(part) for part in parts)


@jit_entry_point
def remap_parents(origin: Parents, parents: Parents) -> None:
    """Replace parents born during a lifetime by ancestors from the beginning of this lifetime.

    `parents` is [child, 2]. `origin` [agent, 2] has the two ancestors of each agent. A parent is
    replaced by the first ancestor of the parent. A survivor is both parents of itself, and these
    are replaced by both ancestors of the survivor.
    """
    for child in range(parents.shape[0]):
        first = parents[child, 0]
        second = parents[child, 1]
        if first >= 0 and second >= 0:
            parents[child, 0] = origin[first, 0]
            is_survivor = first == second
            ancestor_index = 1 if is_survivor else 0
            parents[child, 1] = origin[second, ancestor_index]


def inherit_all(
    part: Any, has_teachers: bool, genome: Genome, learned: Genome, inherited: Genome
) -> None:
    """Fill the action modules of `inherited`, and with teachers the reinforcement modules, too."""
    for agent in range(learned.shape[0]):
        inherit(part, genome[agent], learned[agent], inherited[agent])
        if has_teachers:
            taught = inherited[agent, REINFORCEMENT_MODULE]
            assign_teachers(part, genome[agent, 0], learned[agent], taught)


def apply_teacher_control(experiment: BaseExperiment, genome: Genome, key: GenerationKey) -> Genome:
    """Apply the control `learning.teacher` to the reinforcement modules of a new generation."""
    if not isinstance(experiment, Experiment) or "reinforcement" not in experiment.modules:
        return genome
    if experiment.learning.teacher == "shuffled":
        return _shuffle_teachers(genome, key)
    return _draw_teachers(genome, key) if experiment.learning.teacher == "fresh" else genome


def _shuffle_teachers(genome: Genome, key: GenerationKey) -> Genome:
    """Return the genomes with the reinforcement modules permuted among the children."""
    permuted = poison.empty(genome.shape, genome.dtype)
    permute_teachers(genome, _draw_teacher_order(len(genome), key), permuted)
    return permuted


def _draw_teacher_order(n_children: int, key: GenerationKey) -> Order:
    """Return a random permutation of the children: child `i` gets the teacher of `order[i]`."""
    order = poison.empty(n_children, np.int64)
    draws = key.uniforms(rng.TEACHER, (n_children, 1))[:, 0, 0]
    sort_by(draws, draws, order)
    return order


def _draw_teachers(genome: Genome, key: GenerationKey) -> Genome:
    """Return the genomes with new reinforcement modules, drawn from N(0, 1)."""
    redrawn = genome.copy()
    draw_module(key, PURPOSE_BY_MODULE["reinforcement"], redrawn, REINFORCEMENT_MODULE)
    return redrawn


@jit_entry_point
def permute_teachers(genome: Genome, order: Order, permuted: Genome) -> None:
    """Copy `genome` to `permuted`; child `i` gets the reinforcement module of child `order[i]`."""
    for child in range(genome.shape[0]):
        for module in range(genome.shape[1]):
            for weight in range(genome.shape[2]):
                source = order[child] if module == REINFORCEMENT_MODULE else child
                permuted[child, module, weight] = genome[source, module, weight]


def has_parent_teachers(experiment: Experiment) -> bool:
    """Return whether reinforcement modules come from learned weights of the parents."""
    inheritance = type(experiment.part("evolution.inheritance"))
    assigns_teachers = inheritance.assign_teachers is not assign_teachers.default
    return "reinforcement" in experiment.modules and assigns_teachers


def find_teachers(experiment: Experiment, key: GenerationKey, parents: Parents) -> Parents | None:
    """Return the agents [child, 2] of the previous generation that teach each child.

    Return None if teachers do not come from learned weights. `key` is the key of the children.
    """
    if not has_parent_teachers(experiment) or experiment.learning.teacher == "fresh":
        return None
    if experiment.learning.teacher == "shuffled":
        return parents[_draw_teacher_order(len(parents), key)]
    return parents
