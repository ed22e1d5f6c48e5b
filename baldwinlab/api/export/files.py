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
from baldwinlab.api.export.table import KEY, MARK, Block, Column, Table
from baldwinlab.core.errors import RefusedError
from baldwinlab.core.file_writing import atomic_path, write_atomically
from baldwinlab.core.output_paths import require_writable
from baldwinlab.studies.assays.descent import PHYLOGENY_HEADER, format_phylogeny
from baldwinlab.studies.store import StudyStore

MIN_ROWS: Final = 2**17
"""Minimal number of rows in a row group of Parquet."""
# The ending of the metadata of a table, as the W3C specifies it.
CSVW: Final = "-metadata.json"


def write_parquet(table: Table, path: Path, *, force: bool = False) -> None:
    """Write a table as Parquet, one run at a time.

    The metadata of a field has its `units` and `long_name`. For pandas, `attrs` of the table has
    them too.

    Parameters
    ----------
    table
        The table of a study.
    path
        The file to write.
    force
        Overwrite a file that this function did not write.

    Raises
    ------
    RefusedError
        `path` is a file of another program or of a study, or a library is missing.
    StudyError
        A record is damaged.
    """
    with require_extra("a Parquet file"):
        import pyarrow as pa
        import pyarrow.parquet as pq

    def _kind(column: Column) -> pa.DataType:
        """Return the Arrow type of a column."""
        return (
            pa.dictionary(pa.int32(), pa.string())
            if column.values
            else pa.from_numpy_dtype(column.dtype)
        )

    def _array(column: Column, block: Block) -> pa.Array:
        """Return the values of a column in the rows of one run."""
        if column.values:
            code = column.values.index(str(block.labels[column.name]))
            return pa.DictionaryArray.from_arrays(
                np.full(block.rows, code, np.int32), list(column.values)
            )
        if column.name in block.arrays:
            return pa.array(block.arrays[column.name], _kind(column))
        return pa.repeat(pa.scalar(block.labels.get(column.name), _kind(column)), block.rows)

    require_writable("--out", path, MARK.encode(), force=force)
    # The unit of text, and of a variable whose unit differs between conditions, is empty.
    fields = [
        pa.field(
            column.name, _kind(column), metadata={"units": column.unit, "long_name": column.meaning}
        )
        for column in table.columns
    ]
    schema = pa.schema(fields, {"PANDAS_ATTRS": json.dumps(table.attributes)})
    with atomic_path(path) as partial, pq.ParquetWriter(partial, schema) as writer:
        for blocks in _groups(table):
            batches = [
                pa.record_batch([_array(column, block) for column in table.columns], schema=schema)
                for block in blocks
            ]
            writer.write_table(pa.Table.from_batches(batches))


def _groups(table: Table) -> Iterator[list[Block]]:
    """Yield runs that fill a row group."""
    group: list[Block] = []
    for block in table.blocks():
        group.append(block)
        if sum(part.rows for part in group) >= MIN_ROWS:
            yield group
            group = []
    if group:
        yield group


def write_csv(table: Table, path: Path, *, force: bool = False) -> None:
    """Write a table as CSV, with a header.

    A cell is empty if the model of a condition does not record the variable. PATH-metadata.json has
    the types, units and meanings of the columns.

    Parameters
    ----------
    table
        The table of a study.
    path
        The file to write.
    force
        Overwrite a file that this function did not write.

    Raises
    ------
    RefusedError
        `path` is a file of another program or of a study.
    StudyError
        A record is damaged.

    References
    ----------
    Metadata Vocabulary for Tabular Data, W3C Recommendation, 17 December 2015.
    """
    metadata_path = path.with_name(f"{path.name}{CSVW}")
    require_writable("--out", path, f",{','.join(KEY[1:])},".encode(), force=force)
    require_writable("--out", metadata_path, MARK.encode(), force=force)
    with atomic_path(path) as partial, partial.open("w", encoding="utf-8", newline="") as file:
        for number, block in enumerate(table.blocks()):
            make_frame(table, block).to_csv(
                file, index=False, header=not number, lineterminator="\n"
            )
    write_atomically(
        metadata_path, f"{json.dumps(_csvw(table, path), indent=1, ensure_ascii=False)}\n".encode()
    )


def _csvw(table: Table, path: Path) -> dict[str, Any]:
    return {
        "@context": "http://www.w3.org/ns/csvw",
        "url": path.name,
        "dc:title": f"{table.study.directory.name}, seed {table.study.seed}",
        "dc:provenance": f"{MARK} {__version__}",
        "tableSchema": {
            "primaryKey": list(KEY),
            "columns": [dict(_csvw_column(column)) for column in table.columns],
        },
    }


def _csvw_column(column: Column) -> Iterator[tuple[str, str]]:
    yield "name", column.name
    yield "titles", column.name
    yield "datatype", {"i": "integer", "f": "double"}.get(column.dtype.kind, "string")
    yield "dc:description", column.meaning
    if column.unit:
        yield "schema:unitText", column.unit


def write_phylogeny(
    study: StudyStore, path: Path, condition: str | None, run: int | None, *, force: bool = False
) -> int:
    """Write the parents of agents as CSV in the ALife data standard for phylogenies.

    Agents of several runs have consecutive numbers, and the columns `condition` and `run`.

    Parameters
    ----------
    study
        The directory of the study.
    path
        The file to write.
    condition
        Name of a condition; all if None.
    run
        Number of a run; all if None. It needs `condition`.
    force
        Overwrite a file that this function did not write.

    Returns
    -------
    int
        The number of agents.

    Raises
    ------
    RefusedError
        `path` is a file of another program or of a study, or `run` has no `condition`.
    StudyError
        There is no such condition or run, no run is stored, or a record is damaged.
    """
    if condition is None and run is not None:
        raise RefusedError(
            f"--run {run} needs --condition, because every condition has a run {run}; "
            "add --condition"
        )
    require_writable("--out", path, PHYLOGENY_HEADER.encode(), force=force)
    study.require_runs()
    names = list(study.experiments) if condition is None else [study.experiment(condition).name]
    count = 0
    with atomic_path(path) as partial, partial.open("w", encoding="utf-8", newline="") as file:
        file.write(PHYLOGENY_HEADER + ",condition,run" * (run is None) + "\n")
        for name in names:
            for number in study.runs(name) if run is None else [run]:
                parents = study.read(name, number, genomes=False).parents.values
                origin = f",{name},{number}" * (run is None)
                file.writelines(f"{line}{origin}\n" for line in format_phylogeny(parents, count))
                count += parents[..., 0].size
    return count
