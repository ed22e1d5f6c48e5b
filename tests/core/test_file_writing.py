"""Files are written atomically. Temporary files of killed writers are removed."""

from __future__ import annotations

import errno
import fcntl
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from baldwinlab.core.errors import RefusedError
from baldwinlab.core.file_writing import (
    atomic_path,
    identify_machine,
    remove_abandoned,
    skip_unwritable,
    write_atomically,
)

# The process writes a file or folder, and waits before it is renamed.
WRITER = """
import sys
from pathlib import Path
from baldwinlab.core.file_writing import atomic_path
path, is_folder = Path(sys.argv[1]), sys.argv[2] == "folder"
with atomic_path(path, is_folder=is_folder) as partial_path:
    (partial_path / "part" if is_folder else partial_path).write_text("content")
    print("ready", flush=True)
    sys.stdin.read()
"""
KINDS = pytest.mark.parametrize("kind", ["file", "folder"])


@contextmanager
def start_writer(path: Path, kind: str) -> Iterator[subprocess.Popen[str]]:
    """Start a process that has written a temporary file, and has not renamed it."""
    command = [sys.executable, "-c", WRITER, str(path), kind]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
        yield process


def list_partial(folder: Path) -> list[Path]:
    return list(folder.rglob(".*.partial"))


@KINDS
def test_the_file_of_a_killed_writer_is_removed(tmp_path: Path, kind: str) -> None:
    with start_writer(tmp_path / "runs" / "0066.nc", kind) as writer:
        writer.send_signal(signal.SIGKILL)
    assert len(list_partial(tmp_path)) == 1
    remove_abandoned(tmp_path)
    assert list_partial(tmp_path) == []


@KINDS
def test_the_file_of_a_living_writer_stays(tmp_path: Path, kind: str) -> None:
    path = tmp_path / "runs" / "0066.nc"
    with start_writer(path, kind) as writer:
        (partial_path,) = list_partial(tmp_path)
        # A suspended writer does not change its file.
        os.utime(partial_path, (time.time() - 7 * 24 * 3600,) * 2)
        remove_abandoned(tmp_path)
        assert list_partial(tmp_path) == [partial_path]
        writer.communicate("")
    assert (path / "part" if kind == "folder" else path).read_text() == "content"
    assert list_partial(tmp_path) == []


def test_a_writer_in_the_same_process_keeps_its_file(tmp_path: Path) -> None:
    with atomic_path(tmp_path / "mine") as partial_path:
        partial_path.write_text("content")
        remove_abandoned(tmp_path)
    assert (tmp_path / "mine").read_text() == "content"


def test_a_file_of_another_machine_is_removed_after_a_day(tmp_path: Path) -> None:
    local = tmp_path / f".local.{identify_machine()}-1.partial"
    new, old = tmp_path / ".new.00000000-1.partial", tmp_path / ".old.00000000-1.partial"
    unrelated = tmp_path / "notes.partial"
    for path in (local, new, old, unrelated):
        path.touch()
    os.utime(old, (time.time() - 25 * 3600,) * 2)
    remove_abandoned(tmp_path)
    assert sorted(tmp_path.iterdir()) == sorted([new, unrelated])


def test_a_link_with_the_name_of_a_temporary_file_is_not_followed(tmp_path: Path) -> None:
    target = tmp_path / "target"
    target.touch()
    link = tmp_path / f".link.{identify_machine()}-1.partial"
    link.symlink_to(target)
    remove_abandoned(tmp_path)
    assert target.exists() and link.is_symlink()


@pytest.mark.parametrize("is_removed_first", [True, False])
def test_a_file_that_is_removed_before_it_is_locked_is_created_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, is_removed_first: bool
) -> None:
    touch, flock = Path.touch, fcntl.flock
    created: list[Path] = []

    def touch_and_remove(path: Path, **options: Any) -> None:
        touch(path, **options)
        created.append(path)
        if is_removed_first and len(created) == 1:
            remove_abandoned(tmp_path)

    def remove_and_lock(handle: int, operation: int) -> None:
        if not is_removed_first and len(created) == 1:
            created[0].unlink(missing_ok=True)
        flock(handle, operation)

    monkeypatch.setattr(Path, "touch", touch_and_remove)
    monkeypatch.setattr(fcntl, "flock", remove_and_lock)
    write_atomically(tmp_path / "mine", b"content")
    assert len(created) == 2
    assert [path.name for path in tmp_path.iterdir()] == ["mine"]
    assert (tmp_path / "mine").read_bytes() == b"content"


def test_a_file_that_another_process_locks_first_is_created_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    touch = Path.touch
    handles: list[int] = []

    def touch_and_lock(path: Path, **options: Any) -> None:
        touch(path, **options)
        if not handles:
            handles.append(os.open(path, os.O_RDWR))
            fcntl.flock(handles[0], fcntl.LOCK_EX)

    monkeypatch.setattr(Path, "touch", touch_and_lock)
    write_atomically(tmp_path / "mine", b"content")
    os.close(handles[0])
    assert (tmp_path / "mine").read_bytes() == b"content"
    remove_abandoned(tmp_path)
    assert list_partial(tmp_path) == []


def test_without_locks_files_are_written_and_none_is_removed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(handle: int, operation: int) -> None:
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr(fcntl, "flock", fail)
    with atomic_path(tmp_path / "mine") as partial_path:
        remove_abandoned(tmp_path)
        partial_path.write_text("content")
    assert (tmp_path / "mine").read_text() == "content"


def test_a_full_disk_does_not_change_the_old_file_and_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "record"
    write_atomically(path, b"old")

    def fail_without_space(handle: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "fsync", fail_without_space)
    for written, folder in ((path, tmp_path), (tmp_path / "folder" / "new", tmp_path / "folder")):
        with pytest.raises(OSError, match="no space is left in") as raised:
            write_atomically(written, b"new")
        assert raised.value.filename == str(written)
        assert raised.value.strerror == f"no space is left in {folder}"
        assert raised.value.errno == errno.ENOSPC
    assert path.read_bytes() == b"old"
    # No temporary file remains.
    assert sorted(tmp_path.rglob("*")) == [tmp_path / "folder", path]


def test_optional_files_are_skipped_and_all_others_raise(tmp_path: Path) -> None:
    folder = tmp_path / "study"
    for name in ("table.csv", "page.html"):
        (folder / name).mkdir(parents=True)
    (tmp_path / "other.csv").mkdir()
    with skip_unwritable(folder, folder / "page.html") as errors:
        write_atomically(folder / "table.csv", b"content")
        write_atomically(folder / "new.csv", b"content")
        for path in (folder / "page.html", tmp_path / "other.csv"):
            with pytest.raises(IsADirectoryError):
                write_atomically(path, b"content")
    assert list(errors) == [folder / "table.csv"]
    assert (folder / "new.csv").read_bytes() == b"content"
    with pytest.raises(IsADirectoryError):
        write_atomically(folder / "table.csv", b"content")


def test_a_pipe_or_a_device_is_refused_and_remains(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    with pytest.raises(RefusedError, match=r"pipe is a device or a pipe\. Give the path of a file"):
        write_atomically(pipe, b"content")
    assert pipe.is_fifo()
    assert list(tmp_path.iterdir()) == [pipe]
