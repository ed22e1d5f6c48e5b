"""A study from experiments: `bl.run`, and what its command calls."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import tomlkit

from baldwinlab.api.load import load_installed
from baldwinlab.api.run_study import How, bring
from baldwinlab.api.study import Study
from baldwinlab.core import console
from baldwinlab.core.errors import RefusedError
from baldwinlab.core.files import location
from baldwinlab.core.suggestions import suggest
from baldwinlab.experiment import BaseExperiment, assign
from baldwinlab.experiment.factors import Factors
from baldwinlab.experiment.unused_settings import require_effect
from baldwinlab.papers.presets import Loaded, factors, load_with_origin


def run(
    experiments: str | Path | BaseExperiment | Sequence[str | Path | BaseExperiment],
    *,
    runs: int = 30,
    seed: int = 0,
    out: str | Path | None = None,
    workers: int | None = None,
    backend: str = "auto",
    executor: str = "threads",
    set: Mapping[str, Any] | None = None,
    force: bool = False,
) -> Study:
    """Run one or several experiments as one study. The same call again runs only the runs that are missing.

    Parameters
    ----------
    experiments
        Presets such as "evo/A", experiment files that end in .toml, or experiments from `load`.
    runs
        Independent runs of each experiment.
    seed
        The seed of all randomness.
    out
        The directory of the study, results/NAME by default; NAME joins the names of the experiments by "-".
    workers
        Threads, by default all cores.
    backend
        "auto", "cpu" or "cuda".
    executor
        "threads", "dask:tcp://HOST:PORT" or "slurm".
    set
        Changes of fields in all experiments: {"lifetime.steps": 100}.
    force
        Run with less free memory or disk than the estimate.

    Returns
    -------
    Study
        The study, on disk.

    Raises
    ------
    ExperimentError
        For an experiment that does not exist or is not valid, and a setting without effect.
    ArgumentError
        For a number of runs, a seed or a number of workers out of range.
    StudyError
        Where the directory holds another study. These three are raised before anything is written.
    RefusedError
        For a backend that cannot be used here, and for too little free memory or disk.
    InterruptedStudyError
        Where the study stops before its end. The stored runs stay.
    """
    given = (
        [experiments] if isinstance(experiments, str | Path | BaseExperiment) else list(experiments)
    )
    if not given:
        raise RefusedError("a study needs at least one experiment")
    load_installed()
    loaded = [
        Loaded(each) if isinstance(each, BaseExperiment) else load_with_origin(each)
        for each in given
    ]
    how = How(workers, backend, executor, force)
    return run_loaded(loaded, assignments_of(set or {}), how, runs=runs, seed=seed, out=out)


def run_loaded(
    loaded: Sequence[Loaded],
    assignments: Sequence[str],
    how: How,
    *,
    runs: int,
    seed: int,
    out: str | Path | None,
    baseline: str = "",
) -> Study:
    """Run experiments, changed by assignments, as one study. `run` and its command call this.

    It says before the runs whether they are too few for a comparison of the conditions with each other or with `baseline`.
    """
    experiments = [assign(each.experiment, assignments) for each in loaded]
    require_effect(experiments, [each.origin for each in loaded])
    names = [each.name for each in experiments]
    if baseline and baseline not in names:
        raise RefusedError(
            f"baseline {baseline!r} is not a condition of the study{suggest(baseline, names)}"
        )
    console.info_if_any(_describe_too_few(names, runs, baseline))
    directory = (
        Path("results") / "-".join(name.replace("/", "-") for name in names)
        if out is None
        else location(out)
    )
    return Study(bring(experiments, directory, how, runs=runs, seed=seed))


def _describe_too_few(names: Sequence[str], runs: int, baseline: str) -> str:
    from baldwinlab.analysis.statistics.contrasts import (
        planned_designs,  # here, because SciPy's statistics take a while to load
    )
    from baldwinlab.analysis.statistics.sample_sizes import describe_too_few

    known = factors()
    return describe_too_few(
        planned_designs({name: known.get(name, Factors(name)) for name in names}, runs, baseline)
    )


def assignments_of(tables: Mapping[str, Any]) -> list[str]:
    """Return the assignments of tables: `{"lifetime": {"steps": 5}}` and `{"lifetime.steps": 5}` are both lifetime.steps=5."""
    return list(_assignments(tables))


def _assignments(tables: Mapping[str, Any], path: str = "") -> Iterator[str]:
    for key, value in tables.items():
        if isinstance(value, Mapping):
            yield from _assignments(value, f"{path}{key}.")
        else:
            yield f"{path}{key}={tomlkit.item(value).as_string()}"
