"""Conflicts of the setting `learning.control` with other settings of MiniWorld."""

from __future__ import annotations

from typing import Any


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
