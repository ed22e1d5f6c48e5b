"""Curves, final values and typical runs of a study as plain data: what the lab's Results show; and what is asked for on demand.

A large study takes seconds to read, so they are kept beside its report. The file says of which records it was made, and is
believed only while these are the ones that are stored, and by the version that made it.
"""

from __future__ import annotations

import hashlib
import json
from itertools import compress
from typing import Any, Final

import xarray as xr

from baldwinlab._version import __version__
from baldwinlab.analysis.assays.phrases import of_foragers
from baldwinlab.analysis.assays.reaction_norms import Panel, by_circumstance
from baldwinlab.analysis.statistics import fitness
from baldwinlab.analysis.statistics.contrasts import Contrasts, compare_finals, final_values
from baldwinlab.analysis.statistics.csv import finite_or_none
from baldwinlab.api.publish.sweep_comparison import compare_points, has_comparisons
from baldwinlab.core.files import RESULTS_FILE, read_text, write_atomically
from baldwinlab.experiment.factors import MULTIVERSE, SWEEP, Factors
from baldwinlab.studies.assays.storage import read
from baldwinlab.studies.claims_file import digest_records
from baldwinlab.studies.open import open_conditions
from baldwinlab.studies.records import StudyError
from baldwinlab.studies.store import StudyStore
from baldwinlab.studies.sweeps.design import settings

FILE: Final = "results.json"
MOST: Final = 1000  # conditions, beyond which the file would be too large to be of use
MOST_PLACES: Final = 1_000_000  # of the lines of a condition's runs: runs times generations


def of_study(study: StudyStore, data: xr.Dataset | None = None) -> dict[str, Any]:
    """Of every condition that has a run; None where a number does not exist. Raises StudyError for a record that is damaged.

    `data` is the study as `open_runs` gives it, where it has been read already.
    """
    names = [name for name in study.experiments if study.runs(name)]
    answer: dict[str, Any] = {
        "conditions": names,
        "factors": factors(study, names),
        "generation": [],
    }
    answer["swept"] = study.kind == SWEEP
    answer |= {part: {name: {} for name in names} for part in ("curves", "final")} | {
        "typical_run": {}
    }
    if not names:
        return answer
    if data is None or data["condition"].values.tolist() != names:
        data = open_conditions(study, names)
    data = fitness.with_curves(data)
    answer["food"] = "food_eaten" in data  # else, what agents do is not called to eat
    answer["generation"] = data["generation"].values.tolist()
    for measure, values in fitness.MEASURES.items():
        average, low, high = fitness.interval_of_mean(values(data))
        curve = {"mean": average, "low": low, "high": high}
        final = fitness.final(data, measure)
        for name in names:
            answer["curves"][name][measure] = {
                part: _plain(array.sel(condition=name)) for part, array in curve.items()
            }
            answer["final"][name][measure] = _plain(final.sel(condition=name, run=study.runs(name)))
    answer["comparison"] = _comparison(study, data)
    answer["typical_run"] = {name: fitness.typical_run(data, name) for name in names}
    return answer


def compare(study: StudyStore, last: int = 10, baseline: str = "") -> Contrasts:
    """Compare the conditions of a stored study, of which one at a time is held in memory.

    Raises StudyError where no run is stored, and for a baseline that the study does not have or of which no run is stored.
    """
    study.require_runs()
    require_baseline(study, baseline)
    names = [name for name in study.experiments if study.runs(name)]
    finals = [final_values(open_conditions(study, [name]), last) for name in names]
    return _compare(study, xr.concat(finals, "condition", join="outer"), last, baseline)


def _comparison(study: StudyStore, data: xr.Dataset) -> dict[str, Any]:
    """The comparisons of the conditions as plain data; none where a report of the study has none."""
    if study.kind == MULTIVERSE or (study.kind == SWEEP and not has_comparisons(study)):
        return {"pairing": "", "too_few": "", "rows": []}
    found = _compare(study, final_values(data), 10)
    rows = [
        {name: _number(value) for name, value in row.row().items()} | {"verdict": row.verdict}
        for row in found.rows
    ]
    return {"pairing": found.pairing, "too_few": found.too_few, "rows": rows}


def _number(value: Any) -> Any:
    return finite_or_none(value) if isinstance(value, float) else value


