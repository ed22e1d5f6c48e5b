"""Run a sweep, from its file or from a dict with the same content."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Unpack

import tomlkit

from baldwinlab.api.load import load_installed_parts
from baldwinlab.api.publish.sweep_comparison import describe_too_few_runs
from baldwinlab.api.run_options import RunArguments, RunOptions, list_options
from baldwinlab.api.run_study import StudyRequest, run_missing
from baldwinlab.api.study import Study
from baldwinlab.core import console
from baldwinlab.core.errors import RefusedError
from baldwinlab.core.files import parse_location
from baldwinlab.core.numbers import check_numbers
from baldwinlab.experiment.conditions import SWEEP
from baldwinlab.experiment.fields import to_plain_data
from baldwinlab.simulation.memory import estimate_tables
from baldwinlab.studies.sweeps import read_sweep, validate_sweep
from baldwinlab.studies.sweeps.design import SWEEP_FILE_NAME, expand_sweep


@check_numbers
@list_options(RunOptions)
def sweep(
    plan: Mapping[str, Any] | str | Path,
    *,
    out: str | Path | None = None,
    **options: Unpack[RunArguments],
) -> Study:
    """Run an experiment with many values of its settings: a grid, a list or a random sample.

    A repeated call simulates only the missing runs. Nothing is written if ExperimentError,
    ArgumentError or StudyError is raised.

    Parameters
    ----------
    plan
        A TOML file, or a dict with the same content, such as
        {"experiment": "evo/A", "runs": 8, "fields": {"learning.rate": [0.01, 0.1]}}. The page
        docs/reference/sweeps.md lists the keys.
    out
        Directory of the study, or a URL that fsspec can open. By default results/NAME, where NAME
        is the name of the file. Required if `plan` is a dict.
    **options
        Fields of `RunOptions`.

    Returns
    -------
    Study
        The study, on disk. Its conditions are the points of the sweep.

    Raises
    ------
    ExperimentError
        The plan is not valid. The message has one line for each error.
    ArgumentError
        A number is out of range.
    StudyError
        The directory holds another study.
    RefusedError
        `plan` is a dict and `out` is missing, or too little memory or disk is free.
    InterruptedStudyError
        A worker or a disk failed. The stored runs remain, and a repeated call continues.
    """
    run_options = RunOptions(**options)
    load_installed_parts()
    if isinstance(plan, Mapping):
        if out is None:
            raise RefusedError("out is missing: a sweep from a dict needs the study's directory")
        # Errors in the plan name this path.
        path = Path("sweep")
        tables = to_plain_data(plan)
        content = tomlkit.dumps(tables).encode()
        design = validate_sweep(tables, str(path))
    else:
        path = Path(plan)
        design = read_sweep(path)
        content = path.read_bytes()
    directory = Path("results") / path.stem if out is None else parse_location(out)
    points = expand_sweep(design, path)
    console.info_if_any(describe_too_few_runs(design, len(points)))
    request = StudyRequest(
        points,
        directory,
        runs=design.runs,
        seed=design.seed,
        kind=SWEEP,
        extra_files={SWEEP_FILE_NAME: content},
        later_need=estimate_tables([(point, design.runs) for point in points]),
    )
    return Study(run_missing(request, run_options))
