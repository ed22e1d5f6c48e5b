"""The oracle of evolution, in NumPy and SciPy.

It implements selection, crossover, mutation, inheritance and fitness a second time.
Arrays: `genome` is float32 [agent, module, weight], `fitness` is float64 [agent], and `parents` is
int32 [child, 2] with the fitter parent first.
"""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import numpy.typing as npt
from scipy.special import ndtri

from baldwinlab.engine import rng
from baldwinlab.evolution import GenerationKey, Genome, Parents, Uniforms
from baldwinlab.experiment import Evolution, Experiment, registry
from tests.oracles.parts import find_oracle

_WEIGHT_PURPOSES = {"action": rng.ACTION_WEIGHTS, "reinforcement": rng.REINFORCEMENT_WEIGHTS}


def draw_genomes(experiment: Experiment, key: GenerationKey) -> Genome:
    """Return new genomes with weights from N(0, 1).

    Source: the paper, section "The neural network controller".
    """
    agents = experiment.population.size
    weights = experiment.genome_length
    genome = np.empty((agents, len(experiment.modules), weights), np.float32)
    for module, name in enumerate(experiment.modules):
        uniforms = key.uniforms(_WEIGHT_PURPOSES[name], (agents, -(-weights // 4)))
        genome[:, module] = ndtri(uniforms.reshape(agents, -1)[:, :weights])
    return genome


def breed(
    experiment: Experiment, genome: Genome, fitness: npt.NDArray[np.float64], key: GenerationKey
) -> tuple[Genome, Parents]:
    """Return the children of a simulated generation and their parents.

    `key` is the key of the children's generation.
    """
    agents, modules, weights = genome.shape
    evolution = experiment.evolution
    parents = select(evolution.selection, fitness, key.uniforms(rng.SELECTION, (agents, 2)))
    draws = key.uniforms(rng.INHERITANCE, (agents, modules * weights)).reshape(
        agents, modules, weights, 4
    )
    children = cross_over(genome, parents, draws[..., 0])
    gate_of_child = key.uniforms(rng.MUTATION_GATE, (agents, 1))[:, :, :1]
    gates = draws[..., 1] if evolution.mutation_gate == "weight" else gate_of_child
    return apply_teacher_control(
        experiment, mutate(children, evolution, gates, draws[..., 2]), key
    ), parents


def apply_teacher_control(experiment: Experiment, genome: Genome, key: GenerationKey) -> Genome:
    """Apply the control `learning.teacher` to the reinforcement modules of a new generation."""
    taught = len(experiment.modules) > 1
    if taught and experiment.learning.teacher == "shuffled":
        order = np.argsort(key.uniforms(rng.TEACHER, (len(genome), 1))[:, 0, 0], kind="stable")
        return np.stack([genome[:, 0], genome[order, 1]], axis=1)
    if taught and experiment.learning.teacher == "fresh":
        return np.stack([genome[:, 0], draw_genomes(experiment, key)[:, 1]], axis=1)
    return genome


def apply_inheritance(experiment: Experiment, genome: Genome, learned: Genome | None) -> Genome:
    """Return the genomes to inherit: the newborn genomes, moved toward the learned weights.

    `learned` is the action module [agent, weight] at death, or None without learning.
    Sources: Lamarck, Philosophie zoologique, 1809. In evolved networks: Sasaki and Tokoro,
    Artificial Life 5 (1999).
    """
    share = experiment.evolution.lamarckian_share
    weights = experiment.weight_count
    if learned is None or share == 0:
        return genome
    inherited = genome.copy()
    inherited[:, 0, :weights] = (1 - share) * genome[:, 0, :weights].astype(
        np.float64
    ) + share * learned
    return inherited


def fitness(
    experiment: Experiment, eaten: npt.NDArray[np.int32], genome: Genome, learned: Genome | None
) -> npt.NDArray[np.float64]:
    """Return the energy [agent] of the items `eaten` [agent, region] minus the cost of learning.

    The result is at least 0.
    """
    energies = np.array([region.energy for region in experiment.world.food] or [0.0])
    total_energy: npt.NDArray[np.float64] = (eaten * energies).sum(axis=1)
    return np.maximum(0, total_energy - compute_learning_cost(experiment, genome, learned))


def compute_learning_cost(
    experiment: Experiment, genome: Genome, learned: Genome | None
) -> npt.NDArray[np.float64]:
    """Return the energy [agent] that learning costs in a lifetime.

    The cost has two terms: the number of steps with learning, and the distance from the weights
    at birth to `learned`.
    Source: G. Mayley, "Landscapes, learning costs and genetic assimilation", Evolutionary
    Computation 4 (1996).
    """
    cost = np.zeros(len(genome))
    if experiment.learns:
        steps = experiment.lifetime.steps
        if experiment.learning.steps is not None:
            steps = min(experiment.learning.steps, steps)
        cost += experiment.learning.cost_per_step * steps
        if learned is not None:
            newborn_weights = genome[:, 0, : experiment.weight_count].astype(np.float64)
            cost += experiment.learning.cost_per_change * np.sqrt(
                ((learned - newborn_weights) ** 2).sum(axis=1)
            )
    return cost


def select(scheme: str, fitness: npt.NDArray[np.float64], uniforms: Uniforms) -> Parents:
    """Draw two parents for each child. The fitter parent comes first."""
    choose_parents = find_oracle(registry.find_class("selection", scheme))
    generation = SimpleNamespace(fitness=fitness.tolist(), uniforms=uniforms.tolist())
    pairs = choose_parents(SimpleNamespace(), generation)
    return _fitter_first(np.array(pairs, np.int32), fitness)


def _fitter_first(pairs: Parents, fitness: npt.NDArray[np.float64]) -> Parents:
    """Order pairs [..., 2] of agents by fitness. Pairs of equal fitness keep their order."""
    swap = fitness[pairs[..., 1]] > fitness[pairs[..., 0]]
    return np.where(swap[..., None], pairs[..., ::-1], pairs)


def cross_over(genome: Genome, parents: Parents, uniforms: Uniforms) -> Genome:
    """Copy each weight from the fitter parent with probability 0.5, else from the second parent."""
    return np.where(uniforms < 0.5, genome[parents[:, 0]], genome[parents[:, 1]])


def mutate(genome: Genome, evolution: Evolution, gates: Uniforms, uniforms: Uniforms) -> Genome:
    """Change a weight by U(-size, size) if the gate of the weight or child is below the rate."""
    change = ((2 * uniforms - 1) * evolution.mutation_size).astype(np.float32)
    return np.where(gates < evolution.mutation_rate, genome + change, genome)
