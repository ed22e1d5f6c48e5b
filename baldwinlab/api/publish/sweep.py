"""Write the results, figures and report of a stored sweep."""

from __future__ import annotations

from collections.abc import Callable

from baldwinlab.analysis.results.contrasts import (
    COMPARED_MEASURES,
    COMPARISON_COLUMNS,
    Contrasts,
)
from baldwinlab.analysis.results.numbers import to_csv
from baldwinlab.analysis.sweeps import analysis
from baldwinlab.analysis.sweeps.section import link_points, write_sweep_report
from baldwinlab.api.publish import results_cache
from baldwinlab.api.publish.plan import ReportPlan
from baldwinlab.api.publish.sweep_comparison import compare_points, has_comparisons
from baldwinlab.core import console
from baldwinlab.core.deferred import xr
from baldwinlab.core.file_writing import write_atomically
from baldwinlab.studies.open import open_sample
from baldwinlab.studies.run_samples import format_sample_sentence
from baldwinlab.studies.status import provenance
from baldwinlab.studies.sweeps.design import label_points


def publish_sweep(plan: ReportPlan, log: Callable[[str], None]) -> Contrasts:
    """Write responses.csv, statistics.csv, results.json, the figures and the report of a sweep."""
    study = plan.study
    study.require_runs()
    data = open_sample(study, list(study.experiments))
    console.info_if_any(format_sample_sentence(study))
    finals = analysis.compute_finals(label_points(study, data), plan.last)
    analysis.write_responses(finals, study.directory)
    contrasts = _compare_points(plan, finals)
    rows = [contrast.row() for contrast in contrasts.rows]
    write_atomically(study.directory / "statistics.csv", to_csv(COMPARISON_COLUMNS, rows))
    log("drawing the figures")
    experiments = study.experiments.values()
    links = link_points(
        finals, [*study.experiments], [point.evolution.generations for point in experiments]
    )
    write_sweep_report(
        study.directory,
        finals,
        provenance(study),
        plan.out,
        plan.last,
        contrasts=contrasts,
        links=links,
    )
    results_cache.cache_results(study, data)
    return contrasts


def _compare_points(plan: ReportPlan, finals: xr.Dataset) -> Contrasts:
    """Return the comparisons of the points. A large sweep has none."""
    study = plan.study
    if not has_comparisons(study):
        return Contrasts("", plan.last, ())
    by_condition = finals[list(COMPARED_MEASURES)].rename(point="condition").reset_coords(drop=True)
    by_condition = by_condition.assign_coords(condition=list(study.experiments))
    return compare_points(study, by_condition, plan.last, plan.baseline)
