"""From a stored study to its statistics, figures and report."""

from __future__ import annotations

import platform
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
import numpy as np
import xarray as xr

from baldwinlab.analysis import assays, claims, readings, responses
from baldwinlab.analysis.contrasts import contrasts
from baldwinlab.multiverse import conditions_by_reading
from baldwinlab.papers import Paper, of_study
from baldwinlab.report import Section, baldwin, emergence_generations, render, typical_run, write_page, write_report
from baldwinlab.report import readings as every_reading
from baldwinlab.report.responses import write_sweep_report
from baldwinlab.runs.replay import replay
from baldwinlab.studies.store import Study
from baldwinlab.studies.study import Progress, open_conditions, open_study
from baldwinlab.sweeps import is_sweep, open_sweep
from baldwinlab.version import __version__

MULTIVERSE = "multiverse.json"  # what came of a multiverse, in its folder


def publish(study: Study, out: Path, last: int, tell: Callable[[str], None]) -> list[claims.ClaimResult]:
    """Write claims.json, statistics.csv, summary.csv, the figures and the report, and return the claims.

    A sweep has other results, those of `publish_sweep`, and no claims. A run counts with its average over its `last`
    generations. Raises StudyError if no run is stored yet.
    """
    if is_sweep(study.directory):
        publish_sweep(study, out, last, tell)
        return []
    study.require_runs()
    data = open_study(study.directory)
    paper = of_study(study.directory, study.paper)
    results = claims.evaluate(data, last, paper)
    claims.write(results, data, study.directory, last, study.paper)
    tell("drawing the figures")
    traces = _emergence(study, data, paper) if "emergence" in paper.about.figures else []
    sections, made_by = _sections(study, data, last, paper), paper if study.paper else None
    write_report(study.directory, data, results, traces, facts(study), out, last, sections, made_by)
    return results


def _sections(study: Study, data: xr.Dataset, last: int, paper: Paper) -> list[Section]:
    """What else is known of the study: conditions of one's own compared, and what other commands have left in its folder."""
    found = []
    own = set(study.experiments) - set(paper.own() if paper.claims else ())
    if own and (compared := contrasts(data, last)):
        found.append(Section("compared", "Conditions compared", render("contrasts.html", contrasts=compared, last=last)))
    if stored := assays.read(study.directory):
        found.append(baldwin.section(stored, study.directory, last, paper.words.inference))
    places = [study.directory / name / MULTIVERSE for name in ("multiverse-full", "multiverse")]
    multiverses = [readings.read(place) for place in places if place.exists()]
    return found + [every_reading.section(multiverse, study.directory / "figures") for multiverse in multiverses[:1]]


def publish_multiverse(
    study: Study, out: Path, last: int, progress: Callable[[str, int, str], Progress], tell: Callable[[str], None]
) -> readings.Multiverse:
    """Write multiverse.json, the figures and the page of a multiverse, and return what came of it.

    A reading of which no run is stored is left out. Raises StudyError if there is no other.
    """
    study.require_runs()
    found = []
    wanted = conditions_by_reading(list(study.experiments))
    with progress("deciding the claims", len(wanted), "readings") as show:
        for reading, conditions in wanted.items():
            data = open_conditions(study, conditions)
            if data.sizes["run"]:
                data = data.assign_coords(condition=[condition.partition("/")[2] for condition in conditions])
                about = (reading.name, reading.description, reading.choices, reading.fields)
                found.append(readings.reading(data, *about, last))
            show(1)
    multiverse = readings.Multiverse(seed=study.seed, last=last, claims=readings.paper_claims(), readings=tuple(found))
    readings.write(multiverse, study.directory / MULTIVERSE)
    tell("drawing the figures")
    section = every_reading.section(multiverse, study.directory / "figures")
    write_page("The paper's claims under every reading", every_reading.lead(multiverse), [section], out)
    return multiverse


def publish_sweep(study: Study, out: Path, last: int, tell: Callable[[str], None]) -> None:
    """Write responses.csv, the figures and the report of a sweep. Raises as `publish` does."""
    study.require_runs()
    data = open_sweep(study.directory)
    measured = responses.finals(data, last)
    responses.write(measured, study.directory)
    tell("drawing the figures")
    write_sweep_report(study.directory, measured, facts(study), out, last)


def _emergence(study: Study, data: xr.Dataset, paper: Paper) -> list[xr.Dataset]:
    """The typical population at several generations, of the condition that the paper shows, or else of the first there is."""
    preferred = (paper.about.emergence, *study.experiments)
    stored = [condition for condition in preferred if condition in study.experiments and study.runs(condition)]
    condition, run = stored[0], typical_run(data, stored[0])
    energy = data.energy.sel(condition=condition, run=run)
    experiment = study.experiments[condition]
    return [
        replay(experiment, seed=study.seed, run=run, generation=generation, energy=energy)
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
