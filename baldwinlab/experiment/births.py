"""Settings that births during a lifetime exclude."""

from __future__ import annotations

from typing import Any


def find_birth_conflicts(experiment: Any) -> list[str]:
    """Return a sentence if the variation cannot create the children that are born during life."""
    features = [part.name for part in experiment.parts("world.features") if part.allows_births]
    if not features or experiment.part("evolution.variation").has_independent_children():
        return []
    return [
        f"world.features: {features[0]} needs a variation that creates one child at a time; "
        f"evolution.variation = {experiment.evolution.variation!r} does not"
    ]
