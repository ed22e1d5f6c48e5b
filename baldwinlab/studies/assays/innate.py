"""Assay of innate and learned performance in each generation.

Newborns are simulated with learning off, with learning on, and with their weights at death. The
performance with learning off is innate. The gain is the increase by learning. In genetic
assimilation, evolution makes learned behavior innate, so the innate share grows.

The ideas are from G. E. Hinton and S. J. Nowlan, How learning can guide evolution, Complex Systems
1 (1987), and C. H. Waddington, Genetic assimilation of an acquired character, Evolution 7 (1953).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from baldwinlab.core.variables import LIFE_KINDS
from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.studies.assays.sample import Conditions, Sample

OfAnyModel = TypeVar("OfAnyModel", bound=BaseExperiment)
# Maximum number of generations in addition to the last one.
MAX_GENERATIONS = 100
# Maximum for drift, which is slow, and for generations that differ only by chance.
MAX_COSTLY_GENERATIONS = 10


def coordinates(study: Conditions, condition: str) -> Mapping[str, Any]:
    experiment = study.experiments[condition]
    generations = np.array(assayed_generations(experiment), np.int32)
    return {"generation": generations, "life": list(LIFE_KINDS), "layer": layer_names(experiment)}


def count_lives(study: Conditions, condition: str) -> int:
    experiment = study.experiments[condition]
    if not experiment.learns:
        return 0
    return 3 * len(assayed_generations(experiment)) + len(drift_generations(experiment))


def measure(sample: Sample) -> Mapping[str, npt.NDArray[Any]]:
    """Measure `energy` and `distance`.

    `energy` has the dimensions [run, generation, life, agent], and `distance` [run, generation,
    layer, agent]. The energy is NaN for lifetimes that are not simulated.
    """
    experiment = sample.experiment
    generations = assayed_generations(experiment)
    runs = len(sample.runs)
    agents = experiment.population.size
    layers = len(layer_names(experiment))
    energy = np.full((len(generations), len(LIFE_KINDS), runs, agents), np.nan)
    distance = np.full((len(generations), layers, runs, agents), np.nan, np.float32)
    measure_generation = _measure_learners if experiment.learns else _copy_stored_energy
    for number, generation in enumerate(generations):
        measure_generation(sample, generation, energy[number], distance[number])
    return {"energy": np.moveaxis(energy, 2, 0), "distance": np.moveaxis(distance, 2, 0)}


def _copy_stored_energy(
    sample: Sample, generation: int, energy: npt.NDArray[Any], distance: npt.NDArray[Any]
) -> None:
    """Copy the stored energy: agents that do not learn have one kind of lifetime."""
    energy[LIFE_KINDS.index("off")] = sample.energy(generation)


def _measure_learners(
    sample: Sample, generation: int, energy: npt.NDArray[Any], distance: npt.NDArray[Any]
) -> None:
    """Fill `energy` [life, run, agent] and `distance` [layer, run, agent] of a generation."""
    genomes = sample.genomes(generation)
    without = sample.experiment.without_learning()
    learned = sample.simulate_as_evolved(generation, genomes)
    energy[LIFE_KINDS.index("on")] = learned.energy
    energy[LIFE_KINDS.index("off")] = sample.simulate(without, generation, genomes).energy
    if generation in drift_generations(sample.experiment):
        energy[LIFE_KINDS.index("drift")] = sample.simulate(
            set_drift_rule(sample.experiment), generation, genomes
        ).energy
    if not learned.has_learned_weights:
        return
    count = learned.weights.shape[-1]
    frozen = genomes.copy()
    frozen[:, :, 0, :count] = learned.weights
    energy[LIFE_KINDS.index("frozen")] = sample.simulate(without, generation, frozen).energy
    distance[:] = weight_distances(sample.experiment, genomes[:, :, 0, :count], learned.weights)


def assayed_generations(experiment: BaseExperiment) -> list[int]:
    """Return the generations that are simulated again.

    Without inheritance, generations differ only by chance, so a few are enough.
    """
    limit = MAX_GENERATIONS
    if experiment.part("evolution.inheritance").resamples_genomes:
        limit = MAX_COSTLY_GENERATIONS
    return _thin(range(experiment.evolution.generations), limit)


def drift_generations(experiment: BaseExperiment) -> list[int]:
    """Return the generations that are also simulated with drift.

    The list is empty if the learning rule does not support a drift control.
    """
    if not isinstance(experiment, Experiment) or (
        experiment.learns and not experiment.part("learning.rule").supports_drift_control
    ):
        return []
    return _thin(assayed_generations(experiment), MAX_COSTLY_GENERATIONS)


def set_drift_rule(experiment: OfAnyModel) -> OfAnyModel:
    """Return the experiment with random weight changes as large as those of learning."""
    return experiment.replace(learning={"rule": "drift"})


def _thin(numbers: Sequence[int], limit: int) -> list[int]:
    """Return at most `limit` equally spaced numbers, and the last number."""
    # Division that rounds up.
    step = -(-len(numbers) // limit)
    return sorted({*numbers[::step], numbers[-1]})


def layer_names(experiment: BaseExperiment) -> list[str]:
    """Return the names of the layers of weights. Other models have one layer, the first module."""
    if not isinstance(experiment, Experiment):
        return list(experiment.modules[:1])
    count = len(experiment.network.hidden)
    hidden = ["hidden"] if count == 1 else [f"hidden {number + 1}" for number in range(count)]
    units = ["sensors", *hidden, "actions"]
    return [f"{source} to {target}" for source, target in pairwise(units)]


def weight_distances(
    experiment: BaseExperiment, birth: npt.NDArray[Any], death: npt.NDArray[Any]
) -> npt.NDArray[np.float64]:
    """Compute the distance of weights between birth and death.

    Parameters
    ----------
    experiment : BaseExperiment
        The experiment, which determines the layers.
    birth, death : ndarray, shape (..., weight)
        Weights at birth and at death.

    Returns
    -------
    ndarray of float, shape (layer, ...)
        Euclidean distances; biases belong to their layer.
    """
    counts = [birth.shape[-1]]
    if isinstance(experiment, Experiment):
        sizes = experiment.layer_sizes
        bias = int(experiment.network.biases)
        counts = [(inputs + bias) * outputs for inputs, outputs in pairwise(sizes)]
    squares = (death.astype(np.float64) - birth) ** 2
    moved = [layer.sum(axis=-1) for layer in np.split(squares, np.cumsum(counts)[:-1], axis=-1)]
    euclidean: npt.NDArray[np.float64] = np.sqrt(np.stack(moved))
    return euclidean
