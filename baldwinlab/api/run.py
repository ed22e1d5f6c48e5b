"""Run experiments, or a sweep, as one study: `bl.run`, `bl.sweep`, and the command `run`."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Unpack

import tomlkit

from baldwinlab.api.freezer import add_founders
from baldwinlab.api.load import load_installed_parts
from baldwinlab.api.run_options import RunArguments, RunOptions, list_options
from baldwinlab.api.run_study import StudyRequest, run_missing
from baldwinlab.api.study import Study
from baldwinlab.core import console
from baldwinlab.core.errors import RefusedError
from baldwinlab.core.files import SWEEP_FILE, parse_location, read_bytes
from baldwinlab.core.names import read_stem, suggest
from baldwinlab.core.numbers import check_numbers, require_whole_number
from baldwinlab.experiment import BaseExperiment, assign
from baldwinlab.experiment.conditions import SWEEP
from baldwinlab.experiment.fields import to_plain_data
from baldwinlab.experiment.file import hold_contents
from baldwinlab.experiment.toml import format_assignments
from baldwinlab.experiment.unused_settings import require_effect
from baldwinlab.papers.presets import LoadedExperiment, load_with_origin
from baldwinlab.papers.worlds import find_factors
from baldwinlab.simulation.memory import estimate_tables
from baldwinlab.studies.run_task import Callback
from baldwinlab.studies.store import StudyStore
from baldwinlab.studies.sweeps import read_sweep, validate_sweep
from baldwinlab.studies.sweeps.design import SWEEP_FILE_NAME, expand_sweep

if TYPE_CHECKING:
    import xarray as xr


@check_numbers
@list_options(RunOptions)
def run(
    experiments: str | Path | BaseExperiment | Sequence[str | Path | BaseExperiment],
    *,
    runs: int = 30,
    seed: int = 0,
    out: str | Path | None = None,
    set: Mapping[str, Any] | None = None,
    founders: str | Sequence[str] = (),
    schedule: Mapping[int, Mapping[str, Any]] = MappingProxyType({}),
    callback: Callable[[xr.Dataset], None] | None = None,
    **options: Unpack[RunArguments],
) -> Study:
    """Run one or several experiments as one study.

    A repeated call simulates only the missing runs. Nothing is written if ExperimentError,
    ArgumentError or StudyError is raised.

    Parameters
    ----------
    experiments : str, pathlib.Path, BaseExperiment or a sequence of them
        Presets such as "evo/A", experiment files that end in .toml, or experiments from `load`.
    runs : int
        Number of independent runs of each experiment, 1 to 2**31.
    seed : int
        Seed of all random numbers, 0 to 2**31 - 1.
    out : str, pathlib.Path or None
        Directory of the study, or a URL that fsspec can open. By default a directory with the names
        of the experiments, for example results/evo-A-evo-B.
    set : mapping or None
        Settings to change in all experiments, such as {"lifetime.steps": 100}.
    founders : str or sequence of str
        Genomes of the first generation: "STUDY:CONDITION@GENERATION", with "[RUN]" at the end for
        the population of one run, or a genome file (.nc, .npy). "=SHARE" at the end is the fraction
        of the first generation that gets these genomes. By default the genomes are random.
    schedule : mapping
        Settings that change during a run, by generation: {50: {"learning.rule": "none"}}.
    callback : callable or None
        Function that is called after each generation of each run, with the dataset of the run so
        far. The attributes `condition` and `run` of the dataset name the run. Only one call runs at
        a time. It needs the executor "threads".
    **options
        Fields of `RunOptions`.

    Returns
    -------
    Study
        The study, on disk.

    Raises
    ------
    ExperimentError
        An experiment does not exist or is not valid, or a setting has no effect.
    ArgumentError
        `runs`, `seed` or `workers` is out of range.
    StudyError
        The directory holds another study.
    RefusedError
        The backend cannot be used on this machine, or too little memory or disk is free.
    InterruptedStudyError
        A worker or a disk failed. The stored runs remain, and a repeated call continues.

    Examples
    --------
    >>> import baldwinlab as bl
    >>> short = {"evolution.generations": 2, "lifetime.steps": 50}
    >>> study = bl.run(["evo/A", "evo+self-taught/A"], runs=5, out="mine", set=short)
    >>> study.conditions, study.runs("evo/A")
    (('evo/A', 'evo+self-taught/A'), [0, 1, 2, 3, 4])
    """
    if isinstance(experiments, str | Path | BaseExperiment):
        experiments = [experiments]
    load_installed_parts()
    store = run_loaded(
        [_load(source) for source in experiments],
        format_assignments(set or {}),
        RunOptions(**options),
        runs=runs,
        seed=seed,
        out=out,
        founders=[founders] if isinstance(founders, str) else founders,
        schedule=_list_changes(schedule),
        callback=callback,
    )
    return Study(store)


def _load(source: str | Path | BaseExperiment) -> LoadedExperiment:
    if isinstance(source, BaseExperiment):
        return LoadedExperiment(source)
    return load_with_origin(source)


def _list_changes(schedule: Mapping[int, Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Return the changes as in an experiment file: [{"generation": 50, "motor.noise": 0.1}]."""
    numbered = {
        require_whole_number("generation", generation): settings
        for generation, settings in schedule.items()
    }
    return [
        {"generation": generation, **settings} for generation, settings in sorted(numbered.items())
    ]


