"""Read a study as a tidy table, with one row per condition, run, generation and agent.

Each variable has one column. A writer holds one run in memory at a time.

References
----------
H. Wickham, "Tidy data", Journal of Statistical Software 59 (10), 2014.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from baldwinlab._version import __version__
from baldwinlab.core.deferred import xr
from baldwinlab.core.variables import DIMENSION_MEANINGS, PER_AGENT_DIMS, without_genomes
from baldwinlab.experiment.factors import SWEEP, factor_coordinates
from baldwinlab.studies.store import StudyStore
from baldwinlab.studies.sweeps.design import settings_by_path

FILE_MARK: Final = "baldwinlab export"
"""Text in every exported file."""
KEY_COLUMNS: Final = ("condition", "run", *PER_AGENT_DIMS)
"""Columns that identify a row."""

RunValue = str | int | float


class Column(NamedTuple):
    """A column of the table."""

    name: str
    dtype: np.dtype[Any]  # Type of the values; object for text.
    # Unit of the values; "" for text, and for a variable whose unit differs between conditions.
    unit: str
    meaning: str
    categories: tuple[str, ...] = ()  # The different values of a column of text; () for numbers.


class Block(NamedTuple):
    """The rows of one run."""

    # Values of the columns that are constant in a run: condition, run, factors and settings.
    run_values: Mapping[str, RunValue]
    # The other columns. A variable that the model does not record has no array.
    arrays: Mapping[str, npt.NDArray[Any]]
    rows: int


class Table:
    """The table of the conditions of a study that have runs.

    The constructor reads the columns, and `blocks` reads the rows.
    """

    def __init__(self, study: StudyStore) -> None:
        """Read the columns. Raise StudyError if no run is stored or a record is damaged."""
        study.require_runs()
        self.study = study
        self._runs = {name: runs for name in study.experiments if (runs := study.runs(name))}
        self._values_by_condition = _list_run_values(study)
        self.columns = (*self._condition_columns(), *_index_columns(), *self._variable_columns())

    @property
    def rows(self) -> int:
        """Return the number of rows."""
        n_rows = 0
        for name, runs in self._runs.items():
            experiment = self.study.experiments[name]
            n_generations = experiment.evolution.generations * len(runs)
            if experiment.may_stop:
                sizes = [self.study.record(name, run).sizes["generation"] for run in runs]
                n_generations = sum(sizes)
            n_rows += n_generations * experiment.population.size
        return n_rows

    @property
    def attributes(self) -> dict[str, Any]:
        """Return the origin of the table, the seed, and the units and meanings of its columns."""
        units = {column.name: column.unit for column in self.columns if column.unit}
        meanings = {column.name: column.meaning for column in self.columns}
        return {
            "made_by": f"{FILE_MARK} {__version__}",
            "seed": self.study.seed,
            "units": units,
            "long_name": meanings,
        }

    def blocks(self) -> Iterator[Block]:
        """Yield the rows of each run, in the order of the conditions."""
        for condition in self._runs:
            for run, complete_record in self.study.records(condition):
                record = without_genomes(complete_record)
                variables = record.data_vars.values()
                arrays = {
                    name: array.ravel()
                    for variable in variables
                    for name, array in _split_variable(variable)
                }
                shape = [record.sizes[dim] for dim in PER_AGENT_DIMS]
                for dim, indices in zip(PER_AGENT_DIMS, np.indices(shape, np.int32), strict=True):
                    arrays[dim] = record[dim].values[indices].ravel()
                run_values = self._values_by_condition[condition] | {"run": run}
                yield Block(run_values, arrays, int(np.prod(shape)))

    def _condition_columns(self) -> Iterator[Column]:
        values_by_condition = [self._values_by_condition[condition] for condition in self._runs]
        for name in values_by_condition[0]:
            values = list(dict.fromkeys(run_values[name] for run_values in values_by_condition))
            meaning = _describe_column(name)
            if all(isinstance(value, str) for value in values):
                yield Column(name, np.dtype(object), "", meaning, tuple(map(str, values)))
            else:
                yield Column(name, np.asarray(values).dtype, "", meaning)

    def _variable_columns(self) -> Iterator[Column]:
        """Return the columns of the recorded variables.

        The columns of pairs, such as parents, are last. The first record of each condition has all
        variables of its model.
        """
        columns: dict[str, list[Column]] = {}
        for name, runs in self._runs.items():
            record = self.study.read(name, runs[0], genomes=False)
            for variable in sorted(record.data_vars.values(), key=lambda array: array.ndim):
                for column, array in _split_variable(variable):
                    meaning = variable.attrs.get("long_name", "")
                    is_of_pair = column != variable.name
                    if is_of_pair:
                        meaning = f"{meaning} ({column.removeprefix(f'{variable.name}_')})"
                    unit = variable.attrs.get("units", "")
                    columns.setdefault(column, []).append(
                        Column(column, array.dtype, unit, meaning)
                    )
        return map(_merge_columns, columns.values())


def _list_run_values(study: StudyStore) -> dict[str, dict[str, RunValue]]:
    """Return the name, the factors and the swept settings of each condition."""
    names = list(study.experiments)
    columns: dict[str, Any] = {"condition": names}
    factors = [study.factors[name] for name in names]
    for factor, (_, values) in factor_coordinates(factors).items():
        columns[factor] = values
    if study.kind == SWEEP:
        columns |= settings_by_path(study)
    rows = {}
    for index, name in enumerate(names):
        rows[name] = {column: values[index] for column, values in columns.items()}
    return rows


def _index_columns() -> Iterator[Column]:
    for name in KEY_COLUMNS[1:]:
        yield Column(name, np.dtype(np.int32), "", DIMENSION_MEANINGS[name])


def _describe_column(name: str) -> str:
    return DIMENSION_MEANINGS.get(name) or f"the condition's {name}"


def _split_variable(variable: xr.DataArray) -> Iterator[tuple[str, npt.NDArray[Any]]]:
    """Yield the columns of a variable, [generation, agent]. A pair, such as parents, has two."""
    if variable.dims == PER_AGENT_DIMS:
        yield str(variable.name), variable.values
    elif variable.dims[:-1] == PER_AGENT_DIMS:
        labels = variable[variable.dims[-1]].values
        arrays = np.moveaxis(variable.values, -1, 0)
        for label, array in zip(labels, arrays, strict=True):
            yield f"{variable.name}_{label}", array


def _merge_columns(columns: Sequence[Column]) -> Column:
    """Return one column for several conditions. It has no unit if their units differ."""
    units = {column.unit for column in columns}
    meanings = dict.fromkeys(column.meaning for column in columns)
    dtype = np.result_type(*(column.dtype for column in columns))
    return Column(
        columns[0].name,
        dtype,
        units.pop() if len(units) == 1 else "",
        "; or ".join(filter(None, meanings)),
    )
