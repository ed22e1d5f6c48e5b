"""Stored results of assays: their files, their verification, and a search for missing results."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, Final, Protocol

import numpy as np

from baldwinlab._version import __version__
from baldwinlab.core.deferred import xr
from baldwinlab.core.files import ASSAY_FILE, find_paths, parse_location, quote_path, read_bytes
from baldwinlab.core.netcdf import DamagedError, from_bytes, to_bytes, verify_checksum
from baldwinlab.experiment import ExperimentError
from baldwinlab.experiment.conditions import Factors
from baldwinlab.experiment.toml import from_toml
from baldwinlab.studies.assays import Conditions
from baldwinlab.studies.assays.catalog import get_assay, get_assays, load_assays, why_not_in_study
from baldwinlab.studies.open import sample_runs
from baldwinlab.studies.records import StudyError
from baldwinlab.studies.store import StudyStore

# Version of the format of the file of an assay.
ASSAY_FORMAT: Final = 2


class AssayedStudy(Conditions, Protocol):
    """Properties of a study that determine the path and the valid content of assay files."""

    @property
    def directory(self) -> Path: ...

    @property
    def seed(self) -> int: ...

    def runs(self, condition: str) -> list[int]:
        """Return the numbers of the stored runs of a condition, for example [0, 1, 2]."""


def assay_path(directory: Path, assay: str, condition: str) -> Path:
    """Return the path of the results of an assay: DIR/assays/innate/evo/A.nc."""
    return directory / "assays" / assay / f"{condition}.nc"


def encode_assay(data: xr.Dataset) -> bytes:
    """Return the results of an assay as netCDF bytes with the format and a checksum."""
    return to_bytes(data.assign_attrs(format=ASSAY_FORMAT))


def read_assays(
    study: AssayedStudy, names: Iterable[str] | None = None
) -> dict[str, dict[str, xr.Dataset]]:
    """Read the stored assays of a study; all assays unless `names` are given.

    Returns the dataset of each assay and condition: `read_assays(study)["innate"]["evo/A"]`. The
    attributes of a dataset include the factors of the condition, and the `learners` of the study.
    Raises the errors of `read_assay`.
    """
    assays: dict[str, dict[str, xr.Dataset]] = {}
    learners = list(dict.fromkeys(factors.learner for factors in study.factors.values()))
    for assay in load_assays() if names is None else names:
        folder = study.directory / "assays" / assay
        stored = [
            path.relative_to(folder).with_suffix("").as_posix()
            for path in find_paths(folder, "**/*.nc")
        ]
        # The conditions of the study come first. `read_assay` raises ValueError for others.
        in_study = [name for name in study.experiments if name in stored]
        for condition in dict.fromkeys((*in_study, *stored)):
            factors = study.factors.get(condition, Factors())
            # The conditions of a sweep have no factors, so the learner is the condition.
            factors = factors._replace(learner=factors.learner or condition)
            data = read_assay(study, assay, condition)
            data = data.assign_attrs(factors._asdict(), learners=learners)
            assays.setdefault(assay, {})[condition] = data
    return assays


def read_assay(study: AssayedStudy, assay: str, condition: str) -> xr.Dataset:
    """Read the results of an assay of a condition.

    Raises OSError if the file does not exist or cannot be read. Raises ValueError if the file is
    too large, is damaged, has another format, or does not match the assay or the study.
    """
    path = assay_path(study.directory, assay, condition)
    remedy = f"`baldwinlab assay {quote_path(study.directory)} --assays {assay}` measures it again"
    try:
        raw = read_bytes(path, ASSAY_FILE)
    except ValueError as error:
        raise ValueError(f"{path} cannot be read: {error}; {remedy}") from None
    try:
        data = from_bytes(raw)
        verify_checksum(raw)
    except DamagedError as error:
        raise ValueError(f"{path} is damaged: {error}; {remedy}") from None
    file_format = data.attrs.pop("format", None)
    if str(file_format) != str(ASSAY_FORMAT):
        raise ValueError(
            f"{path} has format {file_format}, and this version reads only format {ASSAY_FORMAT}; "
            f"{remedy}"
        )
    if not _is_declared(data, assay):
        raise ValueError(f"{path} does not have the content of the assay {assay!r}; {remedy}")
    if mismatch := _find_mismatch(data, study, condition):
        if condition not in study.experiments:
            remedy = "remove it"
        raise ValueError(f"{path} {mismatch}; {remedy}")
    return data


def _find_mismatch(data: xr.Dataset, study: AssayedStudy, condition: str) -> str:
    """Return why a file does not match a study, as the end of a sentence; "" if it matches.

    `_is_declared` has checked that the file has an experiment and runs.
    """
    name = data.attrs.get("condition", condition)
    seed = data.attrs.get("seed")
    if condition not in study.experiments:
        return f"is of the condition {condition!r}, which is not in the study"
    if name != condition:
        return f"is of the condition {name!r}, not of {condition!r}"
    if str(seed) != str(study.seed):
        return f"is of a study with seed {seed}, and this study has seed {study.seed}"
    if _parse_fields(data.attrs["experiment"]) != study.experiments[condition].to_dict():
        return f"was measured on another experiment than that of {condition} in this study"
    if mismatch := _find_control_mismatch(data, study):
        return mismatch
    stored_runs = set(study.runs(condition))
    missing_run = next((run for run in data["run"].values.tolist() if run not in stored_runs), None)
    if missing_run is None:
        return ""
    return f"is of run {missing_run}, and runs/{condition}/{missing_run:04d}.nc is not stored"


def _find_control_mismatch(data: xr.Dataset, study: AssayedStudy) -> str:
    """Return why the control of a fork does not match a study; "" if it matches."""
    # The name is "" if the study has no control. Other assays do not have this attribute.
    control = data.attrs.get("control", "")
    if not control:
        return ""
    if control not in study.experiments:
        return f"compares with the condition {control!r}, which is not in the study"
    if _parse_fields(data.attrs["control_experiment"]) != study.experiments[control].to_dict():
        return f"was measured on another experiment than that of {control} in this study"
    return ""


def _parse_fields(text: str) -> dict[str, Any]:
    return from_toml(text, source="the assay", lenient=True).to_dict()


def _is_declared(data: xr.Dataset, name: str) -> bool:
    """Return whether a dataset has the attributes, a variable and the labels of an assay."""
    assay = get_assay(name)
    declared = assay.variables
    present_names = [name for name in declared if name in data]
    coordinate_dims = {dim for coordinate in data.coords.values() for dim in coordinate.dims}
    # The labels of agents are optional.
    coordinate_dims.add("agent")
    try:
        _parse_fields(data.attrs["experiment"])
        if assay.uses_control:
            _parse_fields(data.attrs["control_experiment"])
    except (KeyError, TypeError, AttributeError, ExperimentError):
        return False
    has_attributes = assay.attributes.keys() <= data.attrs.keys()
    has_runs = "run" in data.coords and data["run"].dtype.kind == "i"
    if not present_names or not has_runs or not has_attributes:
        return False
    for name in present_names:
        # The dimensions can have any order, but each needs labels.
        dims = set(declared[name].dims)
        if set(data[name].dims) != dims or not dims <= coordinate_dims:
            return False
        if data[name].dtype.kind not in "if":
            return False
    return True


def is_stored(name: str, study: StudyStore, condition: str) -> bool:
    """Return whether a file with the results of an assay of a condition exists."""
    return assay_path(study.directory, name, condition).exists()


def open_assay(directory: str | Path, assay: str, condition: str) -> xr.Dataset:
    """Return the stored results of an assay of one condition.

    Raises `StudyError` if there is no such study, assay or condition, if the assay has not been
    run, or if `read_assay` refuses the file.
    """
    study = StudyStore(parse_location(directory))
    # The next two calls only check that the assay and the condition exist.
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

    In the assay "reaction", the same index along `setting` is the same setting in all conditions.
    The values are NaN if a condition does not have a setting. Raises the errors of `open_assay`.
    """
    datasets = [open_assay(study.directory, assay, condition) for condition in conditions]
    # `concat` drops the attributes, because most differ between conditions.
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
    """Give all datasets the same dimension `setting`, if they have this dimension.

    A setting is a pair (field, value), for example ("senses.visual_radius", "5").
    """
    if "setting" not in datasets[0].dims:
        return list(datasets)
    settings_of_datasets = [
        list(zip(data.field.values.tolist(), data.value.values.tolist(), strict=True))
        for data in datasets
    ]
    numbers: dict[tuple[str, str], int] = {}  # The new index of each distinct setting.
    for settings in settings_of_datasets:
        for setting in settings:
            numbers.setdefault(setting, len(numbers))
    fields, values = zip(*numbers, strict=True)
    all_settings = {
        "setting": np.arange(len(numbers), dtype=np.int32),
        "field": ("setting", list(fields)),
        "value": ("setting", list(values)),
    }
    # `reindex` inserts missing settings with NaN, also in the labels `field` and `value`, so these
    # labels are assigned again.
    return [
        data.assign_coords(setting=[numbers[setting] for setting in settings])
        .reindex(setting=all_settings["setting"])
        .assign_coords(all_settings)
        for data, settings in zip(datasets, settings_of_datasets, strict=True)
    ]


def find_missing_assays(
    study: StudyStore, names: Sequence[str], generations: int | None = None
) -> dict[str, list[str]]:
    """Return the missing assays of each condition with stored runs: {"evo/A": ["innate"]}.

    An applicable assay is missing if its file is absent, damaged or written by another version of
    baldwinlab, or if the file does not match the study and the runs of `sample_runs`. Raises
    StudyError for an unknown assay, and for a study without stored runs.

    `generations`: number of generations of the branches of a fork; by default any number matches.
    """
    # Both calls only check their arguments.
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
    """Return whether this version has stored the assay for the runs of `sample_runs`."""
    try:
        data = read_assay(study, name, condition)
    except (OSError, ValueError):
        return False
    # Only forks have the attribute `generations`.
    if generations is not None and generations != data.attrs.get("generations", generations):
        return False
    actual = (data.attrs.get("condition"), data.attrs.get("baldwinlab"), data.run.values.tolist())
    return actual == (condition, __version__, sample_runs(study, condition))
