"""The neutral twin: the last newborns beside those that would have been born had parents been drawn at random.

What newborns gain with learning off, and what learning adds to it, selection has built as far as it is more than their twins'
do: founders, mutations and the places of birth are the same, run by run. Nobody's gain decides who breeds, so the twin is bred
without living, unless what is learned is inherited. Source: Kimura, "Evolutionary rate at the molecular level", 1968, for
evolution without selection as what selection is held against.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from baldwinlab.core.variables import LIVES, NEWBORNS
from baldwinlab.evolution import (
    GenerationKey,
    Genome,
    draw_genomes,
    inherit_genomes,
    make_generation,
)
from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.simulation.reevaluation import Outcomes
from baldwinlab.studies.assays.sample import Conditions, Sample

MAX_GENERATIONS = (
    10  # generations, or as many as there are: one is at the mercy of where it is born
)
OFF, ON = (LIVES.index(life) for life in ("off", "on"))


def coordinates(study: Conditions, condition: str) -> Mapping[str, Any]:
    lived = np.array(assayed_generations(study.experiments[condition]), np.int32)
    return {"generation": lived, "newborns": list(NEWBORNS), "life": [LIVES[OFF], LIVES[ON]]}


def count_lives(study: Conditions, condition: str) -> int:
    experiment = study.experiments[condition]
    compared = len(assayed_generations(experiment))
    learning_twins = experiment.evolution.generations if _inherits_learned(experiment) else compared
    return 2 * compared + learning_twins if experiment.learns else compared


def measure(sample: Sample) -> Mapping[str, npt.NDArray[Any]]:
    """`energy` [run, generation, newborns, life, agent]; NaN for learning on where nobody learns."""
    experiment, compared = sample.experiment, assayed_generations(sample.experiment)
    shape = (len(compared), len(NEWBORNS), 2, len(sample.runs), experiment.population.size)
    energy = np.full(shape, np.nan)
    twin = experiment.neutral_control()
    twins = np.stack(
        [draw_genomes(experiment, GenerationKey(sample.seed, run, 0)) for run in sample.runs]
    )
    for generation in range(experiment.evolution.generations):
        learned = None
        if experiment.learns and (generation in compared or _inherits_learned(experiment)):
            learned = sample.simulate(experiment, generation, twins)
        if generation in compared:
            _compare(sample, generation, twins, learned, energy[generation - compared[0]])
        twins = _next_controls(sample, twin, generation, twins, learned)
    return {"energy": np.moveaxis(energy, 3, 0)}


def _compare(
    sample: Sample,
    generation: int,
    twins: Genome,
    learned: Outcomes | None,
    energy: npt.NDArray[Any],
) -> None:
    """Fill `energy` [newborns, life, run, agent] of one generation; `learned` is what became of twins that learn."""
    own, other = energy
    without = sample.experiment.without_learning()
    other[OFF] = sample.simulate(without, generation, twins).energy
    if (
        learned is None
    ):  # agents that do not learn have one kind of life, and the study has lived it
        own[OFF] = sample.energy(generation)
        return
    own[ON], other[ON] = sample.energy(generation), learned.energy
    own[OFF] = sample.simulate(without, generation, sample.genomes(generation)).energy


def _next_controls(
    sample: Sample, twin: Experiment, generation: int, twins: Genome, learned: Outcomes | None
) -> Genome:
    """The twin's next generation, [run, agent, module, weight]; of two parents none is the fitter, or it would be no twin."""
    alike = np.zeros(twin.population.size)
    passed_on = [None] * len(sample.runs) if learned is None else learned.weights
    return np.stack(
        [
            make_generation(
                twin,
                GenerationKey(sample.seed, run, generation + 1),
                inherit_genomes(twin, genome, weights),
                alike,
            )[0]
            for run, genome, weights in zip(sample.runs, twins, passed_on, strict=True)
        ]
    )


def assayed_generations(experiment: BaseExperiment) -> list[int]:
    """The last ones, in which newborns are compared."""
    return list(range(experiment.evolution.generations))[-MAX_GENERATIONS:]


def _inherits_learned(experiment: BaseExperiment) -> bool:
    return bool(experiment.part("evolution.inheritance").wants_learned(experiment))
