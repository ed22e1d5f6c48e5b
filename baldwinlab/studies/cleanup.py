"""Removal of a new study whose command is refused before anything was simulated."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Final

from baldwinlab.core.errors import InterruptedStudyError
from baldwinlab.core.files import is_local, is_study, make_absolute
from baldwinlab.studies.input_files import INPUT_FOLDER
from baldwinlab.studies.progress import FILE_PREFIX

RESULT_SUFFIXES: Final = (".nc", ".checkpoint", ".jsonl")
"""Suffixes of files with results of a simulation."""


@contextmanager
def remove_if_refused(directory: Path) -> Iterator[None]:
    """Remove what this context adds to a directory if it is refused without any result.

    A refusal can be late: for example, a custom part is compiled after the study is created. A
    study that existed before, or that another process simulates, is not changed.
    """
    directory = make_absolute(directory)
    if is_study(directory):
        yield
        return
    before = set(_list_entries(directory))
    missing_folders = _list_missing_folders(directory)
    try:
        yield
    except InterruptedStudyError:
        raise
    except Exception:
        added = [path for path in _list_entries(directory) if path not in before]
        if not any(_is_result(path.relative_to(directory)) for path in added):
            _remove(added, missing_folders)
        raise


def _list_entries(directory: Path) -> list[Path]:
    return list(directory.rglob("*")) if directory.exists() else []


def _list_missing_folders(directory: Path) -> list[Path]:
    """Return the folders that the study needs and that do not exist, the deepest first."""
    if not is_local(directory):
        return []
    return [folder for folder in (directory, *directory.parents) if not folder.exists()]


def _is_result(path: Path) -> bool:
    is_running = path.name.startswith(FILE_PREFIX)
    is_input = INPUT_FOLDER in path.parts
    return is_running or (path.suffix in RESULT_SUFFIXES and not is_input)


def _remove(added: list[Path], missing_folders: list[Path]) -> None:
    """Remove files, then the folders that are empty now."""
    folders = [path for path in added if path.is_dir()]
    for path in added:
        if path not in folders:
            path.unlink(missing_ok=True)
    for folder in (*sorted(folders, reverse=True), *missing_folders):
        # A folder is not empty if another process has written into it.
        with suppress(OSError):
            folder.rmdir()
