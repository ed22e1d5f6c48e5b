"""From a stored sweep to its results, figures and report."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from baldwinlab.analysis.statistics.contrasts import COLUMNS, MEASURES, Contrasts
from baldwinlab.analysis.statistics.csv import to_csv
from baldwinlab.analysis.sweeps import analysis
from baldwinlab.analysis.sweeps.section import write_sweep_report
from baldwinlab.api.publish.sweep_comparison import compare_points, has_comparisons
from baldwinlab.core.files import write_atomically
from baldwinlab.studies.provenance import provenance
from baldwinlab.studies.store import StudyStore
from baldwinlab.studies.sweeps.design import open_sweep


def publish(
    study: StudyStore, out: Path, last: int, tell: Callable[[str], None], baseline: str = ""
) -> Contrasts:
    """Write responses.csv, statistics.csv, the figures and the report of a sweep, and return the comparisons of its points.

    Raises StudyError if no run is stored yet.
    """
    study.require_runs()
    data = open_sweep(study.directory)
    measured = analysis.finals(data, last)
    analysis.write(measured, study.directory)
    contrasts = Contrasts("", last, ())
    if has_comparisons(study):
        finals = measured[list(MEASURES)].rename(point="condition").reset_coords(drop=True)
        contrasts = compare_points(
            study, finals.assign_coords(condition=list(study.experiments)), last, baseline
        )
    write_atomically(
        study.directory / "statistics.csv", to_csv(COLUMNS, [row.row() for row in contrasts.rows])
    )
    tell("drawing the figures")
    write_sweep_report(study.directory, measured, provenance(study), out, last, contrasts)
    return contrasts
