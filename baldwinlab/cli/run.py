"""Experiments of one's own."""

from __future__ import annotations

from typing import Annotated

from cyclopts import Parameter

from baldwinlab import console
from baldwinlab.api import study as studies
from baldwinlab.api.bring import How
from baldwinlab.cli.common import Assignments, BackendName, Executor, Force, Out, Parts, Reading, Runs, Seed, Workers, load_parts
from baldwinlab.presets import load_with_origin


def run(
    experiment: Annotated[str, Parameter(help="a preset such as evo+self-taught/B, or a TOML file")],
    /,
    *others: Annotated[str, Parameter(help="more of them, to be compared in one study")],
    part: Parts = None,
    reading: Reading = "standard",
    assignments: Assignments = None,
    runs: Runs = 30,
    seed: Seed = 0,
    workers: Workers = None,
    out: Out = None,
    backend: BackendName = "auto",
    executor: Executor = "threads",
    force: Force = False,
) -> None:
    """Run an experiment, a preset or a TOML file; or several in one study, such as a condition and its controls."""
    load_parts(part)
    loaded = [load_with_origin(name, reading) for name in (experiment, *others)]
    how = How(workers, backend, executor, force)
    study = studies.run_loaded(loaded, assignments or [], how, runs=runs, seed=seed, out=out)
    console.say(f"for statistics, figures and a report: baldwinlab report {study.directory}")
