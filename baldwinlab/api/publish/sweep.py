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
        Point with which all others are compared, or "" for the first.

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
    measured = analysis.compute_finals(data, last)
    analysis.write_responses(measured, study.directory)
    contrasts = _compare(study, measured, last, baseline)
    rows = [contrast.row() for contrast in contrasts.rows]
    write_atomically(study.directory / "statistics.csv", to_csv(COMPARISON_COLUMNS, rows))
    log("drawing the figures")
    write_sweep_report(study.directory, measured, provenance(study), out, last, contrasts=contrasts)
    return contrasts


def _compare(study: StudyStore, measured: xr.Dataset, last: int, baseline: str) -> Contrasts:
    if not has_comparisons(study):
        return Contrasts("", last, ())
    finals = measured[list(COMPARED_MEASURES)].rename(point="condition").reset_coords(drop=True)
    finals = finals.assign_coords(condition=list(study.experiments))
    return compare_points(study, finals, last, baseline)
