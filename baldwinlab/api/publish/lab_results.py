"""Results that the lab shows, as plain data, and the cache `results.json` next to the report.

The results are curves, final values and typical runs. `record_runs` describes the columns of the
table "All runs" of the page. `_list_values` is the only list of the columns with numbers.

Reading a large study takes seconds. The cache is valid only for the version of baldwinlab and the
format that wrote it, and only for the same stored records.
"""

from __future__ import annotations

import hashlib
import json
from math import isnan
from typing import Any, Final, NamedTuple

from baldwinlab._version import __version__
from baldwinlab.analysis.assays.reaction_panels import ReactionPanel, make_reaction_panels
from baldwinlab.analysis.results.contrasts import COMPARED_MEASURES, Contrasts, final_values
from baldwinlab.analysis.statistics import fitness, intervals
from baldwinlab.analysis.statistics.fitness import compute_species_curves
from baldwinlab.api.publish.comparisons import compare_finals, has_comparisons, record_contrasts
from baldwinlab.core.deferred import xr
from baldwinlab.core.file_writing import write_atomically
from baldwinlab.core.files import RESULTS_FILE, parse_json, quote_path, read_text
from baldwinlab.experiment.conditions import FACTOR_NAMES, MULTIVERSE, SWEEP
from baldwinlab.experiment.measures import SPECIES_CURVES, list_species_curves
from baldwinlab.experiment.outcome import describe_measures, name_food_outcome
from baldwinlab.studies.assays.results import read_assays
from baldwinlab.studies.open import open_conditions, open_sample, sample_runs
from baldwinlab.studies.status import digest_records
from baldwinlab.studies.store import StudyStore
from baldwinlab.studies.sweeps.design import settings_by_label

DEFAULT_LAST: Final = 10
"""Default number of final generations of the report."""
SORTED_COLUMN: Final = "mean"
"""The column by which the page first sorts the table "All runs"."""


MAX_CURVE_VALUES: Final = 1_000_000
"""Maximum number of values (runs times generations) that `read_run_curves` returns."""
CACHE_FILE: Final = "results.json"
FOLDER_PLACEHOLDER: Final = "STUDY"
"""Text in the cache for the folder of the study, so that a moved study has the same cache."""
FORMAT: Final = 5
"""Version of the format. The version changes when the keys of the results change."""
MAX_CONDITIONS: Final = 1000
"""Larger studies have no cache, because the file would be slow to load."""


def compute_results(study: StudyStore, data: xr.Dataset | None = None) -> dict[str, Any]:
    """Compute the results of all conditions with a run. `data`: the runs, if already read."""
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
    # Imported here, because the import takes time.
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
        center, low, high = intervals.interval_of_median(compute(data))
        curves = {"center": center, "low": low, "high": high}
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
        # "composition" replaces "size", because the number of all agents is constant.
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
    """Return the median over runs of values [run, generation], and its 95 % interval."""
    center, low, high = intervals.interval_of_median(values)
    return {"center": to_list(center), "low": to_list(low), "high": to_list(high)}


def _comparison_record(study: StudyStore, data: xr.Dataset) -> dict[str, Any]:
    """Return the comparisons that the report of the study shows, as plain data."""
    is_large_sweep = study.kind == SWEEP and not has_comparisons(study)
    if study.kind == MULTIVERSE or is_large_sweep:
        return record_contrasts(Contrasts("", DEFAULT_LAST, ()))
    return record_contrasts(compare_finals(study, final_values(data), DEFAULT_LAST))


def read_run_curves(
    study: StudyStore, condition: str, measure: str
) -> dict[str, list[float | None]]:
    """Return the curve of each run of a condition: a list [generation] by index of the run."""
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
    runs_in_data = set(data["run"].values.tolist())
    return {str(run): to_list(curves.sel(run=run)) for run in runs if run in runs_in_data}


def read_reaction_norms(study: StudyStore) -> dict[str, Any]:
    """Return the reaction norms: the unit of fitness, and a panel per varied setting and map."""
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
    """Return lists `median`, `low` and `high` by condition, with None for missing values."""
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
    """Return the factors, or swept settings, that differ: a value per condition, by factor."""
    columns: dict[str, list[Any]]
    if study.kind == SWEEP:
        positions = {name: position for position, name in enumerate(study.experiments)}
        columns = {
            field: [values[positions[name]] for name in names]
            for field, values in settings_by_label(study).items()
        }
    else:
        columns = {
            factor: [getattr(study.factors[name], factor) for name in names]
            for factor in FACTOR_NAMES
        }
    return {name: values for name, values in columns.items() if len(set(values)) > 1}


