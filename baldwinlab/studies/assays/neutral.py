"""Assay of the neutral control: newborns of selected parents and of randomly chosen parents.

The control has the same founders, mutations and initial positions as the run. A difference in
performance between the newborns is therefore an effect of selection. Performance does not decide
which agents reproduce, so the control needs no simulation unless learned weights are inherited.

The neutral model as a baseline is from M. Kimura, Evolutionary rate at the molecular level, Nature
217 (1968).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from baldwinlab.evolution import (
    Genome,
    apply_inheritance,
    make_founders,
    make_generation,
    make_run_keys,
)
from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.simulation.reevaluation import Outcomes
from baldwinlab.studies.assays import (
    LIFE_KINDS,
    OFF,
    ON,
    SIMULATION_OBSTACLES,
    Arrays,
    Assay,
    AssayPlan,
    Conditions,
    Sample,
    declare_fitness,
)

# Maximum number of compared generations. One generation depends much on its initial positions.
MAX_GENERATIONS = 10
# Labels of evolved newborns, and of newborns with random parents.
NEWBORNS: Final = ("evolved", "neutral control")


def plan_assay(study: Conditions, condition: str) -> AssayPlan:
    experiment = study.experiments[condition]
    compared = assayed_generations(experiment)
    coordinates = {
        "generation": np.array(compared, np.int32),
        "newborns": list(NEWBORNS),
        "life": [LIFE_KINDS[OFF], LIFE_KINDS[ON]],
    }
    # The control is simulated without learning.
    n_lives = len(compared)
    if experiment.learns:
        # The evolved newborns are simulated without learning, and the control with learning.
        n_lives += len(compared)
        inherits = inherits_learned(experiment)
        n_lives += experiment.evolution.generations if inherits else len(compared)
    return AssayPlan(coordinates, n_lives)


def measure(sample: Sample) -> Arrays:
    """Measure `energy` [run, generation, newborns, life, agent].

    The energy with learning on is NaN if agents do not learn.
    """
    experiment = sample.experiment
    compared = assayed_generations(experiment)
    n_life_kinds = len((OFF, ON))
    n_agents = experiment.population.size
    shape = (len(compared), len(NEWBORNS), n_life_kinds, len(sample.runs), n_agents)
    energy = np.full(shape, np.nan)  # [generation, newborns, life, run, agent].
    control = experiment.neutral_control()
    genomes = make_founders(experiment, make_run_keys(sample.seed, sample.runs, 0))
    for generation in range(experiment.evolution.generations):
        is_compared = generation in compared
        learners = None
        if experiment.learns and (is_compared or inherits_learned(experiment)):
            learners = sample.simulate(experiment, generation, genomes)
        if is_compared:
            index = compared.index(generation)
            _compare(sample, generation, genomes, learners, energy[index])
        genomes = make_next_controls(sample, control, generation, genomes, learners)
    run_dimension = 3
    return {"energy": np.moveaxis(energy, run_dimension, 0)}


def _compare(
    sample: Sample,
    generation: int,
    controls: Genome,
    learners: Outcomes | None,
    energy: npt.NDArray[Any],
) -> None:
    """Fill `energy` [newborns, life, run, agent]; `learners` are the controls with learning on."""
    # Views of `energy`, in the order of `NEWBORNS`.
    evolved_energy, control_energy = energy
    without_learning = sample.experiment.without_learning()
    control_energy[OFF] = sample.simulate(without_learning, generation, controls).energy
    if learners is None:
        # Agents that do not learn have one kind of lifetime, which is stored.
        evolved_energy[OFF] = sample.energy(generation)
        return
    evolved_energy[ON] = sample.energy(generation)
    control_energy[ON] = learners.energy
    evolved = sample.genomes(generation)
    evolved_energy[OFF] = sample.simulate(without_learning, generation, evolved).energy


def make_next_controls(
    sample: Sample, control: Experiment, generation: int, genomes: Genome, learners: Outcomes | None
) -> Genome:
    """Return the next generation of the control, [run, agent, module, weight].

    The control of a run that stopped does not evolve further than the run.
    """
    # Equal fitness: no parent counts as the fitter one.
    fitness = np.zeros(genomes.shape[:2])
    learned_weights = None if learners is None else learners.weights
    inherited = apply_inheritance(control.at(generation), genomes, learned_weights)
    keys = make_run_keys(sample.seed, sample.runs, generation + 1)
    children, _ = make_generation(control, keys, inherited, fitness)
    continues = sample.has_generation(generation + 1)
    return np.where(continues[:, None, None, None], children, genomes)


def assayed_generations(experiment: BaseExperiment) -> list[int]:
    """Return the last generations of a run. Their newborns are compared."""
    return list(range(experiment.evolution.generations))[-MAX_GENERATIONS:]


def inherits_learned(experiment: BaseExperiment) -> bool:
    """Return whether learned weights are inherited in any generation."""
    return any(
        segment.part("evolution.inheritance").wants_learned(segment)
        for _, segment in experiment.segments()
    )


def find_selection_obstacle(experiment: BaseExperiment) -> str:
    """Refuse conditions without inherited genomes or without selection."""
    if experiment.evolution.inheritance == "none":
        return "measures effects of selection, which needs inherited genomes"
    if experiment.evolution.selection == "neutral":
        return "measures effects of selection, but parents are chosen at random"
    return ""


def list_variants(experiment: BaseExperiment) -> Iterator[BaseExperiment]:
    """Yield the neutral control."""
    yield experiment.neutral_control()


ASSAY: Final = Assay(
    name="neutral",
    question="Did selection produce the behavior, or did it arise by chance?",
    variables={
        "energy": declare_fitness(
            ("generation", "newborns", "life", "agent"),
            "fitness of these newborns in this kind of lifetime",
        ),
    },
    plan=plan_assay,
    measure=measure,
    obstacles=(*SIMULATION_OBSTACLES, find_selection_obstacle),
    is_default=True,
    variants=list_variants,
)
