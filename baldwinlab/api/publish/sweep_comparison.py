"""Comparisons of the points of a sweep with its first point, or with a baseline."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Final

from baldwinlab.analysis.results.contrasts import Contrasts, compare_final_values, planned_tests
from baldwinlab.analysis.statistics.significance import describe_too_few
from baldwinlab.api.publish.added_runs import SWEEP_INSTRUCTION
from baldwinlab.core.deferred import xr
from baldwinlab.experiment.factors import Factors
from baldwinlab.studies.store import StudyStore
from baldwinlab.studies.sweeps.design import SWEEP_FILE_NAME, name_points
from baldwinlab.studies.sweeps.file import Sweep, read_sweep

# With more points, the correction for multiple tests leaves few significant differences.
MAX_COMPARED_POINTS: Final = 100


def are_compared(sweep: Sweep, points: int) -> bool:
    """Return whether the report of a sweep compares its points.

    The points of a random sample are not compared, and neither are many points.
    """
    is_sample = sweep.samples is not None
    return points <= MAX_COMPARED_POINTS and not is_sample


def describe_too_few_runs(sweep: Sweep, points: int, instruction: str = SWEEP_INSTRUCTION) -> str:
    """Return sentences if the planned runs are too few to compare the points, else ""."""
    if not are_compared(sweep, points):
        return ""
    factors = {str(point): Factors() for point in range(points)}
    return describe_planned(factors, sweep.runs, instruction)


def describe_planned(factors: Mapping[str, Factors], runs: int, instruction: str) -> str:
    """Return sentences if the planned runs of conditions are too few to compare them, else ""."""
    return describe_too_few(planned_tests(factors, runs), instruction=instruction)


def has_comparisons(study: StudyStore) -> bool:
    """Return whether the report of a stored sweep compares its points."""
    path = study.directory / SWEEP_FILE_NAME
    return path.exists() and are_compared(read_sweep(path), len(study.experiments))


def compare_points(
    study: StudyStore, finals: xr.Dataset, last: int, baseline: str = ""
) -> Contrasts:
    """Compare the points of a sweep.

    `finals`: measures of the points, [condition, run]. `baseline`: point with which all other
    points are compared, or "" for the first.
    """
    titles = name_points(study)
    names = [titles[str(name)] for name in finals["condition"].values]
    contrasts = compare_final_values(
        finals.assign_coords(condition=names),
        dict.fromkeys(names, Factors()),
        last,
        titles.get(baseline, ""),
    )
    return replace(contrasts, instruction=SWEEP_INSTRUCTION)
