"""Findings of `doctor`: a machine without problems, and each problem with its fix."""

from __future__ import annotations

from pathlib import Path

import pytest

from baldwinlab.cli.doctor import DoctorFinding, examine, has_problem
from baldwinlab.core import extras, resources
from baldwinlab.engine import cache
from tests.commands import Command


def findings_of(folder: Path) -> dict[str, DoctorFinding]:
    return {finding.topic: finding for finding in examine(folder)}


def test_a_machine_without_problems_has_a_line_per_topic(command: Command) -> None:
    done = command("doctor")
    assert done.code == 0
    assert "PROBLEM" not in done.out
    topics = ("Python", "core", "extra lab", "cores", "memory", "compiled code", "studies")
    for topic in (*topics, "disk, results", "GPU"):
        assert topic in done.out


def test_a_missing_extra_is_not_a_problem_but_a_core_that_lacks_a_package_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    installed_version = extras.installed_version
    monkeypatch.setattr(
        extras,
        "installed_version",
        lambda name: None if name in ("distributed", "scipy") else installed_version(name),
    )
    findings = findings_of(tmp_path)
    cluster, core = findings["extra cluster"], findings["core"]
    assert (cluster.state, cluster.fix) == ("missing", extras.installation_command("cluster"))
    assert cluster.message.endswith("; not installed: distributed")
    assert not has_problem([cluster])
    assert core.state == "problem"
    assert "scipy" in core.message
    assert core.fix


def test_an_unusable_cache_is_a_problem(
    command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setenv("BALDWINLAB_CACHE", str(tmp_path / "file"))
    # The decorated function stores its first result.
    monkeypatch.setattr(cache, "cache_root", cache.cache_root.__wrapped__)
    done = command("doctor")
    assert done.code == 1
    assert "PROBLEM  compiled code" in done.out and "BALDWINLAB_CACHE" in done.out


def test_a_folder_that_cannot_be_written_to_is_a_problem(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(dir: Path) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("tempfile.TemporaryFile", refuse)
    studies = findings_of(tmp_path / "missing" / "folder")["studies"]
    assert studies.state == "problem"
    assert f"{tmp_path} cannot be written to (Permission denied)" in studies.message


def test_a_full_disk_is_a_problem_and_unknown_memory_is_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(resources, "free_disk", lambda folder: 10**6)
    monkeypatch.setattr(resources, "available_memory", lambda: None)
    findings = findings_of(tmp_path)
    disk = findings[f"disk, {tmp_path}"]
    assert disk.state == "problem" and "--out" in disk.fix
    assert findings["memory"].state == "missing"
