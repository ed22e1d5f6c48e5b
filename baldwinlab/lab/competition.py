"""Competition: the agents of two genome files of the served folder in one population."""

from __future__ import annotations

import math
from collections.abc import Mapping
from threading import Lock
from typing import Any, Final

from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import JSONResponse
from starlette.routing import BaseRoute, Route

from baldwinlab.api.frozen_genomes import choose_experiment, read_genome_file
from baldwinlab.experiment.outcome import name_experiment_outcome
from baldwinlab.lab import Lab
from baldwinlab.lab.freezer import find_file
from baldwinlab.lab.limits import MAX_GENERATION_WORK
from baldwinlab.lab.query import read_body, read_body_number
from baldwinlab.papers import presets

MAX_LIVES: Final = 200
# Each life is simulated twice, see `compete`.
SIMULATIONS_PER_LIFE: Final = 2


def make_routes(lab: Lab) -> list[BaseRoute]:
    """Return the routes of this module."""
    running = Lock()

    def run(body: Mapping[str, Any]) -> dict[str, Any]:
        if not running.acquire(blocking=False):
            raise ValueError("another competition is running; wait until it has ended")
        try:
            return compete(lab, body)
        finally:
            running.release()

    async def start(request: Request) -> JSONResponse:
        body = await read_body(request, "a", "b", "condition", "lives", "seed")
        return JSONResponse(await run_in_threadpool(run, body))

    return [Route("/api/compete", start, methods=["POST"])]


def compete(lab: Lab, body: Mapping[str, Any]) -> dict[str, Any]:
    """Return the mean outcomes of the agents of the files `a` and `b`, and their difference.

    `body` may have a `condition` (a preset) in which all agents are simulated, a number of
    `lives`, and a `seed`. A missing interval is None.

    Raise MissingError if a file does not exist, and ValueError for other invalid parameters.
    """
    # This import of SciPy's statistics takes time.
    from baldwinlab.api.compete import compete as simulate_competition

    path_a, path_b = (find_file(lab, str(body.get(name, ""))) for name in ("a", "b"))
    condition = str(body.get("condition", "")) or None
    lives = read_body_number(body, "lives", 20)
    seed = read_body_number(body, "seed", 0)
    # `simulate_competition` would also read a file of this name.
    if condition is not None and condition not in presets.factors():
        raise ValueError(f"condition = {condition!r} must be a preset")
    if not 1 <= lives <= MAX_LIVES:
        raise ValueError(f"lives = {lives} must be at least 1 and at most {MAX_LIVES}")
    experiment = choose_experiment(read_genome_file(path_a), path_a, condition)
    work = SIMULATIONS_PER_LIFE * lives * experiment.agent_steps * experiment.weight_count
    if work > MAX_GENERATION_WORK:
        raise ValueError(f"lives = {lives} is too large for these agents; use `bl.compete`")
    result = simulate_competition(path_a, path_b, experiment=condition, lives=lives, seed=seed)
    has_interval = math.isfinite(result.low)
    return {
        "outcome": name_experiment_outcome(experiment),
        "energy": [result.energy_a, result.energy_b],
        "difference": result.difference,
        "low": result.low if has_interval else None,
        "high": result.high if has_interval else None,
        "lives": lives,
        "condition": experiment.name,
    }
