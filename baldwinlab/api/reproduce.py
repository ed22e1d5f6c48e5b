"""Reproduce one paper or all papers: run the conditions and assays, and write the report."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final, Unpack

from baldwinlab import papers
from baldwinlab.analysis.assays.analysis import planned_tests
from baldwinlab.analysis.claims import planned_claim_tests
from baldwinlab.analysis.report.figures import check_figures
from baldwinlab.analysis.statistics.significance import describe_too_few
from baldwinlab.api.load import load_installed_parts
from baldwinlab.api.publish.comparisons import format_instruction
from baldwinlab.api.publish.gallery import compare_papers
from baldwinlab.api.publish.plan import replay_memory
from baldwinlab.api.report import report
from baldwinlab.api.run_options import RunArguments, RunOptions, list_options
from baldwinlab.api.run_study import StudyRequest, run_missing, run_missing_assays
from baldwinlab.api.stages import StagedReproduction, run_stages
from baldwinlab.api.study import Study
from baldwinlab.core import console
from baldwinlab.core.errors import RefusedError
from baldwinlab.core.files import parse_location
from baldwinlab.core.numbers import check_numbers, require_whole_number
from baldwinlab.core.resources import Need
from baldwinlab.engine.threads import available_cores
from baldwinlab.experiment import BaseExperiment, Experiment, assign
from baldwinlab.experiment.toml import format_assignments
from baldwinlab.experiment.unused_settings import require_effect
from baldwinlab.papers import PaperError
from baldwinlab.papers.design import DESIGN_FILE, Design, read_design
from baldwinlab.papers.paper import STANDARD_VARIANT
from baldwinlab.simulation import memory
from baldwinlab.studies.assays.catalog import PlannedStudy, get_assays, list_default_assays
from baldwinlab.studies.assays.results import find_missing_assays
from baldwinlab.studies.records import StudyError
from baldwinlab.studies.store import StudyStore

MAX_FOLDER_NAME: Final = 120
"""Maximum number of characters of the name of a folder."""
# The folder of the study of the default paper.
DEFAULT_PAPER_FOLDER: Final = "paper"
SHORT_SETTING_NAMES: Final = {"evolution.generations": "generations", "lifetime.steps": "steps"}
"""Names of settings in the name of a folder, by the path of the setting."""


@dataclass(frozen=True)
class Reproduction:
    """A paper to reproduce, with changes of its settings."""

    paper: papers.Paper
    # Number of runs of each condition, number of generations of a run, and number of steps of a
    # forager's life. None: as in the paper.
    runs: int | None = None
    generations: int | None = None
    steps: int | None = None
    seed: int = 0
    variant: str = STANDARD_VARIANT
    # Settings that change the model of the paper, such as "learning.rate=0.1".
    assignments: Sequence[str] = ()
    # Directory of the study. If None: results/ followed by `folder_name`.
    out: str | Path | None = None
    last: int = 10  # Number of final generations that are averaged in each run.
    is_quick: bool = False  # Whether to run the short form of a paper with stages.

    @property
    def runs_of_condition(self) -> int:
        """Return the number of runs of each condition."""
        return self.paper.metadata.runs if self.runs is None else self.runs

    @property
    def changes(self) -> list[str]:
        """Return all changes, such as ["evolution.generations=20", "learning.rate=0.1"]."""
        values = {"evolution.generations": self.generations, "lifetime.steps": self.steps}
        lengths = [f"{path}={value}" for path, value in values.items() if value is not None]
        return [*lengths, *self.assignments]

    @property
    def directory(self) -> Path:
        """Return the directory of the study."""
        return Path("results") / self.folder_name if self.out is None else parse_location(self.out)

    @property
    def folder_name(self) -> str:
        """Return the paper, then each changed setting, such as "paper-generations20-seed1"."""
        words = [
            DEFAULT_PAPER_FOLDER if self.paper.name == papers.DEFAULT_PAPER else self.paper.name
        ]
        if self.variant != STANDARD_VARIANT:
            words.append(self.variant)
        for assignment in self.changes:
            path, _, value = assignment.partition("=")
            has_short_name = path in SHORT_SETTING_NAMES
            word = f"{SHORT_SETTING_NAMES[path]}{value}" if has_short_name else assignment
            words.append(re.sub(r"[^\w.=+-]+", "_", word))
        if self.seed:
            words.append(f"seed{self.seed}")
        if self.is_quick:
            words.append("quick")
        return "-".join(words)[:MAX_FOLDER_NAME]


@check_numbers
@list_options(RunOptions)
def reproduce(
    paper: str | Path = papers.DEFAULT_PAPER,
    *,
    runs: int | None = None,
    generations: int | None = None,
    steps: int | None = None,
    seed: int = 0,
    variant: str = STANDARD_VARIANT,
    out: str | Path | None = None,
    last: int = 10,
    set: Mapping[str, Any] | None = None,
    quick: bool = False,
    **options: Unpack[RunArguments],
) -> Study:
    """Run every condition of a paper and its assays, and write the report.

    The report is written after the runs, and again after the assays. A repeated call simulates only
    the missing runs and assays. Nothing is written if PaperError, ExperimentError, ArgumentError or
    StudyError is raised.

    Parameters
    ----------
    paper : str or pathlib.Path
        Name of a paper, or folder of a custom paper.
    runs : int or None
        Number of runs of each condition, 1 to 2**31; by default as in the paper.
    generations, steps : int or None
        Number of generations of a run, and number of steps of a forager's life; by default as in
        the paper. Other values change the model, as `set` does.
    seed : int
        Seed of all random numbers, 0 to 2**31 - 1.
    variant : str
        Name of a variant of the model: an interpretation of the paper.
    out : str, pathlib.Path or None
        Directory of the study, or a URL that fsspec can open. By default results/PAPER, followed by
        each changed setting. The default paper, le-2019, has the directory results/paper.
    last : int
        Number of final generations that are averaged in each run, at least 1.
    set : mapping or None
        Settings to change in all conditions, such as {"lifetime.steps": 100}. The model then
        differs from the paper, and all results say so.
    quick : bool
        Run the short form of a paper with stages, to check the procedure. It has fewer maps and too
        few runs for verdicts.
    **options
        Fields of `RunOptions`.

    Returns
    -------
    Study
        The study, on disk. For a paper with stages, the study of the confirmation.

    Raises
    ------
    PaperError
        The paper does not exist or is not valid.
    ExperimentError
        The variant or a setting does not exist, or a setting has no effect.
    ArgumentError
        A number is out of range.
    StudyError
        The directory holds another study.
    RefusedError
        The paper has no foragers and `steps` is given, no stages and `quick` is given, or stages
        and `variant` is given; the backend cannot be used on this machine; or too little memory or
        disk is free for runs, assays and report.
    InterruptedStudyError
        A worker or a disk failed. The stored runs remain, and a repeated call continues.

    Examples
    --------
    >>> import baldwinlab as bl
    >>> study = bl.reproduce("hinton-nowlan-1987", runs=1, generations=2, out="needle")
    >>> study.conditions
    ('guessing', 'guessing-100', 'guessing-10000', 'all-set', 'never-guessing')
    """
    run_options = RunOptions(**options)
    load_installed_parts()
    request = Reproduction(
        papers.load(paper),
        runs=runs,
        generations=generations,
        steps=steps,
        seed=seed,
        variant=variant,
        assignments=format_assignments(set or {}),
        out=out,
        last=last,
        is_quick=quick,
    )
    return Study(run_reproduction(request, run_options))


def run_reproduction(request: Reproduction, options: RunOptions) -> StudyStore:
    """Reproduce a paper. Return the study, or for a paper with stages that of the confirmation."""
    require_whole_number("last", request.last)
    require_whole_number("runs", request.runs_of_condition)
    require_whole_number("seed", request.seed)
    paper = request.paper
    check_figures(paper)
    assays = select_assays(paper)
    if request.steps is not None and not are_foragers(paper.experiments()):
        raise RefusedError(
            f"--steps {request.steps} applies to foragers; {paper.name} has none, and its model "
            "sets the length of a life: remove --steps"
        )
    design = read_design(paper)
    if design:
        return run_stages(_plan_stages(request, design), options)
    if request.is_quick:
        raise RefusedError(
            f"--quick applies to papers with stages (a file {DESIGN_FILE}); "
            f"{paper.name} has none: use --runs"
        )
    study = run_missing(_plan_study(request, options), options)

    def run_assays() -> None:
        """Run the missing assays, after the first report."""
        console.info("The report lacks the assays. They run now; then it is written again.")
        run_missing_assays(study, assays, options)

    has_missing_assays = any(find_missing_assays(study, assays).values())
    # The report is written once before the assays and once after them.
    add_results = run_assays if has_missing_assays else None
    report(study, last=request.last, force=options.force, add_results=add_results, paper=paper)
    return study


def _plan_study(request: Reproduction, options: RunOptions) -> StudyRequest:
    """Return the study of a paper without stages, and print which verdicts need more runs."""
    paper = request.paper
    originals = paper.experiments(request.variant)
    experiments = [assign(original, request.changes) for original in originals]
    require_effect(experiments, originals)
    runs = request.runs_of_condition
    # Assignments of the values that the paper has change nothing, so the report names no change.
    changes = request.changes if experiments != originals else ()
    for sentence in describe_too_few_runs(experiments, paper, runs, request.directory):
        console.info(sentence)
    return StudyRequest(
        experiments,
        request.directory,
        runs=runs,
        seed=request.seed,
        paper=paper,
        changes=changes,
        later_need=estimate_later_need(experiments, paper, runs, options.workers),
        first_run=paper.metadata.first_run,
    )


def _plan_stages(request: Reproduction, design: Design) -> StagedReproduction:
    """Return the stages of a paper with a design."""
    paper = request.paper
    if request.variant != STANDARD_VARIANT:
        raise RefusedError(
            f"--variant {request.variant} applies to papers without stages; "
            f"{paper.name} has stages ({DESIGN_FILE}): remove --variant"
        )
    runs = request.runs or (design.quick.runs if request.is_quick else paper.metadata.runs)
    if request.is_quick:
        design = design.shorten()
    # Runs after `design.tuning.runs` belong to the confirmation.
    tuning_runs = min(runs, design.tuning.runs)
    return StagedReproduction(
        paper,
        design.with_tuning_runs(tuning_runs),
        request.directory,
        maps=(design.quick.maps if request.is_quick else paper.metadata.maps) or ("",),
        runs=runs,
        seed=request.seed,
        assignments=request.changes,
        last=request.last,
    )


def reproduce_all(folder: Path, request: Reproduction, options: RunOptions) -> Path:
    """Reproduce every built-in paper, compare the papers on one page, and return its path.

    A paper with stages is reproduced in its quick form, and a paper without foragers ignores the
    number of steps. A repeated call simulates only the missing runs and assays.

    `folder`: gets one folder per paper. `request`: options of all papers, except `paper` and `out`.
    """
    names = list(papers.built_in())
    for paper_number, name in enumerate(names, 1):
        console.info(f"{name}, paper {paper_number} of {len(names)}")
        paper = papers.load(name)
        request_of_paper = replace(
            request,
            paper=paper,
            steps=request.steps if are_foragers(paper.experiments()) else None,
            out=folder / (DEFAULT_PAPER_FOLDER if name == papers.DEFAULT_PAPER else name),
            # The stages of a full study take longer than all other papers.
            is_quick=read_design(paper) is not None,
        )
        run_reproduction(request_of_paper, options)
    return compare_papers(folder, last=request.last)


def are_foragers(experiments: Sequence[BaseExperiment]) -> bool:
    """Return whether all experiments have the model "miniworld", with `lifetime.steps`."""
    return all(isinstance(experiment, Experiment) for experiment in experiments)


def describe_too_few_runs(
    experiments: Sequence[Experiment], paper: papers.Paper, runs: int, directory: Path
) -> Iterator[str]:
    """Yield a sentence for each group of verdicts that needs more runs than `runs`."""
    instruction = format_instruction(directory)
    names = [experiment.name for experiment in experiments]
    claim_tests = planned_claim_tests(paper.claims, names, runs)
    if claims_note := describe_too_few(claim_tests, instruction=instruction):
        yield f"Claims: {claims_note}"
    plan = _plan_assays(experiments, paper)
    assays = plan.select_applicable(select_assays(paper))
    assay_tests = planned_tests(plan.experiments, assays, runs)
    if assays_note := describe_too_few(assay_tests, instruction=instruction):
        yield f"Baldwin effect: {assays_note}"


def select_assays(paper: papers.Paper) -> tuple[str, ...]:
    """Return the names of the assays of a paper. Raise PaperError for an unknown name."""
    names = paper.metadata.assays
    if names is None:
        return list_default_assays()
    try:
        get_assays(names)
    except StudyError as error:
        raise PaperError(f"{paper.folder / 'paper.toml'}: assays: {error}") from None
    return names


def _plan_assays(experiments: Sequence[Experiment], paper: papers.Paper) -> PlannedStudy:
    """Return the conditions with their factors, for estimates before the study exists."""
    by_name = {experiment.name: experiment for experiment in experiments}
    factors = {name: value for name, value in paper.factors().items() if name in by_name}
    return PlannedStudy(by_name, factors)


def estimate_later_need(
    experiments: Sequence[Experiment], paper: papers.Paper, runs: int, workers: int | None
) -> Need:
    """Estimate the memory and disk of assays and report. `workers`: None for one per core."""
    plan = _plan_assays(experiments, paper)
    need = plan.need(runs, workers or available_cores(), select_assays(paper))
    tables_need = memory.estimate_tables([(experiment, runs) for experiment in experiments])
    # The report replays a lifetime of the condition in the figure "emergence".
    replayed_experiment = plan.experiments.get(paper.metadata.emergence, experiments[0])
    return need.add_later(tables_need).add_later(replay_memory(replayed_experiment))
