"""Innate and learned: what newborns of each generation eat with learning off, with learning on, and with their weights at death.

What they eat with learning off is innate; what learning adds is the gain; as evolution makes innate what had to be learned
(genetic assimilation), the innate share grows. Source: Hinton and Nowlan, "How learning can guide evolution", 1987, and
Waddington, "Genetic assimilation of an acquired character", 1953, for the ideas; the lives are ours.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from baldwinlab.core.variables import LIVES
from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.studies.assays.sample import Conditions, Sample

OfAnyModel = TypeVar("OfAnyModel", bound=BaseExperiment)
MAX_GENERATIONS = 100  # and the last, so every generation of the paper's
MAX_COSTLY_GENERATIONS = (
    10  # and the last: of drift, which takes longest, and where generations differ by chance alone
)


def coordinates(study: Conditions, condition: str) -> Mapping[str, Any]:
    experiment = study.experiments[condition]
    lived = np.array(assayed_generations(experiment), np.int32)
    return {"generation": lived, "life": list(LIVES), "layer": layer_names(experiment)}


def count_lives(study: Conditions, condition: str) -> int:
    experiment = study.experiments[condition]
    lived = len(assayed_generations(experiment))
    return 3 * lived + len(drift_generations(experiment)) if experiment.learns else 0


def measure(sample: Sample) -> Mapping[str, npt.NDArray[Any]]:
    """`energy` [run, generation, life, agent]; NaN for lives that are not lived. `distance` [run, generation, layer, agent]."""
    experiment, lived = sample.experiment, assayed_generations(sample.experiment)
    runs, agents, layers = (
        len(sample.runs),
        experiment.population.size,
        len(layer_names(experiment)),
    )
    energy = np.full((len(lived), len(LIVES), runs, agents), np.nan)
    distance = np.full((len(lived), layers, runs, agents), np.nan, np.float32)
    measure_one = _learned if experiment.learns else _innate_alone
    for number, generation in enumerate(lived):
        measure_one(sample, generation, energy[number], distance[number])
    return {"energy": np.moveaxis(energy, 2, 0), "distance": np.moveaxis(distance, 2, 0)}


def _innate_alone(
    sample: Sample, generation: int, energy: npt.NDArray[Any], distance: npt.NDArray[Any]
) -> None:
    """Agents that do not learn have one kind of life, and the study has lived it."""
    energy[LIVES.index("off")] = sample.energy(generation)


def _learned(
    sample: Sample, generation: int, energy: npt.NDArray[Any], distance: npt.NDArray[Any]
) -> None:
    """Fill `energy` [life, run, agent] and `distance` [layer, run, agent] of one generation of agents that learn."""
    genomes, without = sample.genomes(generation), sample.experiment.without_learning()
    learned = sample.simulate_as_evolved(generation, genomes)
    energy[LIVES.index("on")] = learned.energy
    energy[LIVES.index("off")] = sample.simulate(without, generation, genomes).energy
    if generation in drift_generations(sample.experiment):
        energy[LIVES.index("drift")] = sample.simulate(
            with_drift(sample.experiment), generation, genomes
        ).energy
    if not learned.has_learned_weights:
        return
    count = learned.weights.shape[-1]
    frozen = genomes.copy()
    frozen[:, :, 0, :count] = learned.weights
    energy[LIVES.index("frozen")] = sample.simulate(without, generation, frozen).energy
    distance[:] = weight_distances(sample.experiment, genomes[:, :, 0, :count], learned.weights)


def assayed_generations(experiment: BaseExperiment) -> list[int]:
    """The generations that are lived again: where nothing is inherited, a few stand for all."""
    most = (
        MAX_COSTLY_GENERATIONS
        if experiment.part("evolution.inheritance").resamples_genomes
        else MAX_GENERATIONS
    )
    return _thin(range(experiment.evolution.generations), most)


def drift_generations(experiment: BaseExperiment) -> list[int]:
    """Those of them that are lived with drift, too; none where it would be void, as it follows how far self-teaching goes."""
    if not isinstance(experiment, Experiment) or (
        experiment.learns and not experiment.part("learning.rule").supports_drift_control
    ):
        return []
    return _thin(assayed_generations(experiment), MAX_COSTLY_GENERATIONS)


def with_drift(experiment: OfAnyModel) -> OfAnyModel:
    """The same agents, which change at random by as much as they would have learned."""
    return experiment.replace(learning={"rule": "drift"})


def _thin(numbers: Sequence[int], most: int) -> list[int]:
    """All, or every so-many-th, so that they are at most so many; and the last."""
    return sorted({*numbers[:: -(-len(numbers) // most)], numbers[-1]})


def layer_names(experiment: BaseExperiment) -> list[str]:
    """What each layer of weights connects, from the sensors on; of another model, the module that learns."""
    if not isinstance(experiment, Experiment):
        return list(experiment.modules[:1])
    count = len(experiment.network.hidden)
    hidden = ["hidden"] if count == 1 else [f"hidden {number + 1}" for number in range(count)]
    units = ["sensors", *hidden, "actions"]
    return [f"{source} to {target}" for source, target in pairwise(units)]


def weight_distances(
    experiment: BaseExperiment, birth: npt.NDArray[Any], death: npt.NDArray[Any]
) -> npt.NDArray[np.float64]:
    """Euclidean distances [layer, ...] between weights [..., weight] at birth and at death, biases with their layer's."""
    counts = [birth.shape[-1]]
    if isinstance(experiment, Experiment):
        sizes, bias = experiment.layer_sizes, int(experiment.network.biases)
        counts = [(inputs + bias) * outputs for inputs, outputs in pairwise(sizes)]
    squares = (death.astype(np.float64) - birth) ** 2
    moved = [layer.sum(axis=-1) for layer in np.split(squares, np.cumsum(counts)[:-1], axis=-1)]
    euclidean: npt.NDArray[np.float64] = np.sqrt(np.stack(moved))
    return euclidean
