"""Compare the speed of a part with the speed of a built-in part of its kind."""

from __future__ import annotations

import time
from typing import Any, Final

from baldwinlab.api.checks.findings import NotCheckedError
from baldwinlab.api.checks.fixture import (
    CHOICE_PATHS,
    SEED,
    PartGroup,
    is_of_miniworld,
)
from baldwinlab.experiment import assign
from baldwinlab.experiment.paths import look_up
from baldwinlab.experiment.registry import BUILT_IN
from baldwinlab.papers.presets import load
from baldwinlab.parts.part import BREEDING_KINDS, Part
from baldwinlab.simulation.simulate import simulate_batch

BASELINES: Final = {"learning rule": "self-taught"}
"""The built-in part to compare with; by default, the first one of the kind."""
N_ROUNDS: Final = 5


def measure_speed(group: PartGroup) -> str:
    """Measure the speed of a part, relative to a built-in part of its kind."""
    if not is_of_miniworld(group.experiment):
        raise NotCheckedError("there is no built-in model to compare with")
    part = group.parts[-1]
    baseline = BASELINES.get(part.kind) or next(iter(BUILT_IN[part.kind]), None)
    title = f"the built-in {part.kind} {baseline!r}" if baseline else "a world without it"
    network = {} if "network.hidden" in part.required_settings else {"network": {"hidden": [10]}}
    lifetime = {"steps": 500 if part.kind in BREEDING_KINDS else 3000}
    timed_experiment = group.experiment.replace(
        population={"size": 20}, lifetime=lifetime, **network
    )
    value = baseline
    if part.kind in ("sense", "world feature"):
        value = f'["{baseline}"]' if baseline else "[]"
    settings = [f"{CHOICE_PATHS[part.kind]}={value}", *_default_settings(part)]
    seconds, built_in_seconds = _measure_seconds(
        timed_experiment, assign(timed_experiment, settings)
    )
    return f"{built_in_seconds / seconds:.2f} times the speed of {title}"


def _default_settings(part: type[Part]) -> list[str]:
    """Return the settings that the part requires, with their defaults."""
    defaults = {path: look_up(load("evo/A"), path)[0] for path in part.required_settings}
    return [
        f"{path}={list(value) if isinstance(value, tuple) else value}"
        for path, value in defaults.items()
    ]


def _measure_seconds(*experiments: Any) -> list[float]:
    """Return the shortest of `N_ROUNDS` times of each experiment, measured in turns."""
    shortest_seconds = [float("inf")] * len(experiments)
    # The first round compiles.
    for _ in range(N_ROUNDS + 1):
        for index, experiment in enumerate(experiments):
            start = time.perf_counter()
            simulate_batch(experiment, SEED, range(4))
            shortest_seconds[index] = min(shortest_seconds[index], time.perf_counter() - start)
    return shortest_seconds
