"""A command writes over what it has made itself, and over nothing else that anybody could miss."""

from __future__ import annotations

from pathlib import Path

import pytest

from baldwinlab.core.errors import RefusedError
from baldwinlab.core.output_paths import require_writable
from tests.small_studies import make_small_study


def require(path: Path, *, force: bool = False) -> None:
    require_writable("--out", path, b"made by me", force=force)


@pytest.mark.parametrize(
    "name",
    ["study.toml", "sessions.jsonl", "runs/evo/A/0000.nc", "runs/new.nc", "assays/innate/evo/A.nc"],
)
def test_what_makes_a_study_is_never_written_over_even_if_forced(tmp_path: Path, name: str) -> None:
    make_small_study(tmp_path / "study")
    path = tmp_path / "study" / name
    path.parent.mkdir(parents=True, exist_ok=True)
    for way in (path, tmp_path / "study" / "runs" / ".." / name):
        with pytest.raises(RefusedError, match="is inside the study"):
            require(way, force=True)
    (tmp_path / "link").symlink_to(path)
    with pytest.raises(RefusedError, match="is inside the study"):
        require(tmp_path / "link", force=True)


def test_a_file_of_another_program_is_written_over_only_if_forced(tmp_path: Path) -> None:
    thesis = tmp_path / "thesis.html"
    thesis.write_text("years of work")
    with pytest.raises(
        RefusedError,
        match=r"thesis\.html exists and was not written by this command\. .* add --force",
    ):
        require(thesis)
    require(thesis, force=True)


@pytest.mark.parametrize(
    "content", [b"", b"made by me" + b"." * 200_000, b"." * 200_000 + b"made by me"]
)
def test_what_the_command_has_made_and_an_empty_file_may_be_written_over(
    tmp_path: Path, content: bytes
) -> None:
    (tmp_path / "page.html").write_bytes(content)
    require(tmp_path / "page.html")
    require(tmp_path / "new.html")


def test_a_folder_and_a_file_in_no_folder_are_refused(tmp_path: Path) -> None:
    with pytest.raises(RefusedError, match="is a folder"):
        require(tmp_path)
    with pytest.raises(RefusedError, match="does not exist"):
        require(tmp_path / "nowhere" / "page.html")
