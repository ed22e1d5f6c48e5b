"""The outcome: the name of an agent's fitness in all outputs, such as "items eaten"."""

from __future__ import annotations

from collections.abc import Sequence, Set
from typing import Final

from baldwinlab.core.variables import RECORD_VARIABLES, record_variables
from baldwinlab.experiment import registry
from baldwinlab.experiment.base import BaseExperiment
from baldwinlab.experiment.miniworld import Experiment

ITEMS: Final = "items eaten"
ENERGY: Final = "energy"
FITNESS: Final = "fitness"
# With these outcomes, the measure `share` is the share of agents that eat.
FOOD_OUTCOMES: Final = (ITEMS, ENERGY)


def name_outcome(meaning: str, experiments: Sequence[BaseExperiment]) -> str:
    """Return the name of the fitness of several conditions.

    `meaning`: meaning of the recorded variable `energy`, or "" if the conditions have different
    ones. Foragers have "items eaten" if each item gives 1 and nothing costs energy, else "energy".
    A model without food has the name `meaning`. A fitness that a part defines is "fitness".

    >>> name_outcome("payoff of the strategy", [])
    'payoff of the strategy'
    >>> name_outcome("fitness of the part novelty", [])
    'fitness'
    """
    if not meaning or meaning.startswith(FITNESS + " "):
        return FITNESS
    # Only the beginning is compared, because records of earlier versions have another end.
    if not meaning.startswith(RECORD_VARIABLES["energy"].meaning.partition(" in life")[0]):
        return meaning
    return ITEMS if all(map(_counts_items, experiments)) else ENERGY


def name_food_outcome(experiments: Sequence[BaseExperiment]) -> str:
    """Return the name of the fitness of conditions, from the experiments instead of records.

    >>> evo = Experiment(world={"food": [{"x": [0, 9], "y": [0, 9], "count": 1}]})
    >>> name_food_outcome([evo]), name_food_outcome([evo.replace(learning={"cost_per_step": 1})])
    ('items eaten', 'energy')
    """
    is_energy = all(
        isinstance(experiment, Experiment) and segment.evolution.fitness == "energy"
        for experiment in experiments
        for _, segment in experiment.segments()
    )
    return name_outcome(RECORD_VARIABLES["energy"].meaning if is_energy else "", experiments)


def combine_outcomes(outcomes: Set[str]) -> str:
    """Return the common outcome of several conditions from the outcomes of all conditions.

    >>> combine_outcomes({"items eaten", "energy"}), combine_outcomes({"energy", "payoff"})
    ('energy', 'fitness')
    """
    if len(outcomes) == 1:
        return next(iter(outcomes))
    return ENERGY if outcomes <= set(FOOD_OUTCOMES) else FITNESS


def _counts_items(experiment: BaseExperiment) -> bool:
    """Return whether the fitness of an agent is the number of its eaten items."""
    if members := experiment.species_experiments():
        return all(map(_counts_items, members))
    return all(
        isinstance(segment, Experiment)
        and all(region.energy == 1 for region in segment.world.food)
        and not segment.eats.prey
        and _has_plain_features(segment)
        and segment.learning.cost_per_step == segment.learning.cost_per_change == 0
        for _, segment in experiment.segments()
    )


def _has_plain_features(experiment: Experiment) -> bool:
    """Return whether all world features are of the package, and all items of features give 1."""
    if not registry.package_parts("world feature").keys() >= set(experiment.world.features):
        return False
    features = experiment.parts("world.features")
    return all(item.energy == 1 for feature in features for item in feature.items())


def name_outcome_of(outcome: str, agent: str) -> str:
    """Return the outcome of an agent.

    >>> name_outcome_of("items eaten", "average agent"), name_outcome_of("energy", "best agent")
    ('items eaten by the average agent', 'energy of the best agent')
    """
    preposition = "by" if outcome == ITEMS else "of"
    return f"{outcome} {preposition} the {agent}"


def name_share(outcome: str) -> str:
    """Return the name of the share of agents with a positive outcome.

    >>> name_share("items eaten"), name_share("payoff")
    ('share of agents that eat', 'share of agents with fitness above 0')
    """
    if outcome in FOOD_OUTCOMES:
        return "share of agents that eat"
    return "share of agents with fitness above 0"


def describe_measures(outcome: str) -> dict[str, dict[str, str]]:
    """Return the texts `name`, `axis`, `heading` and `title` of the measures mean, best, share.

    >>> describe_measures("items eaten")["best"]["title"]
    'Items eaten by the best agent'
    """
    share = name_share(outcome)
    agents = {"mean": "average agent", "best": "best agent"}
    texts = {
        measure: {
            "name": agent.capitalize(),
            "axis": outcome,
            "heading": capitalize(outcome),
            "title": capitalize(name_outcome_of(outcome, agent)),
        }
        for measure, agent in agents.items()
    }
    share_name = "Share that eats" if outcome in FOOD_OUTCOMES else "Share above 0"
    texts["share"] = {
        "name": share_name,
        "axis": "share of the agents",
        "heading": capitalize(share),
        "title": capitalize(share),
    }
    return texts


def name_experiment_outcome(experiment: BaseExperiment) -> str:
    """Return the outcome of an experiment. The part of the model must be loaded."""
    return name_outcome(record_variables(experiment)["energy"].meaning, [experiment])


def describe_experiment_measures(experiment: BaseExperiment) -> dict[str, dict[str, str]]:
    """Return the result of `describe_measures` for an experiment."""
    return describe_measures(name_experiment_outcome(experiment))


def capitalize(text: str) -> str:
    """Return a text with an upper-case first letter. The other letters do not change.

    >>> capitalize("items eaten by NEAT")
    'Items eaten by NEAT'
    """
    return f"{text[:1].upper()}{text[1:]}"