@check_numbers
def run_loaded(
    loaded: Sequence[LoadedExperiment],
    assignments: Sequence[str],
    options: RunOptions,
    *,
    runs: int,
    seed: int,
    out: str | Path | None,
    baseline: str = "",
    founders: Sequence[str] = (),
    schedule: Sequence[Mapping[str, Any]] = (),
    callback: Callback | None = None,
) -> StudyStore:
    """Run experiments, changed by assignments, as one study, for `bl.run` and for the command.

    If the runs are too few to compare the conditions, a warning is printed before the first run.
    """
    if not loaded:
        raise RefusedError("a study needs at least one experiment")
    experiments = [assign(source.experiment, assignments) for source in loaded]
    if schedule:
        experiments = [
            experiment.replace(schedule=[*experiment.schedule, *schedule])
            for experiment in experiments
        ]
    require_effect(experiments, [source.origin for source in loaded])
    names = [experiment.name for experiment in experiments]
    if baseline and baseline not in names:
        raise RefusedError(
            f"--baseline {baseline} is not a condition of the study{suggest(baseline, names)}"
        )
    folder = "-".join(name.replace("/", "-") for name in names)
    directory = Path("results") / folder if out is None else parse_location(out)
    console.info_if_any(_describe_too_few(experiments, runs, baseline, directory))
    # Genome files of founders from stored studies. They are in memory only.
    contents: list[bytes] = []
    if founders:
        experiments, contents = add_founders(experiments, founders, runs)
    request = StudyRequest(experiments, directory, runs=runs, seed=seed)
    with hold_contents(contents):
        return run_missing(request, options, callback)


def _describe_too_few(
    experiments: Sequence[BaseExperiment], runs: int, baseline: str, directory: Path
) -> str:
    """Return sentences if `runs` runs are too few for a verdict, else ""."""
    if len(experiments) == 1:
        return ""
    # Imported late: SciPy's statistics take a while to load.
    from baldwinlab.api.publish.comparisons import describe_planned, format_instruction

    instruction = format_instruction(directory)
    return describe_planned(find_factors(experiments), runs, instruction, baseline)


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
    plan : mapping, str or pathlib.Path
        A TOML file, or a dict with the same content, such as
        {"experiment": "evo/A", "runs": 8, "fields": {"learning.rate": [0.01, 0.1]}}. The page
        docs/reference/sweeps.md lists the keys.
    out : str, pathlib.Path or None
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

    Examples
    --------
    >>> import baldwinlab as bl
    >>> plan = {"experiment": "evo/A", "runs": 1, "fields": {"senses.visual_radius": [4, 40]}}
    >>> plan["set"] = {"evolution.generations": 2, "lifetime.steps": 50}
    >>> bl.sweep(plan, out="radii").data().sizes["senses.visual_radius"]
    2
    """
    # Imported late: SciPy's statistics take a while to load.
    from baldwinlab.api.publish.comparisons import describe_too_few_runs

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
        content = read_bytes(path, SWEEP_FILE)
    directory = Path("results") / read_stem(path) if out is None else parse_location(out)
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
