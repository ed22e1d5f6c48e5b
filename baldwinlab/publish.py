"""From a stored study to its statistics, figures and report."""

from __future__ import annotations

import platform
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
import numpy as np
import xarray as xr

from baldwinlab.analysis import claims, responses
from baldwinlab.replay import replay
from baldwinlab.report import emergence_generations, typical_run, write_report
from baldwinlab.report.responses import write_sweep_report
from baldwinlab.store import Study, StudyError
from baldwinlab.study import open_study
from baldwinlab.sweep import is_sweep, open_sweep
from baldwinlab.version import __version__

EMERGENCE = "evo+self-taught/B"  # the paper shows foraging emerge in this condition


def publish(study: Study, out: Path, last: int, tell: Callable[[str], None]) -> list[claims.ClaimResult]:
    """Write claims.json, statistics.csv, summary.csv, the figures and the report, and return the claims.

    A sweep has other results, those of `publish_sweep`, and no claims. A run counts with its average over its `last`
    generations. Raises StudyError if no run is stored yet.
    """
    if is_sweep(study.directory):
        publish_sweep(study, out, last, tell)
        return []
    data = open_study(study.directory)
    _require_runs(study, data)
    results = claims.evaluate(data, last)
    claims.write(results, data, study.directory, last)
    tell("drawing the figures")
    write_report(study.directory, data, results, _emergence(study, data), facts(study), out, last)
    return results


def publish_sweep(study: Study, out: Path, last: int, tell: Callable[[str], None]) -> None:
    """Write responses.csv, the figures and the report of a sweep. Raises as `publish` does."""
    data = open_sweep(study.directory)
    _require_runs(study, data)
    measured = responses.finals(data, last)
    responses.write(measured, study.directory)
    tell("drawing the figures")
    write_sweep_report(study.directory, measured, facts(study), out, last)


def _require_runs(study: Study, data: xr.Dataset) -> None:
    if not data.sizes["run"]:
        raise StudyError(f"{study.directory} holds no finished run yet; the command that made it carries on")


def _emergence(study: Study, data: xr.Dataset) -> list[xr.Dataset]:
    """The typical population at several generations, of the condition that the paper shows, or else of the first there is."""
    stored = [
        condition for condition in (EMERGENCE, *study.experiments) if condition in study.experiments and study.runs(condition)
    ]
    condition, run = stored[0], typical_run(data, stored[0])
    energy = data.energy.sel(condition=condition, run=run)
    experiment = study.experiments[condition]
    return [
        replay(experiment, study.seed, generation, run, energy)
        for generation in emergence_generations(experiment.evolution.generations)
    ]


def facts(study: Study) -> dict[str, Any]:
    """With what, and how fast, the study was made."""
    sessions = list(study.sessions())
    return {
        "seed": study.seed,
        "versions": {
            "baldwinlab": __version__,
            "Python": platform.python_version(),
            "NumPy": np.__version__,
            "Numba": numba.__version__,
        },
        "platform": platform.platform(),
        "agent_steps": sum(session["agent_steps"] for session in sessions),
        "seconds": sum(session["seconds"] for session in sessions),
        "compile_seconds": sum(session["compile_seconds"] for session in sessions),
        "workers": sorted({session["workers"] for session in sessions}),
    }
