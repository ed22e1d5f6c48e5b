"""Assay of the neutral control: newborns of selected parents and of randomly chosen parents.

The control has the same founders, mutations and initial positions as the run. A difference in
performance between the newborns is therefore an effect of selection. Performance does not decide
which agents reproduce, so the control needs no simulation unless learned weights are inherited.

The neutral model as a baseline is from M. Kimura, Evolutionary rate at the molecular level, Nature
217 (1968).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from baldwinlab.core.variables import LIFE_KINDS, NEUTRAL_NEWBORNS
from baldwinlab.evolution import (
    GenerationKey,
    Genome,
    apply_inheritance,
    make_founders,
    make_generation,
)
from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.simulation.reevaluation import Outcomes
from baldwinlab.studies.assays.sample import Conditions, Sample

# Number of compared generations. The performance of a single one depends on initial positions.
MAX_GENERATIONS = 10
OFF, ON = (LIFE_KINDS.index(life) for life in ("off", "on"))


def coordinates(study: Conditions, condition: str) -> Mapping[str, Any]:
    generations = np.array(assayed_generations(study.experiments[condition]), np.int32)
    return {
        "generation": generations,
        "newborns": list(NEUTRAL_NEWBORNS),
        "life": [LIFE_KINDS[OFF], LIFE_KINDS[ON]],
    }


def count_lives(study: Conditions, condition: str) -> int:
    experiment = study.experiments[condition]
    compared = len(assayed_generations(experiment))
    if not experiment.learns:
        return compared
    if _inherits_learned(experiment):
        return 2 * compared + experiment.evolution.generations
    return 3 * compared


def measure(sample: Sample) -> Mapping[str, npt.NDArray[Any]]:
    """Measure `energy` [run, generation, newborns, life, agent].

    The energy with learning on is NaN if agents do not learn.
    """
    experiment = sample.experiment
    compared = assayed_generations(experiment)
    shape = (len(compared), len(NEUTRAL_NEWBORNS), 2, len(sample.runs), experiment.population.size)
    energy = np.full(shape, np.nan)
    control = experiment.neutral_control()
    genomes = np.stack(
        [make_founders(experiment, GenerationKey(sample.seed, run, 0)) for run in sample.runs]
    )
    for generation in range(experiment.evolution.generations):
        learned = None
        if experiment.learns and (generation in compared or _inherits_learned(experiment)):
            learned = sample.simulate(experiment, generation, genomes)
        if generation in compared:
            _compare(sample, generation, genomes, learned, energy[generation - compared[0]])
        genomes = _next_controls(sample, control, generation, genomes, learned)
    return {"energy": np.moveaxis(energy, 3, 0)}


def _compare(
    sample: Sample,
    generation: int,
    controls: Genome,
    learned: Outcomes | None,
    energy: npt.NDArray[Any],
) -> None:
    """Fill `energy` [newborns, life, run, agent]; `learned` has the outcomes of the controls."""
    evolved_energy, control_energy = energy
    without = sample.experiment.without_learning()
    control_energy[OFF] = sample.simulate(without, generation, controls).energy
    if learned is None:
        # Agents that do not learn have one kind of lifetime, which is stored.
        evolved_energy[OFF] = sample.energy(generation)
        return
    evolved_energy[ON] = sample.energy(generation)
    control_energy[ON] = learned.energy
    evolved_energy[OFF] = sample.simulate(without, generation, sample.genomes(generation)).energy


def _next_controls(
    sample: Sample, control: Experiment, generation: int, genomes: Genome, learned: Outcomes | None
) -> Genome:
    """Return the next generation of the control, [run, agent, module, weight]."""
    # Equal fitness: no parent counts as the fitter one.
    fitness = np.zeros(control.population.size)
    learned_weights = [None] * len(sample.runs) if learned is None else learned.weights
    return np.stack(
        [
            make_generation(
                control,
                GenerationKey(sample.seed, run, generation + 1),
                apply_inheritance(control, genome, weights),
                fitness,
            )[0]
            for run, genome, weights in zip(sample.runs, genomes, learned_weights, strict=True)
        ]
    )


def assayed_generations(experiment: BaseExperiment) -> list[int]:
    """Return the last generations, whose newborns are compared."""
    return list(range(experiment.evolution.generations))[-MAX_GENERATIONS:]


def _inherits_learned(experiment: BaseExperiment) -> bool:
    return bool(experiment.part("evolution.inheritance").wants_learned(experiment))
