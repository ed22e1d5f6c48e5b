"""From a stored sweep to its results, figures and report."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from baldwinlab.studies.provenance import provenance
from baldwinlab.studies.store import Study
from baldwinlab.sweeps import analysis
from baldwinlab.sweeps.design import open_sweep
from baldwinlab.sweeps.section import write_sweep_report


def publish(study: Study, out: Path, last: int, tell: Callable[[str], None]) -> None:
    """Write responses.csv, the figures and the report of a sweep. Raises StudyError if no run is stored yet."""
    study.require_runs()
    data = open_sweep(study.directory)
    measured = analysis.finals(data, last)
    analysis.write(measured, study.directory)
    tell("drawing the figures")
    write_sweep_report(study.directory, measured, provenance(study), out, last)
