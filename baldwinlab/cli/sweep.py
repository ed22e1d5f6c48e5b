"""The command `sweep`: run one experiment with many values of its settings."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from baldwinlab.api.run import sweep as run_sweep
from baldwinlab.api.run_options import RUN_DEFAULTS, RunOptions
from baldwinlab.cli.options import FIELDS, LOCATION, Json, LastGenerations, Out, Parts, load_parts
from baldwinlab.cli.results import print_results
from baldwinlab.core import console
from baldwinlab.core.numbers import require_whole_number
from baldwinlab.studies.store import StudyStore


def sweep(
    file: Annotated[
        Path,
        Parameter(help="TOML file that names the experiment and the values of each setting."),
    ],
    /,
    *,
    part: Parts = None,
    out: Annotated[
        Out,
        Parameter(help=f"{LOCATION} Default: results/NAME, where NAME is the name of the file."),
    ] = None,
    last_generations: LastGenerations = 10,
    options: Annotated[RunOptions, FIELDS] = RUN_DEFAULTS,
    json: Json = False,
) -> None:
    """Run an experiment with many values of its settings, and report the responses.

    The values are a grid, a list, or a random or Sobol sample. Stored runs are not repeated: the
    same command resumes an interrupted sweep. The page docs/reference/sweeps.md describes the file.

    For example:

        baldwinlab sweep examples/sweep.toml
    """
    load_parts(part)
    require_whole_number("last", last_generations)
    console.reserve_stdout(json)
    study = run_sweep(file, out=out, **asdict(options))
    study.report(last=last_generations, force=options.force)
    if json:
        print_results(StudyStore(study.directory), last_generations)
