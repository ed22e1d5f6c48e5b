"""Assays of a neutral control: of selection, and of assimilation by learning.

The assay `neutral` compares newborns of selected parents and of randomly chosen parents. The
control has the same founders, mutations and initial positions as the run. A difference in
performance between the newborns is therefore an effect of selection. Performance does not decide
which agents reproduce, so the control needs no simulation unless learned weights are inherited.

The assay `assimilation` measures the distance that genomes of three histories learn. Genomes of the
first and of the last generations are simulated with learning on. The genomes of learners are
compared with two controls of the same run: genomes that evolved without learning, and genomes that
evolved without selection. The learned distance can fall in the controls, too, by mutation or by
selection on innate fitness. Only the further fall in learners is an effect of learning on
evolution. If the study has no control without learning, the assay simulates it from the founders
of each run.

The neutral model as a baseline is from M. Kimura, Evolutionary rate at the molecular level, Nature
217 (1968).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from baldwinlab.core.deferred import xr
from baldwinlab.core.variables import Variable
from baldwinlab.evolution import (
    Genome,
    apply_inheritance,
    make_founders,
    make_generation,
    make_run_keys,
)
from baldwinlab.experiment import BaseExperiment, Experiment, ExperimentError
from baldwinlab.experiment.conditions import find_control
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
from baldwinlab.studies.assays.fork import find_evolution_obstacle, fit_genomes, simulate_control
from baldwinlab.studies.assays.innate import weight_distances

# Maximum number of compared generations. One generation depends much on its initial positions.
MAX_GENERATIONS = 10
# Labels of evolved newborns, and of newborns with random parents.
NEWBORNS: Final = ("evolved", "neutral control")


def plan_neutral(study: Conditions, condition: str) -> AssayPlan:
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


def measure_neutral(sample: Sample) -> Arrays:
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


NEUTRAL: Final = Assay(
    name="neutral",
    question="Did selection produce the behavior, or did it arise by chance?",
    variables={
        "energy": declare_fitness(
            ("generation", "newborns", "life", "agent"),
            "fitness of these newborns in this kind of lifetime",
        ),
    },
    plan=plan_neutral,
    measure=measure_neutral,
    obstacles=(*SIMULATION_OBSTACLES, find_selection_obstacle),
    is_default=True,
    variants=list_variants,
)


# Number of measured generations in the first and in the last window.
WINDOW: Final = 10
# Genomes that evolved with learning, without learning, and without selection.
HISTORIES: Final = ("learner", "control", "neutral")


def choose_generations(experiment: BaseExperiment) -> list[int]:
    """Return the first and the last generations. The two windows do not overlap."""
    n_generations = experiment.evolution.generations
    length = max(1, min(WINDOW, n_generations // 2))
    return sorted({*range(length), *range(n_generations - length, n_generations)})


def plan_assimilation(study: Conditions, condition: str) -> AssayPlan:
    experiment = study.experiments[condition]
    generations = choose_generations(experiment)
    has_control = bool(find_control(condition, study.experiments))
    lives_of_control = 0 if has_control else experiment.evolution.generations
    return AssayPlan(
        {"generation": np.array(generations, np.int32), "history": list(HISTORIES)},
        lives_of_control + len(HISTORIES) * len(generations),
    )


def measure_assimilation(sample: Sample) -> Arrays:
    """Measure `distance` [run, generation, history] in the first and the last generations."""
    return measure_distances(sample, choose_generations(sample.experiment))


def measure_distances(sample: Sample, generations: Sequence[int]) -> Arrays:
    """Measure `distance` [run, generation, history], the mean over agents.

    The distance is NaN if the model has neither a learned distance nor learned weights, and for the
    neutral history of a selection without a neutral control.
    """
    control = sample.control or simulate_control(sample)
    neutral = _evolve_neutral(sample, generations)
    distance = np.full((len(sample.runs), len(generations), len(HISTORIES)), np.nan)
    for index, generation in enumerate(generations):
        learners = sample.genomes(generation)
        outcomes = sample.simulate_as_evolved(generation, learners)
        distance[:, index, 0] = _average_distance(sample.experiment, learners, outcomes)
        controls = [fit_genomes(control.genomes(generation), sample), neutral.get(generation)]
        for history, genomes in enumerate(controls, start=1):
            if genomes is not None:
                outcomes = sample.simulate(sample.experiment, generation, genomes)
                distance[:, index, history] = _average_distance(
                    sample.experiment, genomes, outcomes
                )
    return {"distance": distance}


def _evolve_neutral(sample: Sample, generations: Sequence[int]) -> dict[int, Genome]:
    """Return the genomes of the control without selection, by generation, or an empty dict."""
    try:
        neutral = sample.experiment.neutral_control()
    except ExperimentError:
        return {}  # The selection has no neutral control.
    genomes = make_founders(sample.experiment, make_run_keys(sample.seed, sample.runs, 0))
    selected = {}
    for generation in range(generations[-1] + 1):
        if generation in generations:
            selected[generation] = genomes
        genomes = make_next_controls(sample, neutral, generation, genomes, None)
    return selected


def _average_distance(
    experiment: BaseExperiment, genomes: Genome, outcomes: Outcomes
) -> npt.NDArray[np.float64] | float:
    """Return the mean distance [run] that agents learn, or NaN if it is not defined."""
    model = experiment.loaded_model
    name = model.learned_distance if model is not None else ""
    if model is None or not name:
        if not outcomes.has_learned_weights:
            return np.nan
        birth = genomes[:, :, 0, : outcomes.weights.shape[-1]]
        layers = weight_distances(experiment, birth, outcomes.weights)
        # The layers are parts of one vector, so the squares add up.
        return np.asarray(np.sqrt((layers**2).sum(axis=0)).mean(axis=-1))
    records = {key: (("run", "agent"), values) for key, values in outcomes.records.items()}
    runs = xr.Dataset(records)
    if name in model.shares:
        return np.asarray(model.shares[name].of(runs).values, np.float64)
    return np.asarray(runs[name].astype(np.float64).mean("agent").values)


def find_inheritance_obstacle(experiment: BaseExperiment) -> str:
    """Refuse conditions in which children inherit what their parents have learned."""
    if not inherits_learned(experiment):
        return ""
    return "measures what becomes innate by evolution, but children inherit learned weights"


ASSIMILATION: Final = Assay(
    name="assimilation",
    question="Does the distance that agents learn fall more than in evolution without learning?",
    variables={
        "distance": Variable(
            ("run", "generation", "history"),
            np.float64,
            "1",
            "distance that learning covers, mean over agents",
        ),
    },
    plan=plan_assimilation,
    measure=measure_assimilation,
    obstacles=(*SIMULATION_OBSTACLES, find_evolution_obstacle, find_inheritance_obstacle),
    uses_control=True,
    # The records of the learner and of the control.
    n_records=2,
)
