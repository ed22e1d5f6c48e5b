"""The plan of a report: the paper, the replayed conditions, and the estimate of memory."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from baldwinlab.analysis.report.data import emergence_generations
from baldwinlab.analysis.report.figures import check_figures
from baldwinlab.core.resources import NO_NEED, Need
from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.experiment.conditions import CONDITIONS, MULTIVERSE
from baldwinlab.papers import Paper, load_stored_paper
from baldwinlab.papers.paper import DEFAULT_FIGURES
from baldwinlab.simulation.memory import estimate_replay, estimate_tables
from baldwinlab.studies.status import format_incomplete_sentence
from baldwinlab.studies.store import StudyStore


@dataclass(frozen=True)
class ReportPlan:
    """A report to write, with its paper and the condition of the figure of emergence."""

    study: StudyStore
    out: Path  # HTML file to write.
    last: int = 10  # Number of final generations to average in each run.
    # Condition with which all other conditions are compared, or "" for the default.
    baseline: str = ""
    paper: Paper | None = None  # Paper whose claims are evaluated.
    incomplete: str = ""  # Sentence about the stored runs that are not complete.
    # Conditions that can be replayed. Empty for a sweep and a multiverse.
    replayable: tuple[str, ...] = ()
    # Condition that is replayed for the figure of emergence. None without this figure.
    emergence_condition: str | None = None


def plan_report(
    study: StudyStore, out: Path, last: int = 10, baseline: str = "", paper: Paper | None = None
) -> ReportPlan:
    """Return the plan of a report.

    `paper`: paper whose claims are evaluated, by default the paper that defines the study, if any.
    Raises PaperError if the paper names a figure that does not exist.
    """
    if paper is None and (study.paper or study.kind == MULTIVERSE):
        paper = load_stored_paper(study.directory, study.paper)
    if paper:
        check_figures(paper)
    incomplete = format_incomplete_sentence(study)
    if study.kind != CONDITIONS:
        return ReportPlan(study, out, last, baseline, paper, incomplete)
    replayable = tuple(name for name in study.experiments if _can_replay(study, name))
    condition = _emergence_condition(study, paper, replayable)
    return ReportPlan(study, out, last, baseline, paper, incomplete, replayable, condition)


def _emergence_condition(
    study: StudyStore, paper: Paper | None, replayable: Sequence[str]
) -> str | None:
    """Return the condition of the figure of emergence, or None without this figure.

    It is the condition that the paper names, or the first condition that can be replayed.
    """
    figures = paper.metadata.figures if paper else DEFAULT_FIGURES
    if "emergence" not in figures:
        return None
    candidates = (paper.metadata.emergence if paper else "", *replayable)
    return next((name for name in candidates if name in replayable and study.runs(name)), None)


def _can_replay(study: StudyStore, condition: str) -> bool:
    """Return whether a condition has the model MiniWorld, one species, and loaded parts."""
    # PartError, for a missing or changed part, is a ValueError.
    try:
        study.require_parts(condition)
    except ValueError:
        return False
    experiment = study.experiments[condition]
    return isinstance(experiment, Experiment) and not experiment.population.species


def required_memory(plan: ReportPlan) -> Need:
    """Estimate the memory of a report. A multiverse has one variant in memory at a time."""
    study = plan.study
    runs_by_variant: dict[str, list[tuple[Experiment, int]]] = {}
    for name, experiment in study.experiments.items():
        runs_of_variant = runs_by_variant.setdefault(study.factors[name].variant, [])
        runs_of_variant.append((experiment, len(study.runs(name))))
    tables_need = max(map(estimate_tables, runs_by_variant.values()), default=NO_NEED)
    if plan.emergence_condition is None:
        return tables_need
    return tables_need.add_later(replay_memory(study.experiments[plan.emergence_condition]))


def replay_memory(experiment: BaseExperiment) -> Need:
    """Estimate the memory of the traces in the figure of emergence."""
    if not isinstance(experiment, Experiment) or experiment.population.species:
        return NO_NEED
    n_lives = len(emergence_generations(experiment.evolution.generations))
    return Need(estimate_replay(experiment, n_lives).memory)
