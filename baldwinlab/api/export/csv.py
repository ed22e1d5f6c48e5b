"""Write the table of a study as CSV, with a file of metadata.

References
----------
Metadata Vocabulary for Tabular Data, W3C Recommendation, 17 December 2015.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

from baldwinlab._version import __version__
from baldwinlab.api.export.formats import ExportFormat
from baldwinlab.api.export.table import KEY_COLUMNS, Column, StudyTable
from baldwinlab.core.file_writing import atomic_path, write_atomically
from baldwinlab.core.files import EXPORT_MARK, require_writable
from baldwinlab.studies.store import StudyStore

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
    return f"{path}: {table.n_runs:,} runs"


def _describe_table(table: StudyTable, path: Path) -> dict[str, Any]:
    """Return the metadata of a table, as CSV on the Web defines them."""
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


FORMAT: Final = ExportFormat(
    name="csv",
    content="a table with one row per condition, run, generation and agent; OUT-metadata.json has "
    "units and meanings",
    write=write_csv,
    suffix=".csv",
)
