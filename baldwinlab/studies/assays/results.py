"""Stored results of assays, and a search for missing results."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from baldwinlab._version import __version__
from baldwinlab.core.deferred import xr
from baldwinlab.core.files import parse_location, quote_path
from baldwinlab.studies.assays.catalog import get_assay, get_assays, why_not_in_study
from baldwinlab.studies.assays.storage import assay_path, read_assay
from baldwinlab.studies.records import StudyError
from baldwinlab.studies.run_samples import sample_runs
from baldwinlab.studies.store import StudyStore


def is_stored(name: str, study: StudyStore, condition: str) -> bool:
    """Return whether the results of an assay of a condition are stored."""
    return assay_path(study.directory, name, condition).exists()


def open_assay(directory: str | Path, assay: str, condition: str) -> xr.Dataset:
    """Return the stored results of an assay of one condition.

    Raises `StudyError` if there is no such study, assay or condition, if the assay has not been
    run, or if its file is damaged.
    """
    study = StudyStore(parse_location(directory))
    get_assay(assay)
    study.experiment(condition)
    path = assay_path(study.directory, assay, condition)
    if not path.exists():
        reason = why_not_in_study(assay, study, condition)
        if reason:
            raise StudyError(f"{path} does not exist: {reason}")
        command = f"baldwinlab assay {quote_path(study.directory)} --assays {assay}"
        raise StudyError(f"{path} does not exist; `{command}` makes it")
    try:
        return read_assay(study, assay, condition)
    except OSError as error:
        raise StudyError(f"{path} cannot be read: {error.strerror or error}") from None
    except ValueError as error:
        raise StudyError(str(error)) from None


def open_assays(study: StudyStore, assay: str, conditions: Sequence[str]) -> xr.Dataset:
    """Return the stored results of an assay along the dimension `condition`.

    A setting of the assay "reaction" has the same number in all conditions. The values of a setting
    that a condition does not have are NaN. The function raises the errors of `open_assay`.
    """
    datasets = [open_assay(study.directory, assay, condition) for condition in conditions]
    experiments = [dataset.attrs["experiment"] for dataset in datasets]
    joined = xr.concat(
        _align_settings(datasets),
        "condition",
        join="outer",
        data_vars="all",
        coords="minimal",
        combine_attrs="drop",
    )
    joined = joined.assign_coords(condition=list(conditions))
    joined = joined.assign(experiment=("condition", experiments))
    return joined.assign_attrs(seed=study.seed)


def _align_settings(datasets: Sequence[xr.Dataset]) -> list[xr.Dataset]:
    """Return datasets with the settings of all datasets, if they have the dimension `setting`."""
    if "setting" not in datasets[0].dims:
        return list(datasets)
    settings_of_datasets = [
        list(zip(data.field.values.tolist(), data.value.values.tolist(), strict=True))
        for data in datasets
    ]
    numbers: dict[tuple[str, str], int] = {}
    for settings in settings_of_datasets:
        for setting in settings:
            numbers.setdefault(setting, len(numbers))
    fields, values = zip(*numbers, strict=True)
    all_settings = {
        "setting": np.arange(len(numbers), dtype=np.int32),
        "field": ("setting", list(fields)),
        "value": ("setting", list(values)),
    }
    return [
        data.assign_coords(setting=[numbers[setting] for setting in settings])
        .reindex(setting=all_settings["setting"])
        .assign_coords(all_settings)
        for data, settings in zip(datasets, settings_of_datasets, strict=True)
    ]


def find_missing_assays(
    study: StudyStore, names: Sequence[str], generations: int | None = None
) -> dict[str, list[str]]:
    """Return the missing assays of each condition.

    An assay is missing if it is applicable and its file is absent, or does not match the stored
    runs. Raises StudyError for an unknown assay, and for a study without stored runs.

    `generations`: number of generations of the branches of a fork. Unless given, any number
    matches.
    """
    get_assays(names)
    study.require_runs()

    def is_missing(name: str, condition: str) -> bool:
        is_done = _is_done(study, name, condition, generations)
        return not is_done and not why_not_in_study(name, study, condition)

    return {
        condition: [name for name in names if is_missing(name, condition)]
        for condition in study.experiments
        if study.runs(condition)
    }


def _is_done(study: StudyStore, name: str, condition: str, generations: int | None) -> bool:
    """Return whether this version has stored the assay of the sampled runs and the experiment."""
    try:
        data = read_assay(study, name, condition)
    except (OSError, ValueError):
        return False
    if generations is not None and generations != data.attrs.get("generations", generations):
        return False
    actual = (data.attrs.get("condition"), data.attrs.get("baldwinlab"), data.run.values.tolist())
    return actual == (condition, __version__, sample_runs(study, condition))
