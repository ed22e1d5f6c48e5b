"""Files are written atomically."""

from __future__ import annotations

import errno
import os
from pathlib import Path

import pytest

from baldwinlab.core.errors import RefusedError
from baldwinlab.core.file_writing import write_atomically
from baldwinlab.core.files import parse_location


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


def test_a_pipe_or_a_device_is_refused_and_remains(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    with pytest.raises(RefusedError, match=r"pipe is a device or a pipe\. Give the path of a file"):
        write_atomically(pipe, b"content")
    assert pipe.is_fifo()
    assert list(tmp_path.iterdir()) == [pipe]


def test_a_location_is_a_path_or_an_fsspec_url(tmp_path: Path) -> None:
    for location in ("results/study", Path("results/study")):
        assert parse_location(location) == Path("results/study")
    assert parse_location("file:///results/a%20study") == Path("/results/a study")
    pytest.importorskip("upath")
    location = parse_location("memory://tests/location")
    write_atomically(location / "folder" / "file", b"content")
    assert parse_location(location / "folder").name == "folder"
    (entry,) = parse_location("memory://tests/location/folder").iterdir()
    assert entry.name == "file"
    with pytest.raises(
        ValueError, match="nowhere://study cannot be reached: Unsupported filesystem: 'nowhere'"
    ):
        parse_location("nowhere://study")
