"""Write the table of a study as Parquet."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from baldwinlab.api.export.formats import ExportFormat
from baldwinlab.api.export.table import StudyTable
from baldwinlab.core.file_writing import atomic_path
from baldwinlab.core.files import EXPORT_MARK, require_writable
from baldwinlab.studies.store import StudyStore


def write_parquet(study: StudyStore, path: Path, *, force: bool = False) -> str:
    """Write the table of a study row group by row group; return the number of runs as text."""
    import pyarrow.parquet as pq

    table = StudyTable(study)
    require_writable("--out", path, EXPORT_MARK.encode(), force=force)
    with (
        atomic_path(path) as partial_path,
        pq.ParquetWriter(partial_path, table.arrow_schema()) as writer,
    ):
        for rows in table.arrow_tables():
            writer.write_table(rows)
    return f"{path}: {table.n_runs:,} runs"


FORMAT: Final = ExportFormat(
    name="parquet",
    content="the table of csv; the metadata of a column has its unit and meaning",
    write=write_parquet,
    suffix=".parquet",
    library="pyarrow",
    extra="exchange",
)
