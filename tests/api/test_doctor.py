"""What the doctor finds: a machine that is well, and each thing that may be wrong, with its fix."""

from __future__ import annotations

from pathlib import Path

import pytest

from baldwinlab.api.doctor import DoctorFinding, examine, has_problem
from baldwinlab.core import extras, resources
from baldwinlab.engine import cache
from tests.commands import Command


def found(folder: Path) -> dict[str, DoctorFinding]:
    return {finding.topic: finding for finding in examine(folder)}


def test_a_machine_that_is_well_is_told_in_a_line_each(command: Command) -> None:
    done = command("doctor")
    assert done.code == 0 and "PROBLEM" not in done.out
    for about in (
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
        assert about in done.out


def test_an_extra_that_is_not_installed_is_no_problem_and_says_what_it_is_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    known = extras.installed_version
    monkeypatch.setattr(
        extras, "installed_version", lambda name: None if name == "distributed" else known(name)
    )
    cluster = found(tmp_path)["extra cluster"]
    assert (cluster.state, cluster.fix) == ("missing", extras.installation_command("cluster"))
    assert cluster.message.endswith("; not installed: distributed")
    assert not has_problem([cluster])


def test_a_core_that_lacks_a_package_is_a_problem(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    known = extras.installed_version
    monkeypatch.setattr(
        extras, "installed_version", lambda name: None if name == "scipy" else known(name)
    )
    core = found(tmp_path)["core"]
    assert core.state == "problem" and "scipy" in core.message and core.fix


def test_a_cache_that_cannot_be_used_is_a_problem(
    command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setenv("BALDWINLAB_CACHE", str(tmp_path / "file"))
    monkeypatch.setattr(
        cache, "cache_root", cache.cache_root.__wrapped__
    )  # which is remembered for as long as a process lives
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
    studies = found(tmp_path / "not" / "there")["studies"]
    assert (
        studies.state == "problem"
        and f"{tmp_path} cannot be written to (Permission denied)" in studies.message
    )


def test_little_memory_and_a_full_disk_are_problems_and_what_is_not_told_is_none(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(resources, "free_disk", lambda folder: 10**6)
    monkeypatch.setattr(resources, "available_memory", lambda: None)
    findings = found(tmp_path)
    assert (
        findings[f"disk, {tmp_path}"].state == "problem"
        and "--out" in findings[f"disk, {tmp_path}"].fix
    )
    assert findings["memory"].state == "missing"
