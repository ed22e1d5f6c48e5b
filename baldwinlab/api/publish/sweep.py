"""Write the results, figures and report of a stored sweep."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import xarray as xr

from baldwinlab.analysis.statistics.contrasts import (
    COMPARED_MEASURES,
    COMPARISON_COLUMNS,
    Contrasts,
)
from baldwinlab.analysis.statistics.csv import to_csv
from baldwinlab.analysis.sweeps import analysis
from baldwinlab.analysis.sweeps.section import write_sweep_report
from baldwinlab.api.publish.sweep_comparison import compare_points, has_comparisons
from baldwinlab.core.file_writing import write_atomically
from baldwinlab.studies.open import open_conditions
from baldwinlab.studies.provenance import provenance
from baldwinlab.studies.store import StudyStore
from baldwinlab.studies.sweeps.design import label_points


def publish_sweep(
    study: StudyStore, out: Path, last: int, log: Callable[[str], None], baseline: str = ""
) -> Contrasts:
    """Write responses.csv, statistics.csv, the figures and the report of a sweep.

    Parameters
    ----------
    study : StudyStore
        The sweep.
    out : Path
        HTML file to write.
    last : int
        Number of final generations to average in each run.
    log : callable
        Called with progress messages.
    baseline : str
        Point with which all other points are compared, or "" for the first.

    Returns
    -------
    Contrasts
        Comparisons of the points.

    Raises
    ------
    StudyError
        The sweep has no run, or a record is damaged.
    OSError
        A file cannot be written.
    """
    study.require_runs()
    data = label_points(study, open_conditions(study, list(study.experiments)))
    finals = analysis.compute_finals(data, last)
    analysis.write_responses(finals, study.directory)
    contrasts = _compare_points(study, finals, last, baseline)
    rows = [contrast.row() for contrast in contrasts.rows]
    write_atomically(study.directory / "statistics.csv", to_csv(COMPARISON_COLUMNS, rows))
    log("drawing the figures")
    write_sweep_report(study.directory, finals, provenance(study), out, last, contrasts=contrasts)
    return contrasts


def _compare_points(study: StudyStore, finals: xr.Dataset, last: int, baseline: str) -> Contrasts:
    """Return the comparisons of the points. A large sweep has none."""
    if not has_comparisons(study):
        return Contrasts("", last, ())
    by_condition = finals[list(COMPARED_MEASURES)].rename(point="condition").reset_coords(drop=True)
    by_condition = by_condition.assign_coords(condition=list(study.experiments))
    return compare_points(study, by_condition, last, baseline)
