"""Settings of MiniWorld that exclude each other: worlds, lifetimes, births and controls."""

from __future__ import annotations

from typing import Any


def count_worlds(experiment: Any) -> int:
    """Return the number of worlds that MiniWorld simulates in a generation of one run."""
    n_worlds: int = experiment.lifetime.repeats * experiment.population.worlds
    return n_worlds


def find_world_conflicts(experiment: Any) -> list[str]:
    """Return a sentence for each setting of worlds and lifetimes that other settings exclude."""
    worlds = experiment.population.worlds
    repeats = experiment.lifetime.repeats
    interval = experiment.record.every
    several = {"population.worlds": worlds, "lifetime.repeats": repeats}
    conflicts = []
    for path, value in several.items():
        if value > 1 and experiment.population.species:
            conflicts.append(f"{path} = {value} must be 1, because species share a world")
        elif value > 1 and experiment.births_in_life:
            conflicts.append(
                f"{path} = {value} must be 1, because world.features has births during life, "
                "which are births of one world and one lifetime"
            )
    if interval is not None and experiment.population.species:
        conflicts.append(
            f"record.every = {interval} must be left out, because the time series of several "
            "species are not recorded"
        )
    inheritance = experiment.evolution.inheritance
    if repeats > 1 and experiment.part("evolution.inheritance").wants_learned(experiment):
        conflicts.append(
            f"lifetime.repeats = {repeats} must be 1, because evolution.inheritance = "
            f"{inheritance!r} uses the learned weights of one lifetime"
        )
    return conflicts


def find_birth_conflicts(experiment: Any) -> list[str]:
    """Return a sentence if the variation cannot create the children that are born during life."""
    features = [part.name for part in experiment.parts("world.features") if part.allows_births]
    if not features or experiment.part("evolution.variation").has_independent_children():
        return []
    return [
        f"world.features: {features[0]} needs a variation that creates one child at a time; "
        f"evolution.variation = {experiment.evolution.variation!r} does not"
    ]


def find_control_conflicts(experiment: Any) -> list[str]:
    """Return a sentence if other settings exclude the control of the learning rule."""
    control = experiment.learning.control
    learning_of_species = [
        species.settings.get("learning", {}) for species in experiment.population.species
    ]
    has_yoked_species = any(
        learning.get("control", control) == "yoked" for learning in learning_of_species
    )
    if has_yoked_species:
        reason = "must not be used with population.species, whose sizes can change"
        return [f"learning.control = 'yoked' {reason}"]
    if control != "yoked" or experiment.learning.rule == "none":
        return []
    setting = f"learning.control = {control!r}"
    yoked = f"{setting} gives each agent the weight changes of another agent of its world"
    if experiment.agents_per_world < 2:
        return [f"{yoked}: population.size / population.worlds must be at least 2"]
    if experiment.lifetime.update == "sequential":
        return [f"{yoked} at the same time: lifetime.update must be 'simultaneous'"]
    if experiment.births_in_life or experiment.has_deaths:
        return [f"{yoked}: world.features must have no births or deaths during life"]
    return []
