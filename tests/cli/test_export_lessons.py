"""The folder of the teaching pack is written completely or not at all."""

from __future__ import annotations

import errno
from pathlib import Path

import pytest

from baldwinlab.cli import export
from baldwinlab.core.file_writing import write_atomically
from baldwinlab.core.files import EXPORT_MARK
from baldwinlab.lab.pages import lesson_pack
from tests.studies.completion import read_files

PAGES = {"index.html": EXPORT_MARK.encode(), "students/index.html": b"lesson"}


@pytest.mark.parametrize("has_earlier_pack", [False, True])
def test_a_full_disk_leaves_the_folder_of_the_lessons_unchanged(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, has_earlier_pack: bool
) -> None:
    folder = tmp_path / "lessons"
    if has_earlier_pack:
        folder.mkdir()
        (folder / "index.html").write_bytes(b"earlier " + PAGES["index.html"])
    before = read_files(tmp_path)

    def write_with_full_disk(path: Path, content: bytes) -> Path:
        if path.parent.name == "students":
            raise OSError(errno.ENOSPC, "No space left on device", str(path))
        return write_atomically(path, content)

    monkeypatch.setattr(lesson_pack, "render_lesson_pack", lambda: PAGES)
    with monkeypatch.context() as context:
        context.setattr("baldwinlab.cli.export.write_atomically", write_with_full_disk)
        with pytest.raises(OSError, match="no space is left"):
            export.write_lessons("", folder)
    assert read_files(tmp_path) == before
    assert folder.exists() == has_earlier_pack
    export.write_lessons("", folder)
    assert {name: (folder / name).read_bytes() for name in PAGES} == PAGES
