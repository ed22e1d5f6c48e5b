"""Write a study as Parquet, CSV or a phylogeny. Files appear complete or not at all."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import numpy as np

from baldwinlab._version import __version__
from baldwinlab.api.export.extra import require_extra
from baldwinlab.api.export.frames import make_frame
from baldwinlab.api.export.table import FILE_MARK, KEY_COLUMNS, Block, Column, Table
from baldwinlab.core.errors import RefusedError
from baldwinlab.core.file_writing import atomic_path, write_atomically
from baldwinlab.core.output_paths import require_writable
from baldwinlab.studies.assays.descent import PHYLOGENY_HEADER, format_phylogeny
from baldwinlab.studies.store import StudyStore

MIN_ROW_GROUP_ROWS: Final = 2**17
"""Minimum number of rows in a row group of Parquet, except the last row group."""
# Ending of the metadata file of a table (CSV on the Web).
METADATA_SUFFIX: Final = "-metadata.json"
CSVW_DATATYPES: Final = {"i": "integer", "f": "double"}
"""Data types of CSV on the Web, by kind of NumPy type. All other kinds are text."""


def write_parquet(table: Table, path: Path, *, force: bool = False) -> None:
    """Write a table as Parquet, one run at a time.

    The metadata of a column has its `units` and `long_name`. pandas reads both into the `attrs` of
    the table.
    """
    with require_extra("a Parquet file"):
        import pyarrow as pa
        import pyarrow.parquet as pq

    def _arrow_type(column: Column) -> pa.DataType:
        """Return the Arrow type of a column."""
        if column.categories:
            return pa.dictionary(pa.int32(), pa.string())
        return pa.from_numpy_dtype(column.dtype)

    def _make_array(column: Column, block: Block) -> pa.Array:
        """Return the values of a column in the rows of one run."""
        if column.categories:
            code = column.categories.index(str(block.run_values[column.name]))
            return pa.DictionaryArray.from_arrays(
                np.full(block.rows, code, np.int32), list(column.categories)
            )
        if column.name in block.arrays:
            return pa.array(block.arrays[column.name], _arrow_type(column))
        # A variable that the model does not record is null.
        value = pa.scalar(block.run_values.get(column.name), _arrow_type(column))
        return pa.repeat(value, block.rows)

    require_writable("--out", path, FILE_MARK.encode(), force=force)
    # `units` is empty for text, and for a variable whose unit differs between conditions.
    fields = [
        pa.field(
            column.name,
            _arrow_type(column),
            metadata={"units": column.unit, "long_name": column.meaning},
        )
        for column in table.columns
    ]
    schema = pa.schema(fields, {"PANDAS_ATTRS": json.dumps(table.attributes)})
    with atomic_path(path) as partial_path, pq.ParquetWriter(partial_path, schema) as writer:
        for blocks in _group_blocks(table):
            batches = []
            for block in blocks:
                arrays = [_make_array(column, block) for column in table.columns]
                batches.append(pa.record_batch(arrays, schema=schema))
            writer.write_table(pa.Table.from_batches(batches))


def _group_blocks(table: Table) -> Iterator[list[Block]]:
    """Yield lists of consecutive runs with at least `MIN_ROW_GROUP_ROWS` rows in all.

    The last list may have fewer rows.
    """
    group: list[Block] = []
    for block in table.blocks():
        group.append(block)
        if sum(block_of_group.rows for block_of_group in group) >= MIN_ROW_GROUP_ROWS:
            yield group
            group = []
    if group:
        yield group


def write_csv(table: Table, path: Path, *, force: bool = False) -> None:
    """Write a table as CSV, with a header.

    A cell is empty if the model of a condition does not record the variable. PATH-metadata.json has
    the types, units and meanings of the columns.

    References
    ----------
    Metadata Vocabulary for Tabular Data, W3C Recommendation, 17 December 2015.
    """
    metadata_path = path.with_name(f"{path.name}{METADATA_SUFFIX}")
    # Every table of baldwinlab has this text in its header.
    header_mark = f",{','.join(KEY_COLUMNS[1:])},"
    require_writable("--out", path, header_mark.encode(), force=force)
    require_writable("--out", metadata_path, FILE_MARK.encode(), force=force)
    with (
        atomic_path(path) as partial_path,
        partial_path.open("w", encoding="utf-8", newline="") as file,
    ):
        for block_index, block in enumerate(table.blocks()):
            is_first = block_index == 0
            make_frame(table, block).to_csv(file, index=False, header=is_first, lineterminator="\n")
    metadata = json.dumps(_describe_table(table, path), indent=1, ensure_ascii=False)
    write_atomically(metadata_path, f"{metadata}\n".encode())


def _describe_table(table: Table, path: Path) -> dict[str, Any]:
    """Return the metadata of a table, as CSV on the Web defines them."""
    return {
        "@context": "http://www.w3.org/ns/csvw",
        "url": path.name,
        "dc:title": f"{table.study.directory.name}, seed {table.study.seed}",
        "dc:provenance": f"{FILE_MARK} {__version__}",
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


def write_phylogeny(
    study: StudyStore, path: Path, condition: str | None, run: int | None, *, force: bool = False
) -> int:
    """Write the parents of agents as CSV in the ALife data standard for phylogenies.

    If `run` is None, agents are numbered through all runs, and the table has the further columns
    `condition` and `run`.

    `run`: None for all runs. It needs `condition`.
    """
    if condition is None and run is not None:
        raise RefusedError(
            f"--run {run} needs --condition, because every condition has a run {run}; "
            "add --condition"
        )
    require_writable("--out", path, PHYLOGENY_HEADER.encode(), force=force)
    study.require_runs()
    names = list(study.experiments) if condition is None else [study.experiment(condition).name]
    has_run_columns = run is None
    header = f"{PHYLOGENY_HEADER},condition,run" if has_run_columns else PHYLOGENY_HEADER
    n_agents = 0
    with (
        atomic_path(path) as partial_path,
        partial_path.open("w", encoding="utf-8", newline="") as file,
    ):
        file.write(f"{header}\n")
        for name in names:
            runs = study.runs(name) if run is None else [run]
            for run_of_row in runs:
                parents = study.read(name, run_of_row, genomes=False).parents.values
                run_columns = f",{name},{run_of_row}" if has_run_columns else ""
                lines = format_phylogeny(parents, n_agents)
                file.writelines(f"{line}{run_columns}\n" for line in lines)
                generations, agents_per_generation = parents.shape[:2]
                n_agents += generations * agents_per_generation
    return n_agents
