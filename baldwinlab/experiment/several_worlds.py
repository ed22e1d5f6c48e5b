"""Settings of several worlds or lifetimes that other settings exclude."""

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
