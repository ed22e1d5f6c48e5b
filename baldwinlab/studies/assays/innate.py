"""Assay of innate and learned performance in each generation.

Newborns are simulated with learning off, with learning on, and with their weights at death. The
performance with learning off is innate. The gain is the increase by learning. In genetic
assimilation, evolution makes learned behavior innate, so the innate fraction grows.

The ideas are from G. E. Hinton and S. J. Nowlan, How learning can guide evolution, Complex Systems
1 (1987), and C. H. Waddington, Genetic assimilation of an acquired character, Evolution 7 (1953).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Any, Final, TypeVar

import numpy as np
import numpy.typing as npt

from baldwinlab.core.variables import Variable
from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.studies.assays import (
    DRIFT,
    FROZEN,
    LIFE_KINDS,
    OFF,
    ON,
    Arrays,
    Assay,
    AssayPlan,
    Conditions,
    Sample,
    declare_fitness,
    find_archive_obstacle,
    find_birth_obstacle,
    find_species_obstacle,
)

AnyExperiment = TypeVar("AnyExperiment", bound=BaseExperiment)
# Maximum number of assayed generations in addition to the last generation.
MAX_GENERATIONS = 100
# The maximum for drift, which is slow to simulate, and for generations that differ only by chance.
MAX_FEW_GENERATIONS = 10


def plan_assay(study: Conditions, condition: str) -> AssayPlan:
    experiment = study.experiments[condition]
    generations = assayed_generations(experiment)
    coordinates = {
        "generation": np.array(generations, np.int32),
        "life": list(LIFE_KINDS),
        "layer": layer_names(experiment),
    }
    # Learning off, learning on, and the weights at death without learning.
    lives_per_generation = 3
    n_lives = lives_per_generation * len(generations) + len(drift_generations(experiment))
    return AssayPlan(coordinates, n_lives if experiment.learns else 0)


def measure(sample: Sample) -> Arrays:
    """Measure `energy` and `distance` in the assayed generations."""
    return measure_generations(sample, assayed_generations(sample.experiment))


def measure_generations(sample: Sample, generations: Sequence[int]) -> Arrays:
    """Measure `energy` and `distance` in the given generations.

    `energy` has the dimensions [run, generation, life, agent], and `distance` [run, generation,
    layer, agent]. The energy is NaN for lifetimes that are not simulated.
    """
    experiment = sample.experiment
    n_runs = len(sample.runs)
    n_agents = experiment.population.size
    n_layers = len(layer_names(experiment))
    energy = np.full((len(generations), len(LIFE_KINDS), n_runs, n_agents), np.nan)
    distance = np.full((len(generations), n_layers, n_runs, n_agents), np.nan, np.float32)
    for index, generation in enumerate(generations):
        if experiment.learns:
            _measure_learners(sample, generation, energy[index], distance[index])
        else:
            # Agents that do not learn have one kind of lifetime, which is stored.
            energy[index, OFF] = sample.energy(generation)
    # [generation, life or layer, run, agent] becomes [run, generation, life or layer, agent].
    return {"energy": np.moveaxis(energy, 2, 0), "distance": np.moveaxis(distance, 2, 0)}


def _measure_learners(
    sample: Sample, generation: int, energy: npt.NDArray[Any], distance: npt.NDArray[Any]
) -> None:
    """Fill `energy` [life, run, agent] and `distance` [layer, run, agent] of a generation."""
    genomes = sample.genomes(generation)
    without_learning = sample.experiment.without_learning()
    learners = sample.simulate_as_evolved(generation, genomes)
    energy[ON] = learners.energy
    innate = sample.simulate(without_learning, generation, genomes)
    energy[OFF] = innate.energy
    # A schedule of settings can switch learning off in some generations.
    learns = sample.experiment.at(generation).learns
    if learns and generation in drift_generations(sample.experiment):
        with_drift = set_drift_control(sample.experiment)
        drifters = sample.simulate(with_drift, generation, genomes)
        energy[DRIFT] = drifters.energy
    if not learners.has_learned_weights:
        return
    n_weights = learners.weights.shape[-1]
    # Learning changes only the first module.
    birth_weights = genomes[:, :, 0, :n_weights]
    distance[:] = weight_distances(sample.experiment, birth_weights, learners.weights)
    frozen_genomes = genomes.copy()
    frozen_genomes[:, :, 0, :n_weights] = learners.weights
    frozen = sample.simulate(without_learning, generation, frozen_genomes)
    energy[FROZEN] = frozen.energy


def assayed_generations(experiment: BaseExperiment) -> list[int]:
    """Return the generations that are simulated again.

    Without inheritance, generations differ only by chance, so a few are enough.
    """
    limit = MAX_GENERATIONS
    if experiment.part("evolution.inheritance").resamples_genomes:
        limit = MAX_FEW_GENERATIONS
    return _thin(range(experiment.evolution.generations), limit)


def drift_generations(experiment: BaseExperiment) -> list[int]:
    """Return the generations that are also simulated with drift.

    The list is empty if the learning rule does not support a drift control.
    """
    if not isinstance(experiment, Experiment):
        return []
    if experiment.learns and not experiment.part("learning.rule").supports_drift_control:
        return []
    return _thin(assayed_generations(experiment), MAX_FEW_GENERATIONS)


def set_drift_control(experiment: AnyExperiment) -> AnyExperiment:
    """Return the experiment with random weight changes of the same size instead of learning."""
    return experiment.replace(learning={"rule": "self-taught", "control": "drift"})


def _thin(numbers: Sequence[int], limit: int) -> list[int]:
    """Return at most `limit` numbers at equal distances, and the last number."""
    step = math.ceil(len(numbers) / limit)
    return sorted({*numbers[::step], numbers[-1]})


def layer_names(experiment: BaseExperiment) -> list[str]:
    """Return the names of the layers of weights: ["sensors to hidden", "hidden to actions"]."""
    # In other models than MiniWorld, the first module is the only layer.
    if not isinstance(experiment, Experiment):
        return list(experiment.modules[:1])
    n_hidden_layers = len(experiment.network.hidden)
    hidden = [f"hidden {number}" for number in range(1, n_hidden_layers + 1)]
    if n_hidden_layers == 1:
        hidden = ["hidden"]
    unit_layers = ["sensors", *hidden, "actions"]
    return [f"{source} to {target}" for source, target in pairwise(unit_layers)]


def weight_distances(
    experiment: BaseExperiment, birth: npt.NDArray[Any], death: npt.NDArray[Any]
) -> npt.NDArray[np.float64]:
    """Return the Euclidean distance of the weights of each layer between birth and death.

    `birth`, `death`: [..., weight]. Returns [layer, ...].
    """
    layer_weights = [birth.shape[-1]]
    if isinstance(experiment, Experiment):
        n_biases = int(experiment.network.biases)
        layer_weights = [
            (n_inputs + n_biases) * n_outputs
            for n_inputs, n_outputs in pairwise(experiment.layer_sizes)
        ]
    squares = (death.astype(np.float64) - birth) ** 2
    layer_bounds = np.cumsum(layer_weights)[:-1]
    squares_by_layer = np.split(squares, layer_bounds, axis=-1)
    sums = [layer_squares.sum(axis=-1) for layer_squares in squares_by_layer]
    distances: npt.NDArray[np.float64] = np.sqrt(np.stack(sums))
    return distances


def find_fitness_obstacle(experiment: BaseExperiment) -> str:
    """Refuse a fitness that a simulation cannot repeat. Without learning, nothing is simulated."""
    return find_archive_obstacle(experiment) if experiment.learns else ""


def list_variants(experiment: BaseExperiment) -> Iterator[BaseExperiment]:
    """Yield the drift control, if the assay simulates it."""
    if experiment.learns and drift_generations(experiment):
        yield set_drift_control(experiment)


ASSAY: Final = Assay(
    name="innate",
    question="How much of the fitness is innate, and how much is learned?",
    variables={
        "energy": declare_fitness(
            ("generation", "life", "agent"), "fitness in this kind of lifetime"
        ),
        "distance": Variable(
            ("run", "generation", "layer", "agent"),
            np.float32,
            "1",
            "distance of the weights of a layer between birth and death",
        ),
    },
    plan=plan_assay,
    measure=measure,
    obstacles=(find_fitness_obstacle, find_birth_obstacle, find_species_obstacle),
    is_default=True,
    variants=list_variants,
)
