"""The plan of a report: its paper, its figure of emergence, and the memory that it requires."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from baldwinlab.analysis.report import emergence_generations
from baldwinlab.core.resources import NO_NEED, Need
from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.experiment.factors import CONDITIONS, MULTIVERSE
from baldwinlab.papers import Paper, load_stored_paper
from baldwinlab.papers.texts import DEFAULT_FIGURES
from baldwinlab.simulation.memory import estimate_replay, estimate_tables
from baldwinlab.studies.store import StudyStore


@dataclass(frozen=True)
class ReportPlan:
    """A report to write, with its paper and the condition of its figure of emergence.

    Attributes
    ----------
    study : StudyStore
        The study.
    out : Path
        HTML file to write.
    last : int
        Number of final generations to average in each run.
    baseline : str
        Condition with which all others are compared, or "" for the default.
    paper : Paper or None
        Paper whose claims are evaluated.
    emergence_condition : str or None
        Condition whose emergence is shown, if any.
    """

    study: StudyStore
    out: Path
    last: int = 10
    baseline: str = ""
    paper: Paper | None = None
    emergence_condition: str | None = None


def plan_report(
    study: StudyStore, out: Path, last: int = 10, baseline: str = "", paper: Paper | None = None
) -> ReportPlan:
    """Return the plan of a report, from which its memory is estimated and the report is written.

    Parameters
    ----------
    study : StudyStore
        The study.
    out : Path
        HTML file to write.
    last : int
        Number of final generations to average in each run.
    baseline : str
        Condition with which all others are compared, or "" for the default.
    paper : Paper or None
        Paper whose claims are evaluated. Defaults to the paper that defines the study, if any.

    Returns
    -------
    ReportPlan
        The plan.

    Raises
    ------
    PaperError
        The paper of the study cannot be read.
    """
    if paper is None and (study.paper or study.kind == MULTIVERSE):
        paper = load_stored_paper(study.directory, study.paper)
    condition = _emergence_condition(study, paper) if study.kind == CONDITIONS else None
    return ReportPlan(study, out, last, baseline, paper, condition)


def _emergence_condition(study: StudyStore, paper: Paper | None) -> str | None:
    """Return the condition of the figure of emergence: the paper's choice, or the first one."""
    if "emergence" not in (paper.metadata.figures if paper else DEFAULT_FIGURES):
        return None
    preferred = (paper.metadata.emergence if paper else "", *study.experiments)
    for name in preferred:
        if name in study.experiments and study.runs(name) and can_replay(study, name):
            return name
    return None


def can_replay(study: StudyStore, condition: str) -> bool:
    """Return whether a condition is of the MiniWorld model and its parts are loaded.

    Parameters
    ----------
    study
        The study.
    condition
        The name of the condition.
    """
    # PartError is a ValueError.
    try:
        study.require_parts(condition)
    except ValueError:
        return False
    return isinstance(study.experiments[condition], Experiment)


def required_memory(plan: ReportPlan) -> Need:
    """Estimate the memory of a report. A multiverse is processed one variant at a time.

    Parameters
    ----------
    plan
        The plan of the report.
    """
    study = plan.study
    groups: dict[str, list[tuple[Experiment, int]]] = {}
    for name, experiment in study.experiments.items():
        group = groups.setdefault(study.factors[name].variant, [])
        group.append((experiment, len(study.runs(name))))
    tables = max((estimate_tables(group) for group in groups.values()), default=NO_NEED)
    if plan.emergence_condition is None:
        return tables
    return tables.add_later(replay_memory(study.experiments[plan.emergence_condition]))


def replay_memory(experiment: BaseExperiment) -> Need:
    """Estimate the memory of the lifetimes in the figure of emergence.

    Parameters
    ----------
    experiment
        The experiment.
    """
    if not isinstance(experiment, Experiment):
        return NO_NEED
    lives = len(emergence_generations(experiment.evolution.generations))
    return Need(estimate_replay(experiment, lives).memory)
