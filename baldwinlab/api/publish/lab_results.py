"""Results that the lab shows: curves, final values and typical runs, as plain data."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Final

from baldwinlab.analysis.assays.reaction_panels import ReactionPanel, make_reaction_panels
from baldwinlab.analysis.results.contrasts import (
    COMPARED_MEASURES,
    Contrasts,
    compare_final_values,
    final_values,
)
from baldwinlab.analysis.results.numbers import replace_undefined
from baldwinlab.analysis.results.table import (
    HEADINGS,
    describe_contrast,
    describe_method,
    list_cells,
    summarize_contrasts,
)
from baldwinlab.analysis.statistics import fitness, intervals
from baldwinlab.analysis.statistics.fitness import compute_species_curves
from baldwinlab.api.publish.added_runs import instruction_of
from baldwinlab.api.publish.run_table import DEFAULT_LAST, record_runs, to_list
from baldwinlab.api.publish.sweep_comparison import compare_points, has_comparisons
from baldwinlab.core.deferred import xr
from baldwinlab.experiment.factors import MULTIVERSE, SWEEP, Factors
from baldwinlab.experiment.outcome import (
    combine_outcomes,
    describe_measures,
    name_food_outcome,
)
from baldwinlab.experiment.species_measures import SPECIES_CURVES, list_species_curves
from baldwinlab.studies.assays.storage import read_assays
from baldwinlab.studies.open import open_conditions, open_sample
from baldwinlab.studies.records import StudyError
from baldwinlab.studies.store import StudyStore
from baldwinlab.studies.sweeps.design import settings_by_label

MAX_CURVE_VALUES: Final = 1_000_000
"""Maximum number of values (runs times generations) that `read_run_curves` returns."""


def compute_results(study: StudyStore, data: xr.Dataset | None = None) -> dict[str, Any]:
    """Compute the results of all conditions that have a run.

    `data`: the runs as `open_runs` returns them, if they are already loaded.
    """
    names = [name for name in study.experiments if study.runs(name)]
    results: dict[str, Any] = {
        "conditions": names,
        "factors": distinguishing_factors(study, names),
        "generation": [],
        "swept": study.kind == SWEEP,
        "curves": {name: {} for name in names},
        "typical_run": {},
    }
    if not names:
        return results
    # This import takes time.
    from baldwinlab.analysis.report.tables import name_measures

    if data is None or data["condition"].values.tolist() != names:
        data = open_sample(study, names)
    data = fitness.cache_measures(data)
    outcome = fitness.outcome(data)
    results["measures"] = describe_measures(outcome)
    results["claim_measures"] = name_measures(outcome)
    results["compared_measures"] = list(COMPARED_MEASURES)
    results["generation"] = data["generation"].values.tolist()
    for measure, compute in fitness.MEASURES.items():
        average, low, high = intervals.interval_of_mean(compute(data))
        curves = {"mean": average, "low": low, "high": high}
        for name in names:
            results["curves"][name][measure] = {
                curve_name: to_list(curve.sel(condition=name))
                for curve_name, curve in curves.items()
            }
    results["runs"] = record_runs(study, data)
    results["species"] = _compute_species(study, data)
    results["species_curves"] = SPECIES_CURVES
    results["comparison"] = _comparison_record(study, data)
    results["typical_run"] = {name: fitness.typical_run(data, name) for name in names}
    return results


def _compute_species(study: StudyStore, data: xr.Dataset) -> dict[str, Any]:
    """Return the curves of each species, by condition, curve and species; only with species."""
    curves_by_condition: dict[str, Any] = {}
    for name in data["condition"].values.tolist():
        experiment = study.experiments[name]
        # The number of agents is constant, so shares of species say the same.
        curves = [
            "composition" if curve == "size" else curve for curve in list_species_curves(experiment)
        ]
        if not curves:
            continue
        species_names = [species.name for species in experiment.population.species]
        condition_data = data.sel(condition=name)
        values_by_curve = compute_species_curves(condition_data, species_names, curves)
        curves_by_condition[name] = {
            curve: {species: _summarize_runs(values) for species, values in by_species.items()}
            for curve, by_species in values_by_curve.items()
        }
    return curves_by_condition


def _summarize_runs(values: xr.DataArray) -> dict[str, list[float | None]]:
    """Return the mean over runs of values [run, generation], and its 95 % interval."""
    average, low, high = intervals.interval_of_mean(values)
    return {"mean": to_list(average), "low": to_list(low), "high": to_list(high)}


def compare_study(study: StudyStore, last: int = 10, baseline: str = "") -> Contrasts:
    """Compare the conditions of a study, with one condition in memory at a time."""
    study.require_runs()
    require_baseline(study, baseline)
    names = [name for name in study.experiments if study.runs(name)]
    finals = [final_values(open_sample(study, [name]), last) for name in names]
    combined = xr.concat(finals, "condition", join="outer")
    combined.attrs["outcome"] = combine_outcomes({fitness.outcome(values) for values in finals})
    return _compare_finals(study, combined, last, baseline)


def _comparison_record(study: StudyStore, data: xr.Dataset) -> dict[str, Any]:
    """Return the comparisons that the report of the study shows, as plain data."""
    is_large_sweep = study.kind == SWEEP and not has_comparisons(study)
    if study.kind == MULTIVERSE or is_large_sweep:
        return record_contrasts(Contrasts("", DEFAULT_LAST, ()))
    return record_contrasts(_compare_finals(study, final_values(data), DEFAULT_LAST))


def record_contrasts(contrasts: Contrasts) -> dict[str, Any]:
    """Return comparisons as plain data: numbers, and the texts of `results.table`.

    Returns the sentences `summary`, `pairing`, `too_few` and `method`, the `headings` of the table,
    and `rows` with numbers, `cells`, a `note` and a `sentence`. An undefined number is None.
    """
    rows = []
    for contrast, cells in zip(contrasts.rows, list_cells(contrasts), strict=True):
        row = replace_undefined(contrast.row())
        texts = {"note": contrast.note, "sentence": describe_contrast(contrast)}
        rows.append(row | texts | {"cells": cells})
    return {
        "summary": summarize_contrasts(contrasts),
        "pairing": contrasts.pairing,
        "too_few": contrasts.too_few,
        "method": describe_method(contrasts),
        "headings": dict(HEADINGS),
        "rows": rows,
    }


def _compare_finals(
    study: StudyStore, finals: xr.Dataset, last: int, baseline: str = ""
) -> Contrasts:
    """Compare the conditions, or the points of a sweep."""
    if study.kind == SWEEP:
        return compare_points(study, finals, last, baseline)
    factors = {name: study.factors[name] for name in finals["condition"].values.tolist()}
    contrasts = compare_final_values(finals, factors, last, baseline)
    return replace(contrasts, instruction=instruction_of(study))


def require_baseline(study: StudyStore, baseline: str) -> None:
    """Raise StudyError unless the baseline condition has a run. Accept the baseline "".

    `baseline`: the name of the baseline condition, or "" for the default.
    """
    if baseline:
        study.experiment(baseline)
        if not study.runs(baseline):
            raise StudyError(
                f"baseline {baseline!r}: {study.location} has no finished run of this condition"
            )


def read_run_curves(
    study: StudyStore, condition: str, measure: str
) -> dict[str, list[float | None]]:
    """Return the curve of every run of a condition.

    Returns one value per generation, by run.
    """
    if measure not in fitness.MEASURES:
        raise ValueError(f"measure = {measure!r} must be one of {', '.join(fitness.MEASURES)}")
    runs = study.runs(condition)
    generations = study.experiment(condition).evolution.generations
    if len(runs) * generations > MAX_CURVE_VALUES:
        raise ValueError(
            f"{condition} has {len(runs):,} runs of {generations:,} generations. "
            f"Curves of single runs are limited to {MAX_CURVE_VALUES:,} values per condition."
        )
    if not runs:
        return {}
    data = open_conditions(study, [condition])
    curves = fitness.MEASURES[measure](data).sel(condition=condition)
    return {str(run): to_list(curves.sel(run=run)) for run in runs}


def read_reaction_norms(study: StudyStore) -> dict[str, Any]:
    """Return the reaction norms of a study: medians over runs with their intervals.

    Returns the unit of fitness, and one panel per varied setting and map. Plain data for JSON.
    """
    assays = read_assays(study, ["reaction"])
    if not assays:
        return {"unit": "", "panels": []}
    panels = [panel for panel in make_reaction_panels(assays["reaction"]) if panel.norms]
    records = [
        panel._asdict() | {"evolved": sorted(panel.evolved), "norms": _summarize_norms(panel)}
        for panel in panels
    ]
    experiments = [study.experiments[name] for name in assays["reaction"]]
    return {"unit": name_food_outcome(experiments), "panels": records}


def _summarize_norms(panel: ReactionPanel) -> dict[str, dict[str, list[float | None]]]:
    """Return the median and its interval by condition, with None for missing values."""
    indices = range(len(panel.values))
    summaries = {}
    for name, fitness_values in panel.norms.items():
        median, low, high = intervals.interval_of_median(fitness_values)
        curves = {"median": median, "low": low, "high": high}
        summaries[name] = {
            curve_name: to_list(curve.reindex(position=indices))
            for curve_name, curve in curves.items()
        }
    return summaries


def distinguishing_factors(study: StudyStore, names: list[str]) -> dict[str, list[Any]]:
    """Return the factors, or the settings of a sweep, that differ between conditions.

    Returns one value per condition, by factor or setting.
    """
    columns: dict[str, list[Any]]
    if study.kind == SWEEP:
        columns = {
            field: _select_values(study, names, values)
            for field, values in settings_by_label(study).items()
        }
    else:
        columns = {
            factor: [getattr(study.factors[name], factor) for name in names]
            for factor in Factors._fields
        }
    return {name: values for name, values in columns.items() if len(set(values)) > 1}


def _select_values(study: StudyStore, names: list[str], values: list[Any]) -> list[Any]:
    """Return the values of the named conditions, from values of all conditions of the study."""
    value_by_name = dict(zip(study.experiments, values, strict=True))
    return [value_by_name[name] for name in names]
