"""Read a study as a tidy table, and write it as CSV or Parquet.

The table has one row per condition, run, generation and agent, and one column per variable.

References
----------
- H. Wickham, "Tidy data", Journal of Statistical Software 59 (10), 2014.
- Metadata Vocabulary for Tabular Data, W3C Recommendation, 17 December 2015.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from baldwinlab._version import __version__
from baldwinlab.api.export.formats import ExportFormat
from baldwinlab.core.deferred import pd, xr
from baldwinlab.core.file_writing import atomic_path, write_atomically
from baldwinlab.core.files import EXPORT_MARK, require_writable
from baldwinlab.core.numbers import format_count
from baldwinlab.core.records import without_genomes
from baldwinlab.core.variables import DIMENSION_MEANINGS, PER_AGENT_DIMS
from baldwinlab.experiment.conditions import SWEEP, factor_coordinates
from baldwinlab.studies.store import StudyStore
from baldwinlab.studies.sweeps.design import settings_by_path

if TYPE_CHECKING:
    import pyarrow as pa

KEY_COLUMNS: Final = ("condition", "run", *PER_AGENT_DIMS)
"""Columns that identify a row."""
MIN_ROWS: Final = 2**17
"""Number of rows after which complete runs are written, for example as a row group of Parquet."""

RunValue = str | int | float


class Column(NamedTuple):
    """A column of the table."""

    name: str
    dtype: np.dtype[Any]  # Type of the values; object for text.
    # Unit of the values; "" for text, and for a variable whose unit differs between conditions.
    unit: str
    meaning: str
    categories: tuple[str, ...] = ()  # All values of a column of text; () for numbers.


class StudyTable:
    """The table of the conditions with runs. The methods read the rows."""

    def __init__(self, study: StudyStore) -> None:
        """Read the columns. Raise StudyError if no run is stored or a record is damaged."""
        study.require_runs()
        self.study = study
        self._runs = {name: runs for name in study.experiments if (runs := study.runs(name))}
        self._values_by_condition = _list_run_values(study)
        index_columns = [
            Column(name, np.dtype(np.int32), "", DIMENSION_MEANINGS[name])
            for name in KEY_COLUMNS[1:]
        ]
        self.columns = (*self._condition_columns(), *index_columns, *self._variable_columns())
        self.names = [column.name for column in self.columns]
        # Computed once, because a sweep has thousands of categories, the same in each frame.
        self._text_types = {
            column.name: pd.CategoricalDtype(column.categories)
            for column in self.columns
            if column.categories
        }

    @property
    def n_runs(self) -> int:
        """Return the number of runs of all conditions."""
        return sum(map(len, self._runs.values()))

    @property
    def attributes(self) -> dict[str, Any]:
        """Return the origin of the table, the seed, and the units and meanings of its columns."""
        return {
            "made_by": f"{EXPORT_MARK} {__version__}",
            "seed": self.study.seed,
            "units": {column.name: column.unit for column in self.columns if column.unit},
            "long_name": {column.name: column.meaning for column in self.columns},
        }

    def frames(self) -> Iterator[pd.DataFrame]:
        """Yield rows of some runs of a condition, without columns that the condition lacks."""
        for condition in self._runs:
            runs: list[dict[str, npt.NDArray[Any]]] = []
            n_rows = 0
            for run, record in self.study.records(condition):
                runs.append(_list_arrays(record, run))
                n_rows += len(runs[-1]["run"])
                if n_rows >= MIN_ROWS:
                    yield self._make_frame(condition, runs)
                    runs = []
                    n_rows = 0
            if runs:
                yield self._make_frame(condition, runs)

    def _make_frame(
        self, condition: str, runs: Sequence[Mapping[str, npt.NDArray[Any]]]
    ) -> pd.DataFrame:
        arrays = {name: np.concatenate([run[name] for run in runs]) for name in runs[0]}  # [row]
        n_rows = len(arrays["run"])
        values = self._values_by_condition[condition]  # One value for all rows.
        series: dict[str, Any] = {}
        for column in self.columns:
            if column.categories:
                text_type = self._text_types[column.name]
                code = text_type.categories.get_loc(values[column.name])
                codes = np.full(n_rows, code)
                series[column.name] = pd.Categorical.from_codes(codes, dtype=text_type)
            elif column.name in values:
                series[column.name] = np.full(n_rows, values[column.name], column.dtype)
            elif column.name in arrays:
                series[column.name] = arrays[column.name].astype(column.dtype, copy=False)
        return pd.DataFrame(series, copy=False)

    def to_pandas(self) -> pd.DataFrame:
        """Return the table for pandas.

        Text is categorical. A variable that the model of a condition does not record is NaN. The
        `attrs` have the units and the meanings of the columns.
        """
        frame = pd.concat(self.frames(), ignore_index=True)[self.names]
        frame.attrs = self.attributes
        return frame

    def arrow_schema(self) -> pa.Schema:
        """Return the types of the columns. pandas reads the metadata of a file into `attrs`."""
        import pyarrow as pa

        fields = [
            pa.field(
                column.name,
                pa.dictionary(pa.int32(), pa.string())
                if column.categories
                else pa.from_numpy_dtype(column.dtype),
                metadata={"units": column.unit, "long_name": column.meaning},
            )
            for column in self.columns
        ]
        return pa.schema(fields, {"PANDAS_ATTRS": json.dumps(self.attributes)})

    def arrow_tables(self) -> Iterator[pa.Table]:
        """Yield tables of at least `MIN_ROWS` rows, except the last. Missing variables are null."""
        import pyarrow as pa

        schema = self.arrow_schema()
        tables: list[pa.Table] = []
        n_rows = 0
        for frame in self.frames():
            arrays = [
                # With `from_pandas`, a recorded NaN would become null.
                pa.array(frame[field.name].array, from_pandas=False).cast(field.type)
                if field.name in frame
                else pa.nulls(len(frame), field.type)
                for field in schema
            ]
            tables.append(pa.table(arrays, schema=schema))
            n_rows += len(frame)
            if n_rows >= MIN_ROWS:
                yield pa.concat_tables(tables)
                tables = []
                n_rows = 0
        if tables:
            yield pa.concat_tables(tables)

    def _condition_columns(self) -> Iterator[Column]:
        values_by_condition = [self._values_by_condition[condition] for condition in self._runs]
        for name in values_by_condition[0]:
            values = list(dict.fromkeys(run_values[name] for run_values in values_by_condition))
            meaning = DIMENSION_MEANINGS.get(name) or f"the condition's {name}"
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
            record = without_genomes(self.study.record(name, runs[0]))
            for variable in sorted(record.data_vars.values(), key=lambda array: array.ndim):
                unit, meaning = (variable.attrs.get(key, "") for key in ("units", "long_name"))
                for column_name, array in _split_variable(variable):
                    label = column_name.removeprefix(f"{variable.name}").removeprefix("_")
                    text = f"{meaning} ({label})" if label else meaning
                    column = Column(column_name, array.dtype, unit, text)
                    columns.setdefault(column_name, []).append(column)
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


def _list_arrays(record: xr.Dataset, run: int) -> dict[str, npt.NDArray[Any]]:
    """Return the columns of a run, [row]: recorded variables, generation, agent and run."""
    arrays = {
        name: array.ravel()
        for variable in without_genomes(record).data_vars.values()
        for name, array in _split_variable(variable)
    }
    shape = [record.sizes[dim] for dim in PER_AGENT_DIMS]
    for dim, indices in zip(PER_AGENT_DIMS, np.indices(shape, np.int32), strict=True):
        arrays[dim] = record[dim].values[indices].ravel()
    return arrays | {"run": np.full(math.prod(shape), run, np.int32)}


def _split_variable(variable: xr.DataArray) -> Iterator[tuple[str, npt.NDArray[Any]]]:
    """Yield the columns of a variable, [generation, agent]. A pair, such as parents, has two."""
    if variable.dims == PER_AGENT_DIMS:
        yield str(variable.name), variable.values
    elif variable.dims[:-1] == PER_AGENT_DIMS:
        for index, label in enumerate(variable[variable.dims[-1]].values):
            yield f"{variable.name}_{label}", variable.values[..., index]


def _merge_columns(columns: Sequence[Column]) -> Column:
    """Return one column for several conditions. The column has no unit if the units differ."""
    units = {column.unit for column in columns}
    meanings = dict.fromkeys(column.meaning for column in columns)
    dtype = np.result_type(*(column.dtype for column in columns))
    return Column(
        columns[0].name,
        dtype,
        units.pop() if len(units) == 1 else "",
        "; or ".join(filter(None, meanings)),
    )


# Ending of the metadata file of a table (CSV on the Web).
METADATA_SUFFIX: Final = "-metadata.json"
CSVW_DATATYPES: Final = {"i": "integer", "f": "double"}
"""Data types of CSV on the Web, by kind of NumPy type. All other kinds are text."""


def write_csv(study: StudyStore, path: Path, *, force: bool = False) -> str:
    """Write the table of a study, some runs at a time, and return the number of runs as text.

    A cell is empty if the model of a condition does not record the variable. PATH-metadata.json has
    the types, units and meanings of the columns.
    """
    table = StudyTable(study)
    metadata_path = path.with_name(f"{path.name}{METADATA_SUFFIX}")
    # Every table of baldwinlab has this text in its header.
    header_mark = f",{','.join(KEY_COLUMNS[1:])},"
    require_writable("--out", path, header_mark.encode(), force=force)
    require_writable("--out", metadata_path, EXPORT_MARK.encode(), force=force)
    with (
        atomic_path(path) as partial_path,
        partial_path.open("w", encoding="utf-8", newline="") as file,
    ):
        file.write(f"{','.join(table.names)}\n")
        for frame in table.frames():
            rows = frame.reindex(columns=table.names)
            rows.to_csv(file, index=False, header=False, lineterminator="\n")
    metadata = json.dumps(_describe_table(table, path), indent=1, ensure_ascii=False)
    write_atomically(metadata_path, f"{metadata}\n".encode())
    return f"{path}: {format_count(table.n_runs, 'run')}"


def _describe_table(table: StudyTable, path: Path) -> dict[str, Any]:
    """Return the metadata of a table in the format CSV on the Web."""
    return {
        "@context": "http://www.w3.org/ns/csvw",
        "url": path.name,
        "dc:title": f"{table.study.directory.name}, seed {table.study.seed}",
        "dc:provenance": f"{EXPORT_MARK} {__version__}",
        "tableSchema": {
            "primaryKey": list(KEY_COLUMNS),
            "columns": [dict(_describe_column(column)) for column in table.columns],
        },
    }


def _describe_column(column: Column) -> Iterator[tuple[str, str]]:
    yield "name", column.name
    yield "titles", column.name
    yield "datatype", CSVW_DATATYPES.get(column.dtype.kind, "string")
    yield "dc:description", column.meaning
    if column.unit:
        yield "schema:unitText", column.unit


CSV: Final = ExportFormat(
    name="csv",
    content="a table with one row per condition, run, generation and agent; OUT-metadata.json has "
    "units and meanings",
    write=write_csv,
    suffix=".csv",
)


def write_parquet(study: StudyStore, path: Path, *, force: bool = False) -> str:
    """Write the table of a study, some runs at a time, and return the number of runs as text."""
    import pyarrow.parquet as pq

    table = StudyTable(study)
    require_writable("--out", path, EXPORT_MARK.encode(), force=force)
    with (
        atomic_path(path) as partial_path,
        pq.ParquetWriter(partial_path, table.arrow_schema()) as writer,
    ):
        for rows in table.arrow_tables():
            writer.write_table(rows)
    return f"{path}: {format_count(table.n_runs, 'run')}"


PARQUET: Final = ExportFormat(
    name="parquet",
    content="the table of csv; the metadata of a column has its unit and meaning",
    write=write_parquet,
    suffix=".parquet",
    library="pyarrow",
    extra="exchange",
)
