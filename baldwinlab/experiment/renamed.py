"""Settings, parts and conditions that were renamed after version 0.1.

Stored experiments contain old names of settings and parts, and `upgrade` translates them when they
are read. In user input an old name is an error, and `new_path`, `new_name` and `new_condition`
return the name for its message. The conditions of a stored study keep their names.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

# Kind of part -> old name of a part -> new name.
RENAMED_PARTS: Final[Mapping[str, Mapping[str, str]]] = {"network": {"growing": "neat"}}
# Old name of a condition of a built-in paper -> new name.
RENAMED_CONDITIONS: Final[Mapping[str, str]] = {
    "auto-teaching-twin": "auto-teaching-rate-0",
    "evo+self-taught-twin": "evo+self-taught-rate-0",
    "predicting-twin": "predicting-rate-0",
}
# Path of the setting that chooses a renamed part -> kind of part.
KINDS_OF_RENAMED_PARTS: Final[Mapping[str, str]] = {"network.kind": "network"}
# Path of a part's table -> its new path.
RENAMED_TABLES: Final[Mapping[str, str]] = {"network.growing": "network.neat"}
# Path of a part's table -> old name of a setting -> new name.
RENAMED_SETTINGS: Final[Mapping[str, Mapping[str, str]]] = {
    "cell_foragers": {
        "rate": "learning_rate",
        "hidden": "hidden_units",
        "moves": "steps_per_environment",
    },
    "cue_learners": {
        "accuracy": "cue_accuracy",
        "rate": "learning_rate",
    },
    "digit_readers": {
        "allotment": "trial_distribution",
        "rate": "learning_rate",
        "hidden": "hidden_units",
        "each": "tests_per_digit",
    },
    "erl_populations": {
        "longest": "max_steps",
        "founders_of": "initial_agents",
        "most": "max_agents",
        "side": "grid_size",
        "plants": "initial_plants",
        "seeds": "sprouts_per_step",
        "growth": "growth_checks_per_step",
        "carnivores": "initial_carnivores",
        "plant": "plant_energy",
        "meat": "meat_energy",
        "living": "cost_per_step",
        "newborn": "initial_energy",
        "fertile": "reproduction_threshold",
        "birth": "reproduction_cost",
        "healing": "healing_per_step",
        "bump": "wall_damage",
        "blow": "attack_damage",
        "bite": "bite_damage",
        "prey": "carnivore_meat_energy",
        "hunger": "carnivore_cost_per_step",
        "mutation": "mutation_rate",
        "range": "weight_range",
        "rate": "positive_learning_rate",
        "rate_worse": "negative_learning_rate",
    },
    "hinton_nowlan": {
        "unset": "initial_unset_share",
    },
    "moving_needle": {
        "unset": "initial_unset_share",
        "redrawn": "redrawn_loci",
    },
    "neat_poles": {
        "longest": "max_steps",
        "links": "max_links",
        "steepness": "sigmoid_slope",
        "newborn_range": "founder_weight_range",
    },
    "neat_poles_without_velocities": {
        "longest": "max_steps",
        "links": "max_links",
        "steepness": "sigmoid_slope",
        "newborn_range": "founder_weight_range",
        "proof": "endurance_steps",
    },
    "neat_xor": {
        "links": "max_links",
        "steepness": "sigmoid_slope",
        "newborn_range": "founder_weight_range",
    },
    "light_switch": {
        "coding": "encoding",
        "moves": "steps_per_life",
    },
    "nk_climbers": {
        "others": "k",
        "cost": "cost_per_bit",
    },
    "slope_climbers": {
        "rise": "slope",
        "bend": "curvature",
        "step": "learning_step",
        "start": "initial_mean",
        "spread": "initial_std",
    },
    "plastic_prisoners": {
        "first": "initial_moves",
    },
    "t_mazes": {
        "turns": "turning_points",
        "standard": "standard_neurons",
        "modulatory": "modulatory_neurons",
    },
    "senses.energy": {
        "half": "half_saturation",
    },
    "senses.nearest": {
        "of": "target_kind",
    },
    "senses.rays": {
        "of": "target_kind",
        "radius": "item_radius",
    },
    "senses.smell": {
        "of": "target_kind",
        "spread": "nostril_distance",
    },
    "motor.continuous": {
        "turn": "max_turn",
    },
    "network.neat": {
        "steepness": "sigmoid_slope",
    },
    "learning.evolved_abcd": {
        "coding": "encoding",
    },
    "learning.evolved_modulated": {
        "coding": "encoding",
    },
    "learning.imitation": {
        "whom": "teacher",
        "least": "min_items",
    },
    "world.births_and_deaths": {
        "reserve": "initial_energy",
        "upkeep": "cost_per_step",
        "oldest": "max_age",
    },
    "world.regions_in_turn": {
        "every": "steps_per_region",
        "generations": "generations_per_region",
    },
    "evolution.best_copies": {
        "share": "parent_share",
        "mated": "two_parent_share",
    },
    "evolution.species": {
        "survivors": "survival_threshold",
        "champion_of": "champion_species_size",
        "cloned": "single_parent_share",
        "between": "interspecies_mating_rate",
        "stale_after": "stagnation_generations",
        "narrows_after": "population_stagnation_generations",
    },
    "evolution.four_bit_weights": {
        "crossed": "crossover_share",
    },
    "evolution.neat": {
        "mutated": "weight_mutation_rate",
        "perturbed": "perturbation_share",
        "perturbation": "perturbation_size",
        "range": "weight_range",
        "add_node": "add_node_rate",
        "add_link": "add_link_rate",
        "stays_disabled": "disabled_link_rate",
        "excess": "excess_coefficient",
        "disjoint": "disjoint_coefficient",
        "difference": "weight_coefficient",
        "threshold": "compatibility_threshold",
    },
}


def new_path(path: str) -> str | None:
    """Return the new dotted path of a renamed setting or table, and None for any other path."""
    old_table, _, old_name = path.rpartition(".")
    table = RENAMED_TABLES.get(old_table, old_table)
    name = RENAMED_SETTINGS.get(table, {}).get(old_name, old_name)
    setting_path = f"{table}.{name}" if old_table else old_name
    # The path itself may be that of a table.
    current = RENAMED_TABLES.get(path, setting_path)
    return None if current == path else current


def new_name(kind: str, name: str) -> str | None:
    """Return the new name of a renamed part of a kind, and None for any other part."""
    return RENAMED_PARTS.get(kind, {}).get(name)


def new_condition(name: str) -> str | None:
    """Return the new name of a renamed condition, with the map of `name`, and None for others."""
    condition, slash, map_name = name.partition("/")
    current = RENAMED_CONDITIONS.get(condition)
    return None if current is None else f"{current}{slash}{map_name}"


def upgrade(tree: Mapping[str, Any], path: str = "") -> dict[str, Any]:
    """Return a stored tree of settings with today's names of parts, tables and settings.

    Parameters
    ----------
    tree
        Settings by name, with tables as nested mappings. It is not changed.
    path
        Dotted path of `tree` in the experiment.
    """
    upgraded: dict[str, Any] = {}
    for name, value in tree.items():
        old_path = f"{path}.{name}" if path else name
        current_path = new_path(old_path) or old_path
        _, _, key = current_path.rpartition(".")
        # If the tree has both names, each keeps its value.
        if key != name and key in tree:
            key = name
            current_path = old_path
        if isinstance(value, Mapping):
            upgraded[key] = upgrade(value, current_path)
        else:
            upgraded[key] = _upgrade_value(current_path, value)
    return upgraded


def _upgrade_value(path: str, value: Any) -> Any:
    if not isinstance(value, str):
        return value
    kind = KINDS_OF_RENAMED_PARTS.get(path, "")
    return new_name(kind, value) or value


def upgrade_swept(fields: Mapping[str, Any]) -> dict[str, Any]:
    """Return the swept fields of a stored sweep, by dotted path, with today's names."""
    upgraded = {}
    for old_path, values in fields.items():
        path = new_path(old_path) or old_path
        is_list = isinstance(values, list | tuple)
        upgraded[path] = [_upgrade_value(path, value) for value in values] if is_list else values
    return upgraded
