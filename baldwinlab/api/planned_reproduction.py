"""Estimates before a reproduction: verdicts that need more runs, memory and disk."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from baldwinlab import papers
from baldwinlab.analysis.assays.analysis import planned_tests
from baldwinlab.analysis.claims import planned_claim_tests
from baldwinlab.analysis.statistics.sample_sizes import describe_too_few
from baldwinlab.api.publish.added_runs import format_instruction
from baldwinlab.api.publish.plan import replay_memory
from baldwinlab.core.resources import Need
from baldwinlab.engine.threads import available_cores
from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.simulation import memory
from baldwinlab.studies.assays.memory import PlannedStudy


def are_foragers(experiments: Sequence[BaseExperiment]) -> bool:
    """Return whether all experiments use the model "miniworld".

    Returns True if the agents of all experiments are foragers, whose number of steps is a setting.
    """
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
    assays = plan.select_applicable(paper.metadata.assays)
    assay_tests = planned_tests(plan.experiments, assays, runs)
    if assays_note := describe_too_few(assay_tests, instruction=instruction):
        yield f"Baldwin effect: {assays_note}"


def _plan_assays(experiments: Sequence[Experiment], paper: papers.Paper) -> PlannedStudy:
    by_name = {experiment.name: experiment for experiment in experiments}
    factors = {name: value for name, value in paper.factors().items() if name in by_name}
    return PlannedStudy(by_name, factors)


def estimate_later_need(
    experiments: Sequence[Experiment], paper: papers.Paper, runs: int, workers: int | None
) -> Need:
    """Estimate the memory and disk of the assays and the report.

    `workers`: number of threads; None for one per core.
    """
    by_name = {experiment.name: experiment for experiment in experiments}
    plan = _plan_assays(experiments, paper)
    need = plan.need(runs, workers or available_cores(), paper.metadata.assays)
    tables_need = memory.estimate_tables([(experiment, runs) for experiment in experiments])
    replayed_experiment = by_name.get(paper.metadata.emergence, experiments[0])
    return need.add_later(tables_need).add_later(replay_memory(replayed_experiment))
