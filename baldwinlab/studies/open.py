"""One dataset with all stored runs of a study, or with a random sample. No engine is loaded.

The files are verified when the study is opened. The values are read when they are used.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from baldwinlab.core.deferred import xr
from baldwinlab.core.files import parse_location
from baldwinlab.core.variables import (
    DIMENSION_MEANINGS,
    GENERATION_COUNT,
    GENERATION_COUNT_ATTRIBUTES,
)
from baldwinlab.experiment.conditions import factor_coordinates
from baldwinlab.experiment.outcome import name_outcome
from baldwinlab.experiment.toml import to_toml
from baldwinlab.studies.store import StudyStore

if TYPE_CHECKING:
    from baldwinlab.studies.lazy_runs import StoredCondition

# Maximum number of runs of a condition in a report or an assay.
MAX_SAMPLED_RUNS: Final = 10_000
# Minimum number of runs in a sample. If fewer runs are stored, all of them are used.
MIN_SAMPLED_RUNS: Final = 100
# Maximum size in bytes of a variable with 4-byte values, of the sampled runs of all conditions.
MAX_SAMPLED_BYTES: Final = 2**30
_BYTES_PER_VALUE: Final = 4


def open_runs(directory: str | Path, conditions: Sequence[str] | None = None) -> xr.Dataset:
    """Return the stored runs of a study as one dataset, without the genomes.

    `conditions`: by default all. The method `data` of `baldwinlab.api.study.Study` describes the
    dataset. Raises `StudyError` or `DamagedRecordError`.
    """
    study = StudyStore(parse_location(directory))
    return open_conditions(study, list(study.experiments if conditions is None else conditions))


def open_conditions(study: StudyStore, names: Sequence[str]) -> xr.Dataset:
    """Return the stored runs of an open study as one dataset, as `open_runs` does."""
    # Imported late: it loads xarray, which the simulation of a new study does not need.
    from baldwinlab.studies.lazy_runs import open_condition

    return _combine(study, names, [open_condition(study, name) for name in names])


def open_sample(
    study: StudyStore,
    names: Sequence[str],
    report_file: Callable[[int], object] = lambda n_files: None,
) -> xr.Dataset:
    """Return the runs of `sample_runs` as one dataset, as `open_runs` does.

    `report_file`: called with 1 after each file of records.
    """
    from baldwinlab.studies.lazy_runs import open_condition

    conditions = [
        open_condition(study, name, sample_runs(study, name), report_file) for name in names
    ]
    return _combine(study, names, conditions)


def _combine(
    study: StudyStore, names: Sequence[str], conditions: Sequence[StoredCondition]
) -> xr.Dataset:
    from baldwinlab.studies.lazy_runs import combine_conditions

    data = combine_conditions(conditions)
    attributes = [condition.attributes for condition in conditions]
    data = label_conditions(study, names, data, attributes)
    if not any(study.experiments[name].may_stop for name in names):
        return data
    # [condition, run]: the number of generations of each run, 0 for a run that is not stored.
    counts = np.zeros((len(names), data.sizes["run"]), np.int32)
    for row, condition in zip(counts, conditions, strict=True):
        run_indices = data.indexes["run"].get_indexer(condition.runs)
        row[run_indices] = condition.n_generations
    coordinate = (("condition", "run"), counts, GENERATION_COUNT_ATTRIBUTES)
    return data.assign_coords({GENERATION_COUNT: coordinate})


def label_conditions(
    study: StudyStore,
    names: Sequence[str],
    data: xr.Dataset,
    attributes: Sequence[Mapping[Hashable, dict[Any, Any]]],
) -> xr.Dataset:
    """Add the factors and experiments of the conditions, and the attributes of all variables."""
    factors = factor_coordinates([study.factors[name] for name in names])
    data = data.assign_coords(condition=list(names)).assign_coords(factors)
    for name in data.data_vars:
        data[name].attrs = _common_attributes(name, attributes)
    for name in DIMENSION_MEANINGS.keys() & data.coords.keys():
        meaning = DIMENSION_MEANINGS[name]
        data[name].attrs = {"long_name": meaning}
    # The encoding of the records has integer types, which cannot store missing values.
    # `Dataset.drop_encoding` reads all values in some versions of xarray.
    for variable in data.variables.values():
        variable.encoding = {}
    experiment_texts = [to_toml(study.experiment(name)) for name in names]
    experiments = [study.experiments[name] for name in names]
    outcome = name_outcome(str(data["energy"].attrs.get("long_name", "")), experiments)
    data = data.assign(experiment=("condition", experiment_texts))
    return data.assign_attrs(seed=study.seed, outcome=outcome)


def _common_attributes(
    name: Hashable, attributes: Sequence[Mapping[Hashable, dict[Any, Any]]]
) -> dict[Any, Any]:
    """Return the unit and meaning of a variable, or {} if these differ between conditions."""
    entries = [entry[name] for entry in attributes if entry.get(name)]
    if not entries or any(entry != entries[0] for entry in entries):
        return {}
    return entries[0]


def sample_runs(study: StudyStore, condition: str) -> list[int]:
    """Return the sorted numbers of the runs of a condition that a report or an assay uses.

    If more runs are stored than `count_sampled_runs` allows, the function draws a random sample of
    this size. The sample depends only on the stored runs and on the seed of the study.
    """
    runs = study.runs(condition)
    limit = count_sampled_runs(study)
    if len(runs) <= limit:
        return runs
    sample = np.random.default_rng(study.seed).choice(runs, limit, replace=False)
    return sorted(sample.tolist())


def count_sampled_runs(study: StudyStore) -> int:
    """Return the maximum number of runs of a condition in a report or an assay.

    With this number, a variable of all conditions with 4-byte values has at most
    `MAX_SAMPLED_BYTES`. Limits are `MIN_SAMPLED_RUNS` and `MAX_SAMPLED_RUNS`.
    """
    values_per_run = sum(
        experiment.evolution.generations * experiment.population.size
        for experiment in study.experiments.values()
    )
    limit = MAX_SAMPLED_BYTES // (_BYTES_PER_VALUE * values_per_run)
    return min(MAX_SAMPLED_RUNS, max(MIN_SAMPLED_RUNS, limit))


def describe_sample(study: StudyStore) -> str:
    """Return a noun phrase that describes the sample of a study, "" if all runs are used."""
    n_stored = max((len(study.runs(condition)) for condition in study.experiments), default=0)
    limit = count_sampled_runs(study)
    if n_stored <= limit:
        return ""
    return (
        f"a random sample of {limit:,} of the {n_stored:,} stored runs of a condition, drawn with "
        "the seed of the study"
    )


def format_sample_sentence(study: StudyStore) -> str:
    """Return a sentence that describes the sample of a study, "" if all runs are used."""
    sample = describe_sample(study)
    return f"The statistics use {sample}." if sample else ""
