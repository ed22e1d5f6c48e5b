"""Reports of folders that cannot be written: other users' studies, and studies on a full disk."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from baldwinlab.core import console
from baldwinlab.core.file_writing import UnwrittenFile, skip_unwritable
from baldwinlab.core.files import shorten_path
from baldwinlab.core.numbers import format_count


@contextmanager
def warn_of_unwritten_files(
    folder: Path, out: Path | None
) -> Iterator[Mapping[Path, UnwrittenFile]]:
    """Skip the tables and figures that cannot be stored in a folder, and name them in a warning.

    `out`: page outside of the folder, which must be written. If it is None, no file is skipped.
    Yields the skipped files by path.
    """
    if out is None:
        yield {}
        return
    with skip_unwritable(folder, out) as unwritten:
        yield unwritten
    if unwritten:
        path, (_, error) = next(iter(unwritten.items()))
        n_others = len(unwritten) - 1
        others = f" and {format_count(n_others, 'other file')} were" if n_others else " was"
        reason = isinstance(error, OSError) and error.strerror
        console.warn(
            f"{path.relative_to(folder)}{others} not stored in {shorten_path(folder)}: "
            f"{str(reason or error).rstrip('.')}. The page {shorten_path(out)} is complete."
        )
