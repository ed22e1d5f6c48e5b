"""Requests for more memory or disk space than is free are refused, with both amounts."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from baldwinlab.core import resources
from baldwinlab.core.errors import RefusedError
from baldwinlab.core.resources import (
    Need,
    available_memory,
    cores_of_groups,
    format_bytes,
    free_disk,
    free_memory_of_groups,
    peak_memory,
    require_resources,
)

GIB = 2**30
CGROUP_V1 = {
    "memory.limit_in_bytes": "8000",
    "memory.usage_in_bytes": "5000",
    "memory.stat": "total_inactive_file 1000\ncache 9\n",
}
CGROUP_V2 = {
    "memory.max": "8000\n",
    "memory.current": "5000\n",
    "memory.stat": "anon 4000\ninactive_file 1000\n",
}


def write_cgroup(folder: Path, files: dict[str, str]) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    for name, content in files.items():
        (folder / name).write_text(content)


def available_in_cgroups(tmp_path: Path, membership: str) -> list[int]:
    (tmp_path / "membership").write_text(membership)
    return list(free_memory_of_groups(tmp_path / "groups", tmp_path / "membership"))


def test_a_request_for_too_much_memory_is_refused_with_both_amounts(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(resources, "available_memory", lambda: 8 * GIB)
    require_resources("evo/A", Need(memory=8 * GIB))
    with pytest.raises(RefusedError) as refused:
        require_resources("evo/A", Need(memory=48 * 10**9))
    assert str(refused.value) == (
        "evo/A: needs about 44.7 GiB of memory, but only 8.0 GiB are free on this machine. "
        "Reduce the request or add --force."
    )
    require_resources("evo/A", Need(memory=48 * 10**9), force=True)


def test_a_request_for_too_much_disk_space_is_refused_before_a_folder_is_created(
    tmp_path: Path,
) -> None:
    folder = tmp_path / "results" / "study"
    require_resources("runs: 3", Need(disk=1), folder)
    with pytest.raises(
        RefusedError,
        match=r"runs: 3: needs about 1024\.0 TiB of disk, but only .* are free for .*study",
    ):
        require_resources("runs: 3", Need(disk=2**50 - 1), folder)
    assert free_disk(folder) == pytest.approx(shutil.disk_usage(tmp_path).free, rel=0.1)
    assert not list(tmp_path.iterdir())


def test_unknown_free_disk_space_and_memory_are_not_checked(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    upath = pytest.importorskip("upath")
    require_resources("runs: 3", Need(disk=2**60), upath.UPath("memory://study"))
    monkeypatch.setattr(resources, "available_memory", lambda: None)
    require_resources("evo/A", Need(memory=2**60))


@pytest.mark.skipif(
    sys.platform != "linux", reason="other systems report the total memory as available"
)
def test_available_memory_is_at_most_the_memory_of_the_machine() -> None:
    available = available_memory()
    assert available is not None
    assert 0 < available <= os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")


@pytest.mark.parametrize(
    ("folder", "files", "membership"),
    [
        ("groups/job/step", CGROUP_V2, "0::/job/step\n"),
        ("groups/memory/job/step", CGROUP_V1, "4:memory:/job/step\n3:cpuset:/\n0::/\n"),
        # The limit of the parent group.
        ("groups/job", CGROUP_V2, "0::/job/step\n"),
        # A container can read only its own group.
        ("groups", CGROUP_V2, "0::/seen/from/outside\n"),
    ],
)
def test_a_control_group_provides_its_limit_minus_its_usage_without_file_caches(
    tmp_path: Path, folder: str, files: dict[str, str], membership: str
) -> None:
    write_cgroup(tmp_path / folder, files)
    assert available_in_cgroups(tmp_path, membership) == [4000]


@pytest.mark.parametrize(
    ("files", "membership", "cores"),
    [
        # Version 2: a job of at most 4 cores with a step of at most 1.5 cores.
        (
            {"job": {"cpu.max": "400000 100000\n"}, "job/step": {"cpu.max": "150000 100000\n"}},
            "0::/job/step\n",
            [1.5, 4],
        ),
        # Version 1, where another controller has another group.
        (
            {"cpu/box": {"cpu.cfs_quota_us": "50000\n", "cpu.cfs_period_us": "25000\n"}},
            "4:memory:/other\n3:cpu,cpuacct:/box\n0::/\n",
            [2],
        ),
        # A container can read only its own group.
        ({"": {"cpu.max": "300000 100000\n"}}, "0::/seen/from/outside\n", [3]),
    ],
)
def test_a_control_group_provides_its_quota_as_a_number_of_cores(
    tmp_path: Path, files: dict[str, dict[str, str]], membership: str, cores: list[float]
) -> None:
    for folder, contents in files.items():
        write_cgroup(tmp_path / "groups" / folder, contents)
    (tmp_path / "membership").write_text(membership)
    assert list(cores_of_groups(tmp_path / "groups", tmp_path / "membership")) == cores


@pytest.mark.parametrize("list_limits", [free_memory_of_groups, cores_of_groups])
def test_a_missing_limit_or_missing_control_groups_give_no_value(
    tmp_path: Path, list_limits: Callable[[Path, Path], Iterator[float]]
) -> None:
    groups = tmp_path / "groups"
    write_cgroup(groups, CGROUP_V2 | {"memory.max": "max\n", "cpu.max": "max 100000\n"})
    write_cgroup(groups / "cpu", {"cpu.cfs_quota_us": "-1\n", "cpu.cfs_period_us": "100000\n"})
    (tmp_path / "membership").write_text("1:cpu:/\n0::/\n")
    assert list(list_limits(groups, tmp_path / "membership")) == []
    assert list(list_limits(groups, tmp_path / "nothing")) == []


@pytest.mark.parametrize(
    ("count", "text"),
    [(0, "0.0 bytes"), (1023, "1023.0 bytes"), (48 * 10**9, "44.7 GiB"), (10**102, "8.88e+86 PiB")],
)
def test_amounts_have_a_unit(count: int, text: str) -> None:
    assert format_bytes(count) == text


@pytest.mark.skipif(sys.platform == "win32", reason="Python does not report peak memory")
def test_the_peak_memory_is_that_of_the_process_only() -> None:
    array = np.ones(300 * 2**20, np.uint8)
    code = "from baldwinlab.core.resources import peak_memory; print(peak_memory())"
    available = subprocess.run([sys.executable, "-c", code], capture_output=True, check=True)
    assert int(available.stdout) < 100 * 2**20 < array.nbytes < (peak_memory() or 0)
