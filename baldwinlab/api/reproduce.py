"""A paper, whole: its conditions, its assays and its report."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from baldwinlab import console, papers
from baldwinlab.api.bring import How, assay, bring
from baldwinlab.api.installed import load_installed
from baldwinlab.api.report import report
from baldwinlab.api.study import Study
from baldwinlab.assays import missing_assays
from baldwinlab.assays.estimate import Planned
from baldwinlab.errors import RefusedError, require_positive
from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.files import location
from baldwinlab.papers.verdicts import planned_claim_designs
from baldwinlab.publish import of_emergence
from baldwinlab.resources import Need
from baldwinlab.runs import estimate
from baldwinlab.runs.warm_up import available_cores
from baldwinlab.statistics.sample_sizes import describe_too_few


def reproduce(
    paper: str | Path = papers.DEFAULT,
    *,
    runs: int | None = None,
    generations: int | None = None,
    steps: int | None = None,
    seed: int = 0,
    reading: str = "standard",
    out: str | Path | None = None,
    last: int = 10,
    workers: int | None = None,
    backend: str = "auto",
    executor: str = "threads",
    force: bool = False,
) -> Study:
    """Run every condition of a paper and its assays, and write the report: when the runs are done, and again with the assays.

    `out` is a folder of results/ unless given.
    `paper` is the name of one, or the folder of a user's own; unless given, `runs` of each condition are as many as it has.
    `generations` and `steps` (of a life) shorten it. Raises PaperError for a paper that there is not, ExperimentError for a
    reading, RefusedError for `steps` where lives have none, and as `run` does, which counts in the assays and the report.
    """
    load_installed()
    chosen = papers.load(paper)
    changes: dict[str, Any] = {}
    if generations is not None:
        changes["evolution"] = {"generations": generations}
    experiments = chosen.experiments(reading)
    if steps is not None:
        if not are_foragers(experiments):
            raise RefusedError(f"--steps is of foragers; {chosen.name} has none, and its lives are as long as its model says")
        changes["lifetime"] = {"steps": steps}
    experiments = [experiment.replace(**changes) for experiment in experiments]
    given = {"": reading if reading != "standard" else None, "generations": generations, "steps": steps, "seed": seed or None}
    require_positive("last", last)
    directory = Path("results") / _name(chosen, given) if out is None else location(out)
    wanted = chosen.about.runs if runs is None else runs
    how, afterwards = How(workers, backend, executor, force), _afterwards(experiments, chosen, wanted, workers)
    for sentence in too_few_runs(experiments, chosen, wanted):
        console.say(sentence)
    study = bring(experiments, directory, how, runs=wanted, seed=seed, paper=chosen, afterwards=afterwards)

    def assays() -> None:
        console.say("so far without assays: they follow, and then the report is written again, with them")
        assay(study, chosen.about.assays, how)

    then = assays if any(missing_assays(study, chosen.about.assays).values()) else None
    report(study, last=last, force=force, then=then, paper=chosen)
    return Study(study)


def are_foragers(experiments: Sequence[BaseExperiment]) -> bool:
    """Whether all are of the model whose lives have steps that can be given."""
    return all(isinstance(experiment, Experiment) for experiment in experiments)


def too_few_runs(experiments: Sequence[Experiment], paper: papers.Paper, runs: int) -> Iterator[str]:
    """Say which verdicts so few runs cannot give: on the claims, and on the Baldwin effect."""
    names = [experiment.name for experiment in experiments]
    if claims := describe_too_few(planned_claim_designs(paper.claims, names, runs)):
        yield f"Claims: {claims}"
    if effect := describe_too_few(_planned(experiments, paper).designs(runs, paper.about.assays)):
        yield f"Baldwin effect: {effect}"


def _planned(experiments: Sequence[Experiment], paper: papers.Paper) -> Planned:
    by_name = {experiment.name: experiment for experiment in experiments}
    return Planned(by_name, {name: found for name, found in paper.factors().items() if name in by_name})


def _afterwards(experiments: Sequence[Experiment], paper: papers.Paper, runs: int, workers: int | None) -> Need:
    """What the assays and the report take."""
    by_name = {experiment.name: experiment for experiment in experiments}
    assays = _planned(experiments, paper).need(runs, workers or available_cores(), paper.about.assays)
    shown = by_name.get(paper.about.emergence, experiments[0])
    return assays.then(estimate.of_tables([(one, runs) for one in experiments])).then(of_emergence(shown))


def _name(paper: papers.Paper, given: Mapping[str, object]) -> str:
    """Of the folder for a study of this paper, with what is otherwise than in the paper."""
    first = "paper" if paper.name == papers.DEFAULT else paper.name
    return "-".join([first, *(f"{key}{value}" for key, value in given.items() if value is not None)])
