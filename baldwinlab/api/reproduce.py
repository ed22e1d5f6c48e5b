"""A paper, whole: its conditions, its assays and its report."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from baldwinlab import papers
from baldwinlab.analysis.assays.analysis import planned_designs
from baldwinlab.analysis.claims import planned_claim_designs
from baldwinlab.analysis.statistics.sample_sizes import describe_too_few
from baldwinlab.api.load import load_installed
from baldwinlab.api.publish.study import of_emergence
from baldwinlab.api.report import report
from baldwinlab.api.run import assignments_of
from baldwinlab.api.run_study import How, assay, bring
from baldwinlab.api.study import Study
from baldwinlab.core import console
from baldwinlab.core.errors import RefusedError, require_positive
from baldwinlab.core.files import location
from baldwinlab.core.resources import Need
from baldwinlab.experiment import BaseExperiment, Experiment, assign
from baldwinlab.experiment.unused_settings import require_effect
from baldwinlab.papers.paper import STANDARD
from baldwinlab.simulation import memory
from baldwinlab.simulation.compilation import available_cores
from baldwinlab.studies.assays.memory import Planned
from baldwinlab.studies.assays.run import missing_assays

LONGEST_NAME: Final = 120  # of a folder, in characters
SHORT_NAMES: Final = {"evolution.generations": "generations", "lifetime.steps": "steps"}


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
    """Run every condition of a paper and its assays, and write the report: when the runs are done, and again with the assays.

    Parameters
    ----------
    paper
        The name of a paper, or the folder of a custom one.
    runs
        Runs of each condition, by default as many as the paper has.
    generations, steps
        Generations of a run, and steps of a forager's life. They change the model, as `set` does.
    variant
        An interpretation of the paper.
    out
        The directory of the study, by default a folder of results/.
    set
        Fields to change in all conditions, such as {"lifetime.steps": 100}. The study is then one of a changed model, and
        all its results say so.

    Raises
    ------
    PaperError
        For a paper that does not exist or is not valid.
    ExperimentError
        For an unknown variant or field, and for a field without effect.
    RefusedError
        For `steps` where lives have none; and as `run` does, which counts in the assays and the report.
    """
    load_installed()
    chosen = papers.load(paper)
    assignments = [*lengths(chosen, generations, steps), *assignments_of(set or {})]
    how = How(workers, backend, executor, force)
    return reproduce_changed(
        chosen, assignments, how, runs=runs, seed=seed, variant=variant, out=out, last=last
    )


def lengths(paper: papers.Paper, generations: int | None, steps: int | None) -> list[str]:
    """Return the assignments of these lengths. Raises RefusedError for steps where lives have none."""
    if steps is not None and not are_foragers(paper.experiments()):
        raise RefusedError(
            f"--steps is of foragers; {paper.name} has none, and its lives are as long as its model says"
        )
    given = {"evolution.generations": generations, "lifetime.steps": steps}
    return [f"{path}={value}" for path, value in given.items() if value is not None]


def reproduce_changed(
    paper: papers.Paper,
    assignments: Sequence[str],
    how: How,
    *,
    runs: int | None,
    seed: int,
    variant: str,
    out: str | Path | None,
    last: int,
) -> Study:
    """Reproduce a paper whose model is changed by assignments, or not at all. `reproduce` and its command call this."""
    originals = paper.experiments(variant)
    experiments = [assign(original, assignments) for original in originals]
    require_effect(experiments, originals)
    changes = assignments if experiments != originals else ()
    require_positive("last", last)
    name = _name(paper, variant, assignments, seed)
    directory = Path("results") / name if out is None else location(out)
    wanted = paper.about.runs if runs is None else runs
    afterwards = _afterwards(experiments, paper, wanted, how.workers)
    for sentence in too_few_runs(experiments, paper, wanted):
        console.info(sentence)
    study = bring(
        experiments,
        directory,
        how,
        runs=wanted,
        seed=seed,
        paper=paper,
        changes=changes,
        afterwards=afterwards,
    )

    def assays() -> None:
        console.info(
            "so far without assays: they follow, and then the report is written again, with them"
        )
        assay(study, paper.about.assays, how)

    then = assays if any(missing_assays(study, paper.about.assays).values()) else None
    report(study, last=last, force=how.force, then=then, paper=paper)
    return Study(study)


def are_foragers(experiments: Sequence[BaseExperiment]) -> bool:
    """Whether all are of the model whose lives have steps that can be given."""
    return all(isinstance(experiment, Experiment) for experiment in experiments)


def too_few_runs(
    experiments: Sequence[Experiment], paper: papers.Paper, runs: int
) -> Iterator[str]:
    """Say which verdicts so few runs cannot give: on the claims, and on the Baldwin effect."""
    names = [experiment.name for experiment in experiments]
    if claims := describe_too_few(planned_claim_designs(paper.claims, names, runs)):
        yield f"Claims: {claims}"
    planned = _planned(experiments, paper)
    assays = planned.fitting(paper.about.assays)
    if effect := describe_too_few(planned_designs(planned.experiments, assays, runs)):
        yield f"Baldwin effect: {effect}"


def _planned(experiments: Sequence[Experiment], paper: papers.Paper) -> Planned:
    by_name = {experiment.name: experiment for experiment in experiments}
    return Planned(
        by_name, {name: found for name, found in paper.factors().items() if name in by_name}
    )


def _afterwards(
    experiments: Sequence[Experiment], paper: papers.Paper, runs: int, workers: int | None
) -> Need:
    """What the assays and the report take."""
    by_name = {experiment.name: experiment for experiment in experiments}
    assays = _planned(experiments, paper).need(
        runs, workers or available_cores(), paper.about.assays
    )
    shown = by_name.get(paper.about.emergence, experiments[0])
    return assays.then(memory.of_tables([(one, runs) for one in experiments])).then(
        of_emergence(shown)
    )


def _name(paper: papers.Paper, variant: str, assignments: Sequence[str], seed: int) -> str:
    """Return the name of the folder for a study of this paper, with everything that is not as in the paper."""
    words = ["paper" if paper.name == papers.DEFAULT else paper.name]
    words += [variant] * (variant != STANDARD)
    for assignment in assignments:
        path, _, value = assignment.partition("=")
        word = f"{SHORT_NAMES[path]}{value}" if path in SHORT_NAMES else assignment
        words.append(re.sub(r"[^\w.=+-]+", "_", word))
    words += [f"seed{seed}"] * bool(seed)
    return "-".join(words)[:LONGEST_NAME]
