"""Locations of files, and outputs of commands, which overwrite only their own and empty files."""

from __future__ import annotations

from pathlib import Path

import pytest

from baldwinlab.core.errors import RefusedError
from baldwinlab.core.file_writing import write_atomically
from baldwinlab.core.files import parse_location, require_writable
from tests.commands import Command
from tests.small_studies import make_small_study, shorten_preset


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


def require_output(path: Path, *, force: bool = False) -> None:
    require_writable("--out", path, b"made by me", force=force)


def test_the_files_of_a_study_are_never_overwritten(tmp_path: Path) -> None:
    make_small_study(tmp_path / "study", [shorten_preset("evo/A")], runs=1)
    (tmp_path / "study/assays/innate/evo").mkdir(parents=True)
    for name in (
        *("study.toml", "sessions.jsonl", "runs/evo/A/0000.nc", "runs/new.nc"),
        "assays/innate/evo/A.nc",
    ):
        path = tmp_path / "study" / name
        link = tmp_path / f"link to {path.name}"
        link.symlink_to(path)
        for output_path in (path, tmp_path / "study" / "runs" / ".." / name, link):
            with pytest.raises(RefusedError, match="is inside the study"):
                require_output(output_path, force=True)


def test_a_file_of_a_different_program_is_overwritten_only_with_force(tmp_path: Path) -> None:
    thesis = tmp_path / "thesis.html"
    thesis.write_text("years of work")
    with pytest.raises(
        RefusedError,
        match=r"thesis\.html exists and was not written by this command\. .* add --force",
    ):
        require_output(thesis)
    require_output(thesis, force=True)


@pytest.mark.parametrize(
    "content", [b"", b"made by me" + b"." * 200_000, b"." * 200_000 + b"made by me"]
)
def test_files_of_the_same_command_and_empty_files_are_overwritten(
    tmp_path: Path, content: bytes
) -> None:
    (tmp_path / "page.html").write_bytes(content)
    require_output(tmp_path / "page.html")
    require_output(tmp_path / "new.html")


def test_a_folder_and_a_file_in_a_missing_folder_are_refused(tmp_path: Path) -> None:
    with pytest.raises(RefusedError, match="is a folder"):
        require_output(tmp_path)
    with pytest.raises(RefusedError, match="does not exist"):
        require_output(tmp_path / "nowhere" / "page.html")


@pytest.mark.parametrize("name", ["r.pdf", "r.html.gz", "r"])
def test_an_output_with_a_wrong_suffix_is_refused(
    tmp_path: Path, command: Command, name: str
) -> None:
    make_small_study(tmp_path / "study", [shorten_preset("evo/A")], runs=1)
    outcome = command("report", "study", "--out", name)
    assert outcome.code == 2
    assert f"--out {name} must end in .html" in outcome.err.replace("\n", " ")
    outcome = command("report", "study", "--claims", "--out", name)
    assert f"--out {name} must end in .json" in outcome.err.replace("\n", " ")
    with pytest.raises(RefusedError, match=r"must end in \.nc, \.gif or \.png"):
        require_writable("--out", Path(name), b"", force=True, suffixes=[".nc", ".gif", ".png"])
    assert not (tmp_path / name).exists()
