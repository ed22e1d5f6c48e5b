"""Reproduce a paper: its conditions, its assays and its report."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from baldwinlab import papers
from baldwinlab.api.load import load_installed
from baldwinlab.api.planned_reproduction import (
    are_foragers,
    describe_missing_runs,
    estimate_later_need,
)
from baldwinlab.api.report import report
from baldwinlab.api.run import format_assignments
from baldwinlab.api.run_assays import run_missing_assays
from baldwinlab.api.run_options import RunOptions
from baldwinlab.api.run_study import StudyRequest, run_missing
from baldwinlab.api.study import Study
from baldwinlab.core import console
from baldwinlab.core.errors import RefusedError, require_positive
from baldwinlab.core.files import parse_location
from baldwinlab.experiment import assign
from baldwinlab.experiment.unused_settings import require_effect
from baldwinlab.papers.paper import STANDARD
from baldwinlab.studies.assays.results import find_missing_assays

MAX_NAME: Final = 120
"""Maximal number of characters of the name of a folder."""
SHORT_NAMES: Final = {"evolution.generations": "generations", "lifetime.steps": "steps"}


@dataclass(frozen=True)
class Reproduction:
    """A paper to reproduce, and the differences from its own settings.

    Attributes
    ----------
    paper
        The paper.
    assignments
        Settings that change its model, such as "lifetime.steps=100".
    variant
        Name of a variant of its model.
    runs
        Number of runs of each condition; that of the paper if None.
    seed
        Seed of the study.
    out
        Directory of the study; a folder of results/ if None.
    last
        Number of final generations that are averaged in each run.
    """

    paper: papers.Paper
    assignments: Sequence[str] = ()
    variant: str = STANDARD
    runs: int | None = None
    seed: int = 0
    out: str | Path | None = None
    last: int = 10

    @property
    def runs_of_condition(self) -> int:
        """Return the number of runs of each condition."""
        return self.paper.metadata.runs if self.runs is None else self.runs

    @property
    def directory(self) -> Path:
        """Return the directory of the study."""
        return Path("results") / self.folder_name if self.out is None else parse_location(self.out)

    @property
    def folder_name(self) -> str:
        """Return the default name of the directory, with every difference from the paper."""
        words = ["paper" if self.paper.name == papers.DEFAULT else self.paper.name]
        words += [self.variant] * (self.variant != STANDARD)
        for assignment in self.assignments:
            path, _, value = assignment.partition("=")
            word = f"{SHORT_NAMES[path]}{value}" if path in SHORT_NAMES else assignment
            words.append(re.sub(r"[^\w.=+-]+", "_", word))
        words += [f"seed{self.seed}"] * bool(self.seed)
        return "-".join(words)[:MAX_NAME]


def reproduce(
    paper: str | Path = papers.DEFAULT,
    *,
    runs: int | None = None,
    generations: int | None = None,
    steps: int | None = None,
    seed: int = 0,
    variant: str = STANDARD,
    out: str | Path | None = None,
    last: int = 10,
    workers: int | None = None,
    backend: str = "auto",
    executor: str = "threads",
    set: Mapping[str, Any] | None = None,
    force: bool = False,
) -> Study:
    """Run every condition of a paper and its assays, and write the report.

    The report is written after the runs, and again after the assays. The same call again does only
    what is missing.

    Parameters
    ----------
    paper
        Name of a paper, or folder of a custom paper.
    runs
        Number of runs of each condition, 1 to 2**31; by default as in the paper.
    generations, steps
        Number of generations of a run, and number of steps of a forager's life; by default as in
        the paper. Other values change the model, as `set` does.
    seed
        Seed of all random numbers, 0 to 2**31 - 1.
    variant
        Name of a variant of the model: an interpretation of the paper.
    out
        Directory of the study, or a URL that fsspec can open. By default results/PAPER, with every
        difference from the paper in its name; results/paper for the first paper, le-2019.
    last
        Number of final generations that are averaged in each run, at least 1.
    workers
        Number of threads, at least 1; by default one per core. With the executor "slurm", the
        number of jobs.
    backend
        "cpu", "cuda", or "auto" for the fastest that is available.
    executor
        "threads", "dask:tcp://HOST:PORT", or "slurm".
    set
        Settings to change in all conditions, such as {"lifetime.steps": 100}. The model then
        differs from the paper, and all results say so.
    force
        Run even if less memory or disk is free than the estimate.

    Returns
    -------
    Study
        The study, on disk.

    Raises
    ------
    PaperError
        The paper does not exist or is not valid.
    ExperimentError
        The variant or a setting does not exist, or a setting has no effect.
    ArgumentError
        A number is out of range.
    StudyError
        The directory holds another study. These four are raised before anything is written.
    RefusedError
        The paper has no foragers and `steps` is given; the backend cannot be used on this machine;
        or too little memory or disk is free for runs, assays and report.
    InterruptedStudyError
        A worker or a disk failed. The stored runs remain, and the same call continues.
    """
    load_installed()
    chosen = papers.load(paper)
    lengths = format_length_assignments(chosen, generations, steps)
    request = Reproduction(
        chosen,
        assignments=(*lengths, *format_assignments(set or {})),
        variant=variant,
        runs=runs,
        seed=seed,
        out=out,
        last=last,
    )
    return reproduce_changed(request, RunOptions(workers, backend, executor, force))


def format_length_assignments(
    paper: papers.Paper, generations: int | None, steps: int | None
) -> list[str]:
    """Return the assignments of these lengths.

    Parameters
    ----------
    paper
        The paper.
    generations
        Number of generations of a run; None for that of the paper.
    steps
        Number of steps of a forager's life; None for that of the paper.

    Returns
    -------
    list of str
        Assignments, such as "lifetime.steps=100".

    Raises
    ------
    RefusedError
        `steps` is given, and the paper has no foragers.
    """
    if steps is not None and not are_foragers(paper.experiments()):
        raise RefusedError(
            f"--steps {steps} applies to foragers; {paper.name} has none, and its model sets the "
            "length of a life: remove --steps"
        )
    values = {"evolution.generations": generations, "lifetime.steps": steps}
    return [f"{path}={value}" for path, value in values.items() if value is not None]


def reproduce_changed(request: Reproduction, options: RunOptions) -> Study:
    """Reproduce a paper, whose model may be changed. `reproduce` and its command call this.

    Parameters
    ----------
    request
        The paper and the changes.
    options
        Workers, backend, executor and force.

    Returns
    -------
    Study
        The study, on disk.

    Raises
    ------
    ExperimentError
        The variant or a setting does not exist, or a setting has no effect.
    ArgumentError
        A number is out of range.
    StudyError
        The directory holds another study.
    RefusedError
        The backend cannot be used on this machine, or too little memory or disk is free.
    InterruptedStudyError
        A worker or a disk failed.
    """
    paper = request.paper
    originals = paper.experiments(request.variant)
    experiments = [assign(original, request.assignments) for original in originals]
    require_effect(experiments, originals)
    require_positive("last", request.last)
    runs = request.runs_of_condition
    study_request = StudyRequest(
        experiments,
        request.directory,
        runs=runs,
        seed=request.seed,
        paper=paper,
        changes=request.assignments if experiments != originals else (),
        later_need=estimate_later_need(experiments, paper, runs, options.workers),
    )
    for sentence in describe_missing_runs(experiments, paper, runs):
        console.info(sentence)
    study = run_missing(study_request, options)

    def run_assays() -> None:
        """Run the missing assays, after the first report."""
        console.info("The report lacks the assays. They run now; then it is written again.")
        run_missing_assays(study, paper.metadata.assays, options)

    has_missing_assays = any(find_missing_assays(study, paper.metadata.assays).values())
    report(
        study,
        last=request.last,
        force=options.force,
        add_results=run_assays if has_missing_assays else None,
        paper=paper,
    )
    return Study(study)