def _compare(study: StudyStore, finals: xr.Dataset, last: int, baseline: str = "") -> Contrasts:
    if study.kind == SWEEP:
        return compare_points(study, finals, last, baseline)
    factors = {name: study.factors[name] for name in finals["condition"].values.tolist()}
    return compare_finals(finals, factors, last, baseline)


def require_baseline(study: StudyStore, baseline: str) -> None:
    """Raise StudyError where a baseline is given and the study has no run of it."""
    if baseline:
        study.experiment(baseline)
        if not study.runs(baseline):
            raise StudyError(
                f"baseline {baseline!r}: {study.directory} holds no finished run of this condition"
            )


def of_runs(study: StudyStore, condition: str, measure: str) -> dict[str, list[float | None]]:
    """The curve of every run of a condition, by its number: best, mean or share in each generation.

    Raises ValueError for another measure and for more than `MOST_PLACES`, and StudyError as `of_study` does.
    """
    if measure not in fitness.MEASURES:
        raise ValueError(f"measure = {measure!r} must be one of {', '.join(fitness.MEASURES)}")
    runs, generations = study.runs(condition), study.experiment(condition).evolution.generations
    if len(runs) * generations > MOST_PLACES:
        raise ValueError(
            f"{condition} has {len(runs):,} runs of {generations:,} generations; "
            f"lines of at most {MOST_PLACES:,} generations in all can be shown run by run"
        )
    if not runs:
        return {}
    curves = fitness.MEASURES[measure](open_conditions(study, [condition])).sel(condition=condition)
    return {str(run): _plain(curves.sel(run=run)) for run in runs}


def reaction_norms(study: StudyStore) -> dict[str, Any]:
    """What the stored assay `reaction` says, circumstance by circumstance and map by map: medians over runs with their bands.

    Raises ValueError for an assay that is not what it should be.
    """
    assays = read(study, ["reaction"])
    if not assays:
        return {"unit": "", "panels": []}
    found = [panel for panel in by_circumstance(assays["reaction"]) if panel.norms]
    shown = [
        one._asdict() | {"evolved": sorted(one.evolved), "norms": _bands(one)} for one in found
    ]
    return {"unit": "fitness (energy)" if of_foragers(assays) else "fitness", "panels": shown}


def _bands(panel: Panel) -> dict[str, dict[str, list[float | None]]]:
    """By condition, at each of the panel's values; None where it was not lived."""
    places = range(len(panel.values))
    return {
        name: {
            part: _plain(values.reindex(place=places))
            for part, values in zip(
                ("median", "low", "high"), fitness.interval_of_median(food), strict=True
            )
        }
        for name, food in panel.norms.items()
    }


def factors(study: StudyStore, names: list[str]) -> dict[str, list[Any]]:
    """What tells these conditions apart, by factor or, in a sweep, by field: a value each, unless all have the same."""
    if study.kind == SWEEP:
        there = [name in names for name in study.experiments]
        known = {field: [*compress(values, there)] for field, values in settings(study).items()}
    else:
        known = {
            factor: [getattr(study.factors[name], factor) for name in names]
            for factor in Factors._fields
        }
    return {factor: values for factor, values in known.items() if len(set(values)) > 1}


def _plain(values: xr.DataArray) -> list[float | None]:
    return [None if value != value else value for value in values.values.tolist()]


def keep(study: StudyStore, data: xr.Dataset | None = None) -> None:
    """Write them beside the report; `data` as for `of_study`. Raises StudyError as that does, and OSError."""
    if len(study.experiments) <= MOST:
        record = {
            "version": __version__,
            "records": digest_records(study),
            "results": of_study(study, data),
        }
        write_atomically(
            study.directory / FILE, json.dumps({"checksum": _checksum(record), **record}).encode()
        )


def kept(study: StudyStore) -> dict[str, Any] | None:
    """What was kept, if it is of the records that are stored now; else None."""
    try:
        record = json.loads(read_text(study.directory / FILE, RESULTS_FILE))
        checksum = record.pop("checksum")
        if (record["version"], record["records"], checksum) == (
            __version__,
            digest_records(study),
            _checksum(record),
        ):
            return dict(record["results"])
    except (
        OSError,
        ValueError,
        KeyError,
        TypeError,
        AttributeError,
        RecursionError,
    ):  # none, or none of ours
        pass
    return None


def _checksum(record: dict[str, Any]) -> str:
    return hashlib.sha256(json.dumps(record).encode()).hexdigest()
