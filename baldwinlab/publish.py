"""From a stored study to its statistics, figures and report."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import xarray as xr

from baldwinlab.analysis import claims
from baldwinlab.assays import section as assays
from baldwinlab.assays import stored
from baldwinlab.factors import SWEEP
from baldwinlab.multiverse import section as readings
from baldwinlab.multiverse.analysis import read
from baldwinlab.multiverse.publish import FILE
from baldwinlab.presets import paper
from baldwinlab.report import Section, emergence_generations, render, typical_run, write_report
from baldwinlab.runs.replay import replay
from baldwinlab.statistics.contrasts import contrasts
from baldwinlab.studies.facts import facts
from baldwinlab.studies.store import Study
from baldwinlab.studies.study import open_study
from baldwinlab.sweeps import publish as sweeps

EMERGENCE = "evo+self-taught/B"  # the paper shows foraging emerge in this condition


def publish(study: Study, out: Path, last: int, tell: Callable[[str], None]) -> list[claims.ClaimResult]:
    """Write claims.json, statistics.csv, summary.csv, the figures and the report, and return the claims.

    A sweep has other results, those of `sweeps.publish`, and no claims. A run counts with its average over its `last`
    generations. Raises StudyError if no run is stored yet.
    """
    if study.kind == SWEEP:
        sweeps.publish(study, out, last, tell)
        return []
    study.require_runs()
    data = open_study(study.directory)
    results = claims.evaluate(data, last)
    claims.write(results, data, study.directory, last)
    tell("drawing the figures")
    write_report(study.directory, data, results, _emergence(study, data), facts(study), out, last, _sections(study, data, last))
    return results


def _sections(study: Study, data: xr.Dataset, last: int) -> list[Section]:
    """What else is known of the study: conditions of one's own compared, and what other commands have left in its folder."""
    found = []
    own = set(study.experiments) - {experiment.name for experiment in paper()}
    if own and (compared := contrasts(data, last)):
        found.append(Section("compared", "Conditions compared", render("report/contrasts.html", contrasts=compared, last=last)))
    if measured := stored.read(study.directory, study.factors):
        found.append(assays.section(measured, study.directory, last))
    places = [study.directory / name / FILE for name in ("multiverse-full", "multiverse")]
    multiverses = [read(place) for place in places if place.exists()]
    return found + [readings.section(multiverse, study.directory / "figures") for multiverse in multiverses[:1]]


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
