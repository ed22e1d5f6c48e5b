"""From a stored study to its statistics, figures and report."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import xarray as xr

from baldwinlab.analysis.assays import learner_comparison
from baldwinlab.analysis.assays import section as assays
from baldwinlab.analysis.assays.analysis import Analysis
from baldwinlab.analysis.assays.analysis import evaluate as evaluate_assays
from baldwinlab.analysis.assays.values import Assays
from baldwinlab.analysis.claims import ClaimResult, claim_records, evaluate, write
from baldwinlab.analysis.multiverse import section as variants
from baldwinlab.analysis.multiverse.analysis import STANDARD, read
from baldwinlab.analysis.report import (
    InShort,
    Section,
    draw_report,
    emergence_generations,
    write_report,
)
from baldwinlab.analysis.report.content import describe_variant, run_counts
from baldwinlab.analysis.statistics import fitness
from baldwinlab.analysis.statistics.contrasts import Contrasts, compare_conditions
from baldwinlab.api.publish import lab_results
from baldwinlab.api.publish import sweep as sweeps
from baldwinlab.api.publish.multiverse import FILE, FOLDERS
from baldwinlab.core.resources import NOTHING, Need
from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.experiment.factors import CONDITIONS, SWEEP
from baldwinlab.models.miniworld.appearance import look
from baldwinlab.papers import Paper, of_study
from baldwinlab.papers.texts import FIGURES
from baldwinlab.simulation.memory import estimate_replay, estimate_tables
from baldwinlab.simulation.replay import replay
from baldwinlab.studies.assays import storage
from baldwinlab.studies.claims_file import write_claims
from baldwinlab.studies.open import open_runs
from baldwinlab.studies.provenance import provenance
from baldwinlab.studies.store import StudyStore


class Published(NamedTuple):
    """What came of a study."""

    claims: Sequence[ClaimResult]
    contrasts: Contrasts
    write: Callable[
        [], object
    ]  # the report again, with what other commands have left in the study's folder since


def publish(
    study: StudyStore,
    out: Path,
    last: int,
    tell: Callable[[str], None],
    baseline: str = "",
    paper: Paper | None = None,
) -> Published:
    """Write claims.json, statistics.csv, summary.csv, the figures, the report and what the lab shows.

    Claims are those of `paper`, or else of the paper that made the study; a study that no paper made has none. Conditions are
    compared with `baseline` where one is given. A sweep has other results, those of `sweeps.publish`, and no claims. A run counts
    with its average over its `last` generations. Raises StudyError if no run is stored yet.
    """
    if study.kind == SWEEP:
        compared = sweeps.publish(study, out, last, tell, baseline)
        lab_results.keep(study)
        return Published([], compared, lambda: sweeps.publish(study, out, last, tell, baseline))
    study.require_runs()
    data = fitness.with_curves(open_runs(study.directory))
    paper = paper or (of_study(study.directory, study.paper) if study.paper else None)
    results = evaluate(data, last, paper) if paper else []
    compared = compare_conditions(data, last, baseline)
    write_claims(study, claim_records(results, paper.name if paper else "", study.changes))
    write(results, data, study.directory, last, compared.rows)
    tell("drawing the figures")
    traces = _emergence(study, data, paper)
    looks, reproduced = _looks(study), bool(study.paper)
    drawn = draw_report(
        study.directory,
        data,
        results,
        traces,
        provenance(study),
        last,
        paper,
        looks,
        compared,
        reproduced,
    )
    beside = _beside(study, data, paper, results) if paper else None

    def write_page() -> None:
        measured = storage.read(study)
        analysis = evaluate_assays(measured, last) if measured else None
        left = _left(study, measured, analysis, paper, beside)
        write_report(study.directory, drawn, out, left, _in_short(study, results, analysis, paper))

    write_page()
    lab_results.keep(study, data)
    return Published(results, compared, write_page)


def _in_short(
    study: StudyStore,
    results: Sequence[ClaimResult],
    analysis: Analysis | None,
    paper: Paper | None,
) -> InShort | None:
    """Of a paper that sums up many conditions in one figure: what foragers' ways of learning give, and cost."""
    foraging = all(isinstance(experiment, Experiment) for experiment in study.experiments.values())
    summed_up = paper is not None and "overview" in paper.about.figures
    found = (
        learner_comparison.ways(results, study.factors, analysis)
        if foraging and summed_up
        else None
    )
    if found is None or any(study.experiments[name].learns for name in found.held_against):
        return None
    return learner_comparison.in_short(found, study.directory)


