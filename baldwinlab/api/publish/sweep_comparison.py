"""Comparisons of the points of a sweep with its first point, or with a baseline."""

from __future__ import annotations

from typing import Final

import xarray as xr

from baldwinlab.analysis.statistics.contrasts import Contrasts, compare_finals, planned_designs
from baldwinlab.analysis.statistics.sample_sizes import describe_too_few
from baldwinlab.experiment.factors import Factors
from baldwinlab.studies.store import StudyStore
from baldwinlab.studies.sweeps.design import FILE, settings_by_path
from baldwinlab.studies.sweeps.file import Sweep, read_stored

MOST_COMPARED: Final = 100  # points; the correction for more tests would leave little


def are_compared(sweep: Sweep, points: int) -> bool:
    """Whether the report of a sweep compares its points: few points, of a grid or a list."""
    return points <= MOST_COMPARED and sweep.samples is None


def describe_too_few_runs(sweep: Sweep, points: int) -> str:
    """Say before the runs whether they are too few to compare the points; "" where they are not."""
    factors = {str(point): Factors() for point in range(points)}
    if not are_compared(sweep, points):
        return ""
    return describe_too_few(planned_designs(factors, sweep.runs))


def has_comparisons(study: StudyStore) -> bool:
    """Whether the report of a stored sweep compares its points."""
    path = study.directory / FILE
    return path.exists() and are_compared(read_stored(path), len(study.experiments))


def compare_points(
    study: StudyStore, finals: xr.Dataset, last: int, baseline: str = ""
) -> Contrasts:
    """Compare the points in `finals` (condition, run), named by the values of their fields."""
    titles = name_points(study)
    names = [titles[str(name)] for name in finals["condition"].values]
    return compare_finals(
        finals.assign_coords(condition=names),
        dict.fromkeys(names, Factors()),
        last,
        titles.get(baseline, ""),
    )


def name_points(study: StudyStore) -> dict[str, str]:
    """Name each point of a sweep by the values of its fields, such as `learning.rule = hebb`."""
    settings = settings_by_path(study)
    columns = [[f"{field} = {value}" for value in values] for field, values in settings.items()]
    named = [", ".join(values) for values in zip(*columns, strict=True)] or list(study.experiments)
    return {
        point: name if named.count(name) == 1 else f"{name} ({point})"
        for point, name in zip(study.experiments, named, strict=True)
    }
