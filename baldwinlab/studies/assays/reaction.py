"""Assays of evolved genomes under changed settings, or with random modules.

The assay `reaction` simulates the last generation under one changed setting. The assay
`reaction-norms` measures the fitness by the amount of learning, in four generations of a run. The
amount of learning is the learning rate, or the setting that a model declares by `learning_amount`.
Newborns are simulated with multiples of this amount. The factor 0 is a lifetime without learning,
and the factor 1 is the stored lifetime.

The assay `modules` combines evolved modules of the last generation with random modules.

The intercept and the slope of a reaction norm are from R. Lande, Adaptation to an extraordinary
environment by evolution of phenotypic plasticity and genetic assimilation, Journal of Evolutionary
Biology 22 (2009).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final, NamedTuple

import numpy as np

from baldwinlab.evolution import Genome
from baldwinlab.experiment import BaseExperiment, Experiment, ExperimentError, assign
from baldwinlab.experiment.registry import table_name
from baldwinlab.studies.assays import (
    SIMULATION_OBSTACLES,
    Arrays,
    Assay,
    AssayPlan,
    Conditions,
    OnMap,
    Sample,
    declare_fitness,
    find_model_obstacle,
    list_other_maps,
    select_last_settings,
)

# Name of the unchanged setting.
UNCHANGED_SETTING = "as evolved"
# Factors by which the number of items, the visual radius and the learning rate are multiplied.
ITEM_COUNT_FACTORS = (0.25, 0.5, 2, 4)
VISUAL_RADIUS_FACTORS = (0.25, 0.5, 2)
LEARNING_RATE_FACTORS = (0, 0.1, 10)


class ChangedSetting(NamedTuple):
    """An experiment with one changed setting."""

    field: str  # Path of the changed field, or "map".
    value: str  # Name of the map, or the changed number as text.
    experiment: Experiment


def plan_settings(study: Conditions, condition: str) -> AssayPlan:
    all_settings = list_settings(study.experiments[condition], list_other_maps(study, condition))
    coordinates = {
        "setting": np.arange(len(all_settings), dtype=np.int32),
        "field": ("setting", [setting.field for setting in all_settings]),
        "value": ("setting", [setting.value for setting in all_settings]),
    }
    return AssayPlan(coordinates, len(all_settings))


def measure_settings(sample: Sample) -> Arrays:
    """Measure `energy` [run, setting, agent]."""
    last_generation = sample.experiment.evolution.generations - 1
    genomes = sample.genomes(last_generation)
    # The first setting is unchanged, so its energy is checked against the stored energy.
    _, *changed_settings = list_settings(sample.experiment, sample.other_maps)
    outcomes = [sample.simulate_as_evolved(last_generation, genomes)]
    for setting in changed_settings:
        outcomes.append(sample.simulate(setting.experiment, last_generation, genomes))
    return {"energy": np.stack([lives.energy for lives in outcomes], axis=1)}


def list_settings(experiment: Experiment, maps: Sequence[OnMap]) -> list[ChangedSetting]:
    """Return the settings of the last generation, unchanged and then with each distinct change."""
    experiment = select_last_settings(experiment)
    distinct = [ChangedSetting(UNCHANGED_SETTING, "", experiment)]
    map_changes = (ChangedSetting("map", name, on_map) for name, on_map in maps)
    for setting in (*map_changes, *_scale_settings(experiment)):
        if all(setting.experiment != earlier.experiment for earlier in distinct):
            distinct.append(setting)
    return distinct


def _scale_settings(experiment: Experiment) -> Iterator[ChangedSetting]:
    """Yield the settings with one scaled value. Values that are not valid are omitted."""
    fields: dict[str, list[float]] = {}
    for region_index, region in enumerate(experiment.world.food):
        fields[f"world.food.{region_index}.count"] = [
            round(factor * region.count) for factor in ITEM_COUNT_FACTORS
        ]
    fields["senses.visual_radius"] = [
        factor * experiment.senses.visual_radius for factor in VISUAL_RADIUS_FACTORS
    ]
    if experiment.learns:
        fields["learning.rate"] = [
            factor * experiment.learning.rate for factor in LEARNING_RATE_FACTORS
        ]
    for field, values in fields.items():
        for value in values:
            try:
                changed = assign(experiment, [f"{field}={value}"])
            except ExperimentError:
                continue
            yield ChangedSetting(field, f"{value:g}", changed)


REACTION: Final = Assay(
    name="reaction",
    question="How does fitness change if one setting changes?",
    variables={
        "energy": declare_fitness(("setting", "agent"), "fitness in this setting"),
    },
    plan=plan_settings,
    measure=measure_settings,
    obstacles=(*SIMULATION_OBSTACLES, find_model_obstacle),
    is_default=True,
    uses_other_maps=True,
)


# Number of generations at equal distances, from the first to the last.
N_GENERATIONS: Final = 4
# Multiples of the amount of learning. 0 is learning off.
LEARNING_FACTORS: Final = (0.0, 0.25, 0.5, 1.0, 2.0, 4.0)


def plan_norms(study: Conditions, condition: str) -> AssayPlan:
    experiment = study.experiments[condition]
    generations = assayed_generations(experiment)
    n_lives = sum(
        scale_learning(experiment, generation, factor) is not None
        for generation in generations
        for factor in LEARNING_FACTORS
    )
    coordinates = {
        "generation": np.array(generations, np.int32),
        "factor": np.array(LEARNING_FACTORS),
    }
    return AssayPlan(coordinates, n_lives)


def measure_norms(sample: Sample) -> Arrays:
    """Measure `energy` [run, generation, factor, agent].

    The energy is NaN if the multiple of the amount of learning is not valid.
    """
    generations = assayed_generations(sample.experiment)
    n_agents = sample.experiment.population.size
    shape = (len(sample.runs), len(generations), len(LEARNING_FACTORS), n_agents)
    energy = np.full(shape, np.nan)
    for generation_index, generation in enumerate(generations):
        genomes = sample.genomes(generation)
        for factor_index, factor in enumerate(LEARNING_FACTORS):
            changed = scale_learning(sample.experiment, generation, factor)
            if changed is None:
                continue
            fitness = sample.simulate(changed, generation, genomes).energy
            if factor == 1:
                sample.require_stored_energy(generation, fitness)
            energy[:, generation_index, factor_index] = fitness
    return {"energy": energy}


def assayed_generations(experiment: BaseExperiment) -> list[int]:
    """Return four generations at equal distances, the first and the last included."""
    last_generation = experiment.evolution.generations - 1
    return sorted({round(number) for number in np.linspace(0, last_generation, N_GENERATIONS)})


def scale_learning(experiment: Experiment, generation: int, factor: float) -> Experiment | None:
    """Return the experiment with a multiple of the amount of learning of a generation.

    The result is None if the experiment does not allow this amount.
    """
    settings = experiment.at(generation)
    if factor == 1:
        return settings
    table, field = learning_amount(experiment)
    amount = getattr(getattr(settings, table), field)
    scaled = round(factor * amount) if isinstance(amount, int) else factor * amount
    if scaled == 0:
        return settings.without_learning()
    try:
        return settings.replace(**{table: {field: scaled}})
    except ExperimentError:
        return None


def learning_amount(experiment: BaseExperiment) -> tuple[str, str]:
    """Return the table and the field of the amount of learning; the field is "" if none exists."""
    if isinstance(experiment, Experiment):
        return "learning", "rate"
    return table_name(experiment.model), experiment.model_part.learning_amount


def find_learning_obstacle(experiment: BaseExperiment) -> str:
    """Refuse conditions without an amount of learning."""
    if not experiment.learns:
        return "needs a condition that learns"
    if not learning_amount(experiment)[1]:
        return (
            f"scales a learning rate or a number of trials, and the model {experiment.model} of "
            f"{experiment.name} declares none"
        )
    return ""


REACTION_NORMS: Final = Assay(
    name="reaction-norms",
    question=("How does fitness depend on the amount of learning, early and late in evolution?"),
    variables={
        "energy": declare_fitness(
            ("generation", "factor", "agent"),
            "fitness with this multiple of the amount of learning; NaN if it is not valid",
        ),
    },
    plan=plan_norms,
    measure=measure_norms,
    obstacles=(*SIMULATION_OBSTACLES, find_learning_obstacle),
)


MODULE_COMBINATIONS = (
    "both evolved",
    "evolved reinforcement, random action",
    "random reinforcement, evolved action",
    "both random",
)


def plan_modules(study: Conditions, condition: str) -> AssayPlan:
    return AssayPlan({"modules": list(MODULE_COMBINATIONS)}, len(MODULE_COMBINATIONS))


def measure_modules(sample: Sample) -> Arrays:
    """Measure `energy` [run, modules, agent].

    An agent has the same initial position and the same random modules in all combinations.
    """
    last_generation = sample.experiment.evolution.generations - 1
    evolved = sample.genomes(last_generation)
    random = sample.random_genomes()
    # In the order of `MODULE_COMBINATIONS`. The first combination is simulated separately.
    combinations = [
        _combine_modules(action=random, reinforcement=evolved),
        _combine_modules(action=evolved, reinforcement=random),
        random,
    ]
    outcomes = [sample.simulate_as_evolved(last_generation, evolved)]
    for genomes in combinations:
        outcomes.append(sample.simulate(sample.experiment, last_generation, genomes))
    return {"energy": np.stack([lives.energy for lives in outcomes], axis=1)}


def _combine_modules(action: Genome, reinforcement: Genome) -> Genome:
    """Combine the action modules and the reinforcement modules of two arrays of genomes."""
    # The dimensions are [run, agent, module, weight]. Module 0 selects the action, and module 1 is
    # the reinforcement module.
    return np.concatenate([action[:, :, :1], reinforcement[:, :, 1:2]], axis=2)


def find_module_obstacle(experiment: BaseExperiment) -> str:
    """Refuse agents without a reinforcement module."""
    if "reinforcement" in experiment.modules:
        return ""
    return "needs agents with a reinforcement module"


MODULES: Final = Assay(
    name="modules",
    question="Which module contains the evolved information?",
    variables={
        "energy": declare_fitness(("modules", "agent"), "fitness with these modules"),
    },
    plan=plan_modules,
    measure=measure_modules,
    obstacles=(*SIMULATION_OBSTACLES, find_module_obstacle),
    is_default=True,
)
