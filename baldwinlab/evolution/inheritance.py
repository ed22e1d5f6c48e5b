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

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any, ClassVar, Final

import numpy as np
import numpy.typing as npt

from baldwinlab.engine import poison, rng
from baldwinlab.engine.jit import cached_jit, compiled, jit_entry_point
from baldwinlab.evolution.founders import PURPOSE_BY_MODULE, draw_module
from baldwinlab.evolution.rng_key import (
    Fitness,
    GenerationKey,
    Genome,
    Parents,
    RunKeys,
    split_runs,
)
from baldwinlab.evolution.selection import Order, sort_by
from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.parts.breeding import (
    Inheritance,
    RunArrays,
    assign_teachers,
    has_run_arrays,
    inherit,
    list_part_calls,
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
    genomes: Genome,
    learned: Genome | None,
    run_arrays: Sequence[RunArrays] | None = None,
) -> Genome:
    """Return the inherited genomes of several runs, from the genomes at birth and `learned`.

    `genomes` [run, agent, module, weight]. `learned` [run, agent, weight] is the action module at
    death, or None if it is not needed. `run_arrays` [run]: the part changes them.
    """
    part = experiment.part("evolution.inheritance")
    if learned is None or not part.wants_learned(experiment):
        return genomes
    innate = np.ascontiguousarray(genomes)
    inherited = innate.copy()
    n_runs, n_agents, n_weights = learned.shape
    poison.fill(inherited[:, :, 0, :n_weights])
    has_teachers = "reinforcement" in experiment.modules
    for call in list_part_calls(experiment, "inheritance", n_runs, run_arrays):
        inherit_range = cached_jit(inherit_runs, call.code)
        arguments = (call.values, has_teachers, innate, learned, inherited)
        split_runs(call.runs, n_agents, partial(inherit_range, *arguments))
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
def remap_parents_of_runs(origins: Parents, parents: Parents) -> None:
    """Apply `remap_parents` to the parents of all runs: `origins` [run, agent, 2]."""
    for run in range(parents.shape[0]):
        remap_parents(origins[run], parents[run])


@compiled
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


def inherit_runs(
    part: Any,
    has_teachers: bool,
    genomes: Genome,
    learned: Genome,
    inherited: Genome,
    first_run: int,
    end_run: int,
) -> None:
    """Fill the inherited genomes of a range of runs, see `inherit_all`."""
    for run in range(first_run, end_run):
        inherit_all(part, has_teachers, genomes[run], learned[run], inherited[run])


@compiled
def inherit_all(
    part: Any, has_teachers: bool, genome: Genome, learned: Genome, inherited: Genome
) -> None:
    """Fill the action modules of `inherited`, and with teachers the reinforcement modules, too."""
    for agent in range(learned.shape[0]):
        inherit(part, genome[agent], learned[agent], inherited[agent])
        if has_teachers:
            taught = inherited[agent, REINFORCEMENT_MODULE]
            assign_teachers(part, genome[agent, 0], learned[agent], taught)


def apply_teacher_control(experiment: BaseExperiment, genomes: Genome, keys: RunKeys) -> Genome:
    """Apply the control `learning.teacher` to the reinforcement modules of a new generation.

    `genomes` [run, child, module, weight].
    """
    if not isinstance(experiment, Experiment) or "reinforcement" not in experiment.modules:
        return genomes
    if experiment.learning.teacher == "shuffled":
        return _shuffle_teachers(genomes, keys)
    return _draw_teachers(genomes, keys) if experiment.learning.teacher == "fresh" else genomes


def _shuffle_teachers(genomes: Genome, keys: RunKeys) -> Genome:
    """Return genomes whose reinforcement modules are permuted among the children of a run."""
    permuted = poison.empty(genomes.shape, genomes.dtype)
    _permute_teachers_of_runs(genomes, _draw_teacher_orders(genomes.shape[1], keys), permuted)
    return permuted


def _draw_teacher_orders(n_children: int, keys: RunKeys) -> Order:
    """Return a random permutation of the children of each run, [run, child].

    Child `i` gets the teacher of child `order[i]`.
    """
    orders = poison.empty((len(keys.runs), n_children), np.int64)
    # One number for each child.
    draws = np.ascontiguousarray(keys.uniforms(rng.TEACHER, (n_children, 1))[:, :, 0, 0])
    _sort_in_runs(draws, orders)
    return orders


@jit_entry_point
def _sort_in_runs(draws: Fitness, orders: Order) -> None:
    for run in range(orders.shape[0]):
        sort_by(draws[run], draws[run], orders[run])


def _draw_teachers(genomes: Genome, keys: RunKeys) -> Genome:
    """Return genomes whose reinforcement modules are drawn from N(0, 1)."""
    redrawn = genomes.copy()
    draw_module(keys, PURPOSE_BY_MODULE["reinforcement"], redrawn, REINFORCEMENT_MODULE)
    return redrawn


@jit_entry_point
def _permute_teachers_of_runs(genomes: Genome, orders: Order, permuted: Genome) -> None:
    for run in range(genomes.shape[0]):
        permute_teachers(genomes[run], orders[run], permuted[run])


@compiled
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
        order: Order = _draw_teacher_orders(len(parents), key.as_run_keys())[0]
        return parents[order]
    return parents
