"""Tests of the stored token: it is private, and belongs to a folder and a port."""

from __future__ import annotations

import os
from pathlib import Path

import platformdirs
import pytest

from baldwinlab.lab.server.access import load_token


@pytest.fixture
def state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the folder of the user's state."""
    monkeypatch.setattr(platformdirs, "user_state_dir", lambda name: str(tmp_path / "state"))
    return tmp_path / "state"


def find_file(state: Path) -> Path:
    (path,) = (state / "lab").iterdir()
    return path


def test_a_restart_has_the_same_token_and_another_lab_has_another(
    state: Path, tmp_path: Path
) -> None:
    token = load_token(tmp_path, 8642)
    assert len(token) >= 43
    assert load_token(tmp_path / "state" / "..", 8642) == token
    tokens = {token, load_token(tmp_path, 8643), load_token(tmp_path / "other", 8642)}
    assert len(tokens) == 3


@pytest.mark.skipif(not hasattr(os, "getuid"), reason="the platform has no file modes")
def test_a_token_that_other_users_could_read_is_replaced(state: Path, tmp_path: Path) -> None:
    token = load_token(tmp_path, 8642)
    path = find_file(state)
    assert (path.stat().st_mode & 0o777, path.parent.stat().st_mode & 0o777) == (0o600, 0o700)
    path.chmod(0o640)
    second = load_token(tmp_path, 8642)
    assert second != token
    assert path.stat().st_mode & 0o777 == 0o600
    # A link could lead to a file of another user.
    path.rename(tmp_path / "elsewhere")
    path.symlink_to(tmp_path / "elsewhere")
    assert load_token(tmp_path, 8642) != second
    assert not path.is_symlink()


def test_a_damaged_file_gets_a_new_token(state: Path, tmp_path: Path) -> None:
    load_token(tmp_path, 8642)
    path = find_file(state)
    path.write_bytes(b"")
    assert len(load_token(tmp_path, 8642)) >= 43
    path.write_bytes(b"short\xff")
    assert len(load_token(tmp_path, 8642)) >= 43


def test_without_a_folder_for_the_state_the_lab_starts_with_a_new_token(
    state: Path, tmp_path: Path
) -> None:
    state.write_bytes(b"a file instead of a folder")
    assert load_token(tmp_path, 8642) != load_token(tmp_path, 8642)