def cache_results(study: StudyStore, data: xr.Dataset | None = None) -> None:
    """Write the results of a study to its cache, unless the study has too many conditions."""
    if len(study.experiments) > MAX_CONDITIONS:
        return
    folder = quote_path(study.directory)
    results = _replace_folder(compute_results(study, data), folder, FOLDER_PLACEHOLDER)
    record = {
        "version": __version__,
        "format": FORMAT,
        "records": digest_records(study),
        "results": results,
    }
    text = json.dumps({"checksum": _checksum(record), **record})
    write_atomically(study.directory / CACHE_FILE, text.encode())


def load_cached_results(study: StudyStore) -> dict[str, Any] | None:
    """Return the cached results, or None if the cache is missing, damaged or out of date."""
    try:
        record = parse_json(read_text(study.directory / CACHE_FILE, RESULTS_FILE))
        checksum = record.pop("checksum")
        is_valid = (
            record["version"] == __version__
            and record["format"] == FORMAT
            and record["records"] == digest_records(study)
            and checksum == _checksum(record)
        )
        if not is_valid:
            return None
        return _replace_folder(record["results"], FOLDER_PLACEHOLDER, quote_path(study.directory))
    # The file is missing, or another program wrote it.
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return None


def _replace_folder(results: dict[str, Any], old: str, new: str) -> dict[str, Any]:
    """Return results with another folder in the command that adds runs."""
    if "comparison" not in results:
        return dict(results)
    comparison = results["comparison"]
    text = comparison["too_few"].replace(f" {old} ", f" {new} ")
    return results | {"comparison": comparison | {"too_few": text}}


def _checksum(record: dict[str, Any]) -> str:
    return hashlib.sha256(json.dumps(record).encode()).hexdigest()


class ValueColumn(NamedTuple):
    """A column with one number per run."""

    title: str
    values: xr.DataArray  # [condition, run]


def _list_values(data: xr.Dataset) -> dict[str, ValueColumn]:
    """Return the columns with a number, by key. The key is also the heading of the CSV file."""
    return {
        measure: ValueColumn(f"{text['name']}, {text['axis']}", fitness.final(data, measure))
        for measure, text in describe_measures(fitness.outcome(data)).items()
    }


def record_runs(study: StudyStore, data: xr.Dataset) -> dict[str, Any]:
    """Return the table as plain data: `columns`, `rows` by key of the column, and texts.

    `order` of a column is the order after the first click on the heading. NaN becomes None.
    """
    numbers = _list_values(data)
    rows: list[dict[str, Any]] = []
    # Another process may have stored further runs since `data` was read.
    runs_in_data = set(data["run"].values.tolist())
    for name in data["condition"].values.tolist():
        runs = [run for run in sample_runs(study, name) if run in runs_in_data]
        values = [
            to_list(column.values.sel(condition=name, run=runs)) for column in numbers.values()
        ]
        rows += [
            {"condition": name, "run": run, **dict(zip(numbers, row, strict=True))}
            for run, *row in zip(runs, *values, strict=True)  # From columns to rows.
        ]
    return {
        "note": f"averaged over the last {DEFAULT_LAST} generations",
        "columns": [
            _describe_column("condition", "condition", "text"),
            _describe_column("run", "run", "text"),
            *(_describe_column(key, column.title, "number") for key, column in numbers.items()),
        ],
        "sorted": SORTED_COLUMN,
        "rows": rows,
    }


def _describe_column(key: str, title: str, cell_format: str) -> dict[str, str]:
    """Return a column for the page. Numbers are sorted in descending order, and texts ascending."""
    order = "descending" if cell_format == "number" else "ascending"
    return {"key": key, "title": title, "format": cell_format, "order": order}


def to_list(values: xr.DataArray) -> list[float | None]:
    """Return the values as a list, with None for NaN."""
    return [None if isnan(value) else value for value in values.values.tolist()]
