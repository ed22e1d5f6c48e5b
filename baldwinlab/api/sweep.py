"""A sweep, given as its file or as what its file would say."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import tomlkit

from baldwinlab.api.bring import bring
from baldwinlab.api.installed import load_installed
from baldwinlab.api.study import Study
from baldwinlab.errors import RefusedError, require_positive
from baldwinlab.factors import SWEEP
from baldwinlab.files import location
from baldwinlab.sweeps.design import create
from baldwinlab.sweeps.plan import read, validate


def sweep(
    plan: Mapping[str, Any] | str | Path,
    *,
    out: str | Path | None = None,
    workers: int | None = None,
    backend: str = "auto",
    executor: str = "threads",
) -> Study:
    """Run an experiment at many points: a grid, a list, or a random or Sobol sample of any of its fields.

    `plan` is a TOML file, or a dict of the same content, see docs/sweeps.md: {"experiment": "evo/A", "fields": {...}}. `out`
    is results/ and the file's name unless given; a dict needs it. The same call again does what is missing. Raises
    ExperimentError with a line for every fault, and StudyError where `out` holds anything else.
    """
    require_positive("workers", workers)
    load_installed()
    if isinstance(plan, Mapping):
        if out is None:
            raise RefusedError("a sweep that is no file needs out, the directory of its study")
        path, text = Path("sweep"), tomlkit.dumps(plan)
        design = validate(plan, str(path))
    else:
        path, text = Path(plan), None
        design = read(path)
    directory = Path("results") / path.stem if out is None else location(out)
    points = create(directory, design, path, text)
    how: dict[str, Any] = {"workers": workers, "backend": backend, "executor": executor}
    return Study(bring(points, directory, runs=design.runs, seed=design.seed, kind=SWEEP, **how))
