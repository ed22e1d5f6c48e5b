"""A study as one tidy table: a row for each agent of each generation, run and condition; a column for each variable.

It is read run by run, so whoever writes it down holds one run at a time. Source of the form: H. Wickham, "Tidy data", Journal of
Statistical Software 59 (10), 2014.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt
import xarray as xr

from baldwinlab._version import __version__
from baldwinlab.core.variables import DIMENSIONS, OF_AGENT
from baldwinlab.experiment.factors import SWEEP, coordinates
from baldwinlab.studies.store import StudyStore
from baldwinlab.studies.sweeps.design import settings_by_path

MARK: Final = "baldwinlab export"  # what stands in every file that is written
KEY: Final = ("condition", "run", *OF_AGENT)  # of which no two rows have the same

Label = str | int | float


class Column(NamedTuple):
    name: str
    dtype: np.dtype[Any]  # of text, object
    unit: str  # "" of text, and where the conditions have not the same
    meaning: str
    values: tuple[str, ...] = ()  # that text may have, each once


class Block(NamedTuple):
    """The rows of one run."""

    labels: Mapping[str, Label]  # the columns that are the same in all its rows
    arrays: Mapping[
        str, npt.NDArray[Any]
    ]  # the others, but for those that its model does not record
    rows: int


class Table:
    """The table of a study, of the conditions that have runs; its columns are known before its rows are read."""

    def __init__(self, study: StudyStore) -> None:
        """Raises StudyError where no run is stored yet, and for a record that is not what was written."""
        study.require_runs()
        self.study = study
        self._runs = {name: runs for name in study.experiments if (runs := study.runs(name))}
        self._labels = _labels(study)
        self.columns = (*self._of_conditions(), *_of_places(), *self._of_variables())

    @property
    def rows(self) -> int:
        experiments = self.study.experiments
        of_run = {
            name: experiments[name].evolution.generations * experiments[name].population.size
            for name in self._runs
        }
        return sum(of_run[name] * len(runs) for name, runs in self._runs.items())

    @property
    def attributes(self) -> dict[str, Any]:
        """What is said of the whole table, as plain data: who made it, the seed, and the unit and meaning of each column."""
        units = {column.name: column.unit for column in self.columns if column.unit}
        meanings = {column.name: column.meaning for column in self.columns}
        return {
            "made_by": f"{MARK} {__version__}",
            "seed": self.study.seed,
            "units": units,
            "long_name": meanings,
        }

    def blocks(self) -> Iterator[Block]:
        """Run after run, in the order of the conditions. Raises StudyError for a record that is not what was written."""
        for name, runs in self._runs.items():
            for run in runs:
                record = self.study.read(name, run, genomes=False)
                variables = record.data_vars.values()
                arrays = {
                    name: array.ravel()
                    for variable in variables
                    for name, array in _columns(variable)
                }
                shape = [record.sizes[dim] for dim in OF_AGENT]
                places = zip(OF_AGENT, np.indices(shape, np.int32), strict=True)
                arrays |= {dim: record[dim].values[place].ravel() for dim, place in places}
                yield Block(self._labels[name] | {"run": run}, arrays, int(np.prod(shape)))

    def _of_conditions(self) -> Iterator[Column]:
        for name in self._labels[next(iter(self._runs))]:
            values = list(dict.fromkeys(self._labels[condition][name] for condition in self._runs))
            if all(isinstance(value, str) for value in values):
                yield Column(name, np.dtype(object), "", _meaning(name), tuple(map(str, values)))
            else:
                yield Column(name, np.asarray(values).dtype, "", _meaning(name))

    def _of_variables(self) -> Iterator[Column]:
        """Those that the first record of any condition has; of pairs, such as parents, after the others."""
        found: dict[str, list[Column]] = {}
        for name, runs in self._runs.items():
            record = self.study.read(name, runs[0], genomes=False)
            for variable in sorted(record.data_vars.values(), key=lambda one: one.ndim):
                for column, array in _columns(variable):
                    label = (
                        column.removeprefix(f"{variable.name}_") if column != variable.name else ""
                    )
                    meaning = f"{variable.attrs.get('long_name', '')}{label and f' ({label})'}"
                    told = Column(column, array.dtype, variable.attrs.get("units", ""), meaning)
                    found.setdefault(column, []).append(told)
        return (_together(there) for there in found.values())


def _labels(study: StudyStore) -> dict[str, dict[str, Label]]:
    """By condition: its name, its factors, and in a sweep the fields that were swept."""
    names = list(study.experiments)
    columns: dict[str, Any] = {"condition": names}
    columns |= {
        name: values
        for name, (_, values) in coordinates([study.factors[name] for name in names]).items()
    }
    if study.kind == SWEEP:
        columns |= settings_by_path(study)
    return {
        name: {column: values[number] for column, values in columns.items()}
        for number, name in enumerate(names)
    }


def _of_places() -> Iterator[Column]:
    for name in KEY[1:]:
        yield Column(name, np.dtype(np.int32), "", DIMENSIONS[name])


def _meaning(name: str) -> str:
    return DIMENSIONS.get(name) or f"the condition's {name}"


def _columns(variable: xr.DataArray) -> Iterator[tuple[str, npt.NDArray[Any]]]:
    """What is recorded of each agent, [generation, agent], by column; of a pair, such as parents, there are two."""
    if variable.dims == OF_AGENT:
        yield str(variable.name), variable.values
    elif variable.dims[:-1] == OF_AGENT:
        for label, array in zip(
            variable[variable.dims[-1]].values, np.moveaxis(variable.values, -1, 0), strict=True
        ):
            yield f"{variable.name}_{label}", array


def _together(columns: Sequence[Column]) -> Column:
    """A column of several conditions: a fitness, which may be another in each model, has then no one unit."""
    units, meanings = (
        {column.unit for column in columns},
        dict.fromkeys(column.meaning for column in columns),
    )
    dtype = np.result_type(*(column.dtype for column in columns))
    return Column(
        columns[0].name,
        dtype,
        units.pop() if len(units) == 1 else "",
        "; or ".join(filter(None, meanings)),
    )