def _left(
    study: StudyStore,
    measured: Assays,
    analysis: Analysis | None,
    paper: Paper | None,
    beside: variants.Beside | None,
) -> list[Section]:
    """What other commands have left in the folder of a study."""
    found = []
    if analysis:
        found.append(
            assays.section(
                measured,
                study.directory,
                analysis.last,
                paper.words.inference if paper else None,
                analysis,
            )
        )
    places = [study.directory / name / FILE for name in FOLDERS]
    multiverses = [read(place) for place in places if place.exists()]
    return found + [
        variants.section(multiverse, study.directory / "figures", beside)
        for multiverse in multiverses[:1]
    ]


def _beside(
    study: StudyStore, data: xr.Dataset, paper: Paper, results: Sequence[ClaimResult]
) -> variants.Beside | None:
    """The study as it stands beside the variants; None where it follows another than the standard one."""
    if {describe_variant(experiment, paper) for experiment in study.experiments.values()} != {
        STANDARD
    }:
        return None
    counts = run_counts(data).values()
    return variants.Beside(
        {result.claim.id: result.verdict for result in results}, (min(counts), max(counts))
    )


def _can_be_watched(study: StudyStore, condition: str) -> bool:
    """Whether it has a world, and its parts are here to be lived with."""
    try:
        study.require_parts(condition)
    except ValueError:  # as PartError is
        return False
    return isinstance(study.experiments[condition], Experiment)


def _looks(study: StudyStore) -> dict[str, dict[str, Any]]:
    """How the conditions look whose parts are here."""
    return {
        name: look(study.experiments[name]).to_dict()
        for name in study.experiments
        if _can_be_watched(study, name)
    }


def _shown(study: StudyStore, paper: Paper | None) -> str | None:
    """The condition whose emergence is shown, if any can be: that which the paper shows, or else the first there is."""
    wanted = "emergence" in (paper.about.figures if paper else FIGURES)
    preferred = (paper.about.emergence if paper else "", *study.experiments) if wanted else ()
    stored = (
        name
        for name in preferred
        if name in study.experiments and study.runs(name) and _can_be_watched(study, name)
    )
    return next(stored, None)


def _emergence(study: StudyStore, data: xr.Dataset, paper: Paper | None) -> list[xr.Dataset]:
    """The typical population of a condition at several generations."""
    condition = _shown(study, paper)
    if condition is None:
        return []
    experiment, run = study.experiments[condition], fitness.typical_run(data, condition)
    energy = data.energy.sel(condition=condition, run=run)
    return [  # forced, as `need` has told what all of them take
        replay(
            experiment, seed=study.seed, run=run, generation=generation, energy=energy, force=True
        )
        for generation in emergence_generations(experiment.evolution.generations)
    ]


def need(study: StudyStore) -> Need:
    """What the report of a study takes; that of a multiverse is made variant by variant."""
    by_variant: dict[str, list[tuple[Experiment, int]]] = {}
    for name, experiment in study.experiments.items():
        by_variant.setdefault(study.factors[name].variant, []).append(
            (experiment, len(study.runs(name)))
        )
    tables = max((estimate_tables(stored) for stored in by_variant.values()), default=NOTHING)
    paper = of_study(study.directory, study.paper) if study.paper else None
    shown = _shown(study, paper) if study.kind == CONDITIONS else None
    return tables.then(of_emergence(study.experiments[shown])) if shown else tables


def of_emergence(experiment: BaseExperiment) -> Need:
    """What the lives take in which emergence is shown."""
    if not isinstance(experiment, Experiment):
        return NOTHING
    lives = len(emergence_generations(experiment.evolution.generations))
    return Need(estimate_replay(experiment, lives).memory)
