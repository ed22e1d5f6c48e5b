"""A part's speed beside the built-in one of its kind, in one run of this process."""

from __future__ import annotations

import time
from typing import Any, Final

from baldwinlab.api.checks.findings import NotCheckedError
from baldwinlab.api.checks.fixture import BREEDS, PATHS, SEED, Subject, is_of_miniworld
from baldwinlab.experiment import assign
from baldwinlab.experiment.paths import look_up
from baldwinlab.experiment.registry import BUILT_IN
from baldwinlab.papers.presets import load
from baldwinlab.parts.agent_parts import Part
from baldwinlab.simulation.simulate import simulate_batch

BESIDE: Final = {"learning rule": "self-taught"}  # else the first of the kind
ROUNDS: Final = 5


def speed(subject: Subject) -> str:
    if not is_of_miniworld(subject.experiment):
        raise NotCheckedError("there is no built-in model like it")
    part = subject.parts[-1]
    beside = BESIDE.get(part.kind) or next(iter(BUILT_IN[part.kind]), None)
    of_kind = f"the built-in {part.kind} {beside!r}" if beside else "a world without it"
    usual = {} if "network.hidden" in part.required_settings else {"network": {"hidden": [10]}}
    longer = subject.experiment.replace(
        population={"size": 20}, lifetime={"steps": 500 if part.kind in BREEDS else 3000}, **usual
    )
    value = (
        beside
        if part.kind not in ("sense", "world feature")
        else f'["{beside}"]'
        if beside
        else "[]"
    )
    own, built_in = _seconds(
        longer, assign(longer, [f"{PATHS[part.kind]}={value}", *_without(part)])
    )
    return f"{built_in / own:.2f} times the speed of {of_kind}"


def _without(part: type[Part]) -> list[str]:
    """What the part needs, as it would be without the part; who learns still does not."""
    usual = {path: look_up(load("evo/A"), path)[0] for path in part.required_settings}
    return [
        f"{path}={list(value) if isinstance(value, tuple) else value}"
        for path, value in usual.items()
    ]


def _seconds(*experiments: Any) -> list[float]:
    """Of each experiment the least time of several, taken in turns."""
    least = [float("inf")] * len(experiments)
    for _ in range(ROUNDS + 1):  # the first one compiles
        for number, experiment in enumerate(experiments):
            began = time.perf_counter()
            simulate_batch(experiment, SEED, range(4))
            least[number] = min(least[number], time.perf_counter() - began)
    return least
