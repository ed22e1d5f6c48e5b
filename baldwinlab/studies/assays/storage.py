"""Files of assays: read, verified, and brought to the names of this version."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, Final, Protocol

import xarray as xr

from baldwinlab.core.files import ASSAY_FILE, read_bytes
from baldwinlab.core.netcdf import DamagedError, from_bytes, verify
from baldwinlab.core.variables import ASSAYS, NEWBORNS, RANDOM, Variable
from baldwinlab.experiment import BaseExperiment, ExperimentError
from baldwinlab.experiment.factors import Factors
from baldwinlab.experiment.toml import from_toml

# Format of the file of an assay.
FORMAT: Final = 2
# Names of newborns in files of older versions.
OLD_NEWBORNS: Final = {"blank slate": RANDOM, "neutral twin": NEWBORNS[1]}


class AssayedStudy(Protocol):
    """What must be known of a study to tell whether an assay is of it."""

    @property
    def directory(self) -> Path: ...

    @property
    def seed(self) -> int: ...

    @property
    def experiments(self) -> Mapping[str, BaseExperiment]: ...

    @property
    def factors(self) -> Mapping[str, Factors]: ...

    def runs(self, condition: str) -> list[int]:
        """The numbers of the stored runs of a condition."""


def assay_path(directory: Path, assay: str, condition: str) -> Path:
    """Return the file of an assay of a condition, in the directory of a study."""
    return directory / "assays" / assay / f"{condition}.nc"


def read_assays(
    study: AssayedStudy, names: Iterable[str] = tuple(ASSAYS)
) -> dict[str, dict[str, xr.Dataset]]:
    """Read the stored assays of a study.

    Parameters
    ----------
    study : Measured
        The study. Conditions stand in its order.
    names : iterable of str
        The assays to read.

    Returns
    -------
    dict
        Datasets by assay and condition, as far as they are stored. Each has the factors of its
        condition among its attributes, and all `learners` of the study.

    Raises
    ------
    ValueError
        If a file is damaged, or is not the assay of this study that it should be; the message names it.
    """
    found: dict[str, dict[str, xr.Dataset]] = {}
    learners = list(dict.fromkeys(one.learner for one in study.factors.values()))
    for assay in names:
        folder = study.directory / "assays" / assay
        there = [
            path.relative_to(folder).with_suffix("").as_posix()
            for path in sorted(folder.rglob("*.nc"))
        ]
        for condition in dict.fromkeys(
            name for name in (*study.experiments, *there) if name in there
        ):
            known = study.factors.get(condition, Factors())
            named = known._replace(
                learner=known.learner or condition
            )  # of a sweep's points, nothing is written down
            data = read_assay(study, assay, condition).assign_attrs(
                named._asdict(), learners=learners
            )
            found.setdefault(assay, {})[condition] = data
    return found


def read_assay(study: AssayedStudy, assay: str, condition: str) -> xr.Dataset:
    """Read an assay of a condition. Raises OSError where there is none, and ValueError as `read` does."""
    path = assay_path(study.directory, assay, condition)
    again = f"`baldwinlab assay {study.directory} --assays {assay}` measures it again"
    try:
        raw = read_bytes(path, ASSAY_FILE)
    except ValueError as error:
        raise ValueError(f"{path} cannot be read: {error}; {again}") from None
    try:
        data = from_bytes(raw)
        if data.attrs.pop("format", 1) != 1 or b"checksum" in raw:  # the first format had none
            verify(raw)
    except DamagedError as error:
        raise ValueError(f"{path} is damaged: {error}; {again}") from None
    data = _upgrade_names(data)
    if not _is_declared(data, ASSAYS[assay]):
        raise ValueError(f"{path} is not what the assay {assay!r} stores; {again}")
    if misfit := _find_mismatch(data, study, condition):
        raise ValueError(
            f"{path} {misfit}; {again if condition in study.experiments else 'remove it'}"
        )
    return data


def _find_mismatch(data: xr.Dataset, study: AssayedStudy, condition: str) -> str:
    """Say why an assay is not of the stored runs of a condition, in part of a sentence; "" where it is.

    Every version has written seed, experiment and runs into its assays. One without them is refused.
    """
    name, seed = data.attrs.get("condition", condition), data.attrs.get("seed")
    if condition not in study.experiments:
        return f"is of the condition {condition!r}, which the study has not"
    if name != condition:
        return f"is of the condition {name!r}, not of {condition!r}"
    if str(seed) != str(study.seed):
        return f"is of a study with seed {seed}, and this study has seed {study.seed}"
    if _fields(data.attrs["experiment"]) != study.experiments[condition].to_dict():
        return f"was measured on another experiment than that of {condition} in this study"
    stored = set(study.runs(condition))
    missing = [run for run in data["run"].values.tolist() if run not in stored]
    return (
        f"is of run {missing[0]}, and runs/{condition}/{missing[0]:04d}.nc is not stored"
        if missing
        else ""
    )


def _fields(text: str) -> dict[str, Any]:
    return from_toml(text, where="the assay", lenient=True).to_dict()


def _is_declared(data: xr.Dataset, declared: Mapping[str, Variable]) -> bool:
    """Whether it holds some of these variables, as numbers with their dimensions and what these stand for; and an experiment."""
    there = [name for name in declared if name in data]
    labelled = {"agent", *(dim for coordinate in data.coords.values() for dim in coordinate.dims)}
    try:
        _fields(data.attrs["experiment"])
    except (KeyError, TypeError, AttributeError, ExperimentError):
        return False
    if not there or "run" not in data.coords or data["run"].dtype.kind != "i":
        return False
    return all(
        set(data[name].dims) == set(declared[name].dims)
        and data[name].dtype.kind in "if"
        and labelled.issuperset(declared[name].dims)
        for name in there
    )


def _upgrade_names(data: xr.Dataset) -> xr.Dataset:
    """Rename the coordinates and variables of older versions."""
    if "newborns" in data.coords:
        names = data["newborns"].values.tolist()
        data = data.assign_coords(newborns=[OLD_NEWBORNS.get(name, name) for name in names])
    return data.rename(eaten="eaten_in_window") if "eaten" in data else data
