"""A sweep, given as its file or as what its file would say."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import tomlkit

from baldwinlab.api.load import load_installed
from baldwinlab.api.publish.sweep_comparison import describe_too_few_runs
from baldwinlab.api.run_study import How, bring
from baldwinlab.api.study import Study
from baldwinlab.core import console
from baldwinlab.core.errors import RefusedError, require_positive
from baldwinlab.core.files import location
from baldwinlab.experiment.factors import SWEEP
from baldwinlab.simulation.memory import of_tables
from baldwinlab.studies.sweeps.design import FILE, experiments, require_as_many
from baldwinlab.studies.sweeps.file import read, validate


def sweep(
    plan: Mapping[str, Any] | str | Path,
    *,
    out: str | Path | None = None,
    workers: int | None = None,
    backend: str = "auto",
    executor: str = "threads",
    force: bool = False,
) -> Study:
    """Run an experiment at many points: a grid, a list, or a random or Sobol sample of any of its fields.

    `plan` is a TOML file, or a dict of the same content: {"experiment": "evo/A", "fields": {...}}.
    docs/reference/sweeps.md lists the keys. `out`
    is results/ and the file's name unless given; a dict needs it. The same call again does what is missing. Raises
    ExperimentError with a line for every fault, StudyError where `out` holds anything else, and RefusedError, unless forced,
    for more memory or disk than is free.
    """
    require_positive("workers", workers)
    load_installed()
    if isinstance(plan, Mapping):
        if out is None:
            raise RefusedError("a sweep that is no file needs out, the directory of its study")
        path, content = Path("sweep"), tomlkit.dumps(plan).encode()
        design = validate(plan, str(path))
    else:
        path = Path(plan)
        design, content = read(path), path.read_bytes()
    directory = Path("results") / path.stem if out is None else location(out)
    points = experiments(design, path)
    require_as_many(directory, points)
    console.info_if_any(describe_too_few_runs(design, len(points)))
    how, need = (
        How(workers, backend, executor, force),
        of_tables([(point, design.runs) for point in points]),
    )
    return Study(
        bring(
            points,
            directory,
            how,
            runs=design.runs,
            seed=design.seed,
            kind=SWEEP,
            beside={FILE: content},
            afterwards=need,
        )
    )
