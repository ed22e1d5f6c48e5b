"""Findings of `doctor`: a machine without problems, and each problem with its fix."""

from __future__ import annotations

from pathlib import Path

import pytest

from baldwinlab.api.doctor import DoctorFinding, examine, has_problem
from baldwinlab.core import extras, resources
from baldwinlab.engine import cache
from tests.commands import Command


def findings_of(folder: Path) -> dict[str, DoctorFinding]:
    return {finding.topic: finding for finding in examine(folder)}


def test_a_machine_without_problems_has_a_line_per_topic(command: Command) -> None:
    done = command("doctor")
    assert done.code == 0
    assert "PROBLEM" not in done.out
    for topic in (
        "Python",
        "core",
        "extra lab",
        "cores",
        "memory",
        "compiled code",
        "studies",
        "disk, results",
        "GPU",
    ):
        assert topic in done.out


def test_a_missing_extra_is_not_a_problem_and_has_the_command_that_installs_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    installed_version = extras.installed_version
    monkeypatch.setattr(
        extras,
        "installed_version",
        lambda name: None if name == "distributed" else installed_version(name),
    )
    cluster = findings_of(tmp_path)["extra cluster"]
    assert (cluster.state, cluster.fix) == ("missing", extras.installation_command("cluster"))
    assert cluster.message.endswith("; not installed: distributed")
    assert not has_problem([cluster])


def test_a_core_that_lacks_a_package_is_a_problem(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    installed_version = extras.installed_version
    monkeypatch.setattr(
        extras,
        "installed_version",
        lambda name: None if name == "scipy" else installed_version(name),
    )
    core = findings_of(tmp_path)["core"]
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
    assert (
        done.code == 1 and "PROBLEM  compiled code" in done.out and "BALDWINLAB_CACHE" in done.out
    )


def test_a_folder_that_cannot_be_written_to_is_a_problem(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(dir: Path) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("tempfile.TemporaryFile", refuse)
    studies = findings_of(tmp_path / "missing" / "folder")["studies"]
    assert (
        studies.state == "problem"
        and f"{tmp_path} cannot be written to (Permission denied)" in studies.message
    )


def test_a_full_disk_is_a_problem_and_unknown_memory_is_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(resources, "free_disk", lambda folder: 10**6)
    monkeypatch.setattr(resources, "available_memory", lambda: None)
    findings = findings_of(tmp_path)
    assert (
        findings[f"disk, {tmp_path}"].state == "problem"
        and "--out" in findings[f"disk, {tmp_path}"].fix
    )
    assert findings["memory"].state == "missing"
