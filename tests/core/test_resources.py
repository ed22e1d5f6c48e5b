"""What needs more memory or disk than there is left is refused, in a sentence with both amounts."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from baldwinlab.core import resources
from baldwinlab.core.errors import RefusedError
from baldwinlab.core.resources import (
    Need,
    amount,
    available_memory,
    free_disk,
    memory_of_groups,
    peak_memory,
    require,
)

GIB = 2**30
V1 = {
    "memory.limit_in_bytes": "8000",
    "memory.usage_in_bytes": "5000",
    "memory.stat": "total_inactive_file 1000\ncache 9\n",
}
V2 = {
    "memory.max": "8000\n",
    "memory.current": "5000\n",
    "memory.stat": "anon 4000\ninactive_file 1000\n",
}


def group(folder: Path, files: dict[str, str]) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    for name, content in files.items():
        (folder / name).write_text(content)


def left_in_groups(tmp_path: Path, membership: str) -> list[int]:
    (tmp_path / "membership").write_text(membership)
    return list(memory_of_groups(tmp_path / "groups", tmp_path / "membership"))


def test_more_memory_than_is_left_is_refused_with_both_amounts(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(resources, "available_memory", lambda: 8 * GIB)
    require("evo/A", Need(memory=8 * GIB))
    with pytest.raises(RefusedError) as refused:
        require("evo/A", Need(memory=48 * 10**9))
    assert str(refused.value) == (
        "evo/A: needs about 44.7 GiB of memory, but only 8.0 GiB are free on this machine. "
        "Reduce the request or add --force."
    )
    require("evo/A", Need(memory=48 * 10**9), force=True)


def test_more_disk_than_is_left_is_refused_before_a_folder_is_made(tmp_path: Path) -> None:
    folder = tmp_path / "results" / "study"
    require("runs: 3", Need(disk=1), folder)
    with pytest.raises(
        RefusedError,
        match=r"runs: 3: needs about 1024\.0 TiB of disk, but only .* are free for .*study",
    ):
        require("runs: 3", Need(disk=2**50 - 1), folder)
    assert free_disk(folder) == pytest.approx(shutil.disk_usage(tmp_path).free, rel=0.1)
    assert not list(tmp_path.iterdir())


def test_nothing_is_said_of_a_store_elsewhere_nor_where_no_system_tells(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    upath = pytest.importorskip("upath")
    require("runs: 3", Need(disk=2**60), upath.UPath("memory://study"))
    monkeypatch.setattr(resources, "available_memory", lambda: None)
    require("evo/A", Need(memory=2**60))


@pytest.mark.skipif(
    sys.platform != "linux", reason="elsewhere all that there is counts as available"
)
def test_what_is_available_is_no_more_than_the_machine_has() -> None:
    there = available_memory()
    assert there is not None
    assert 0 < there <= os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")


@pytest.mark.parametrize(
    ("folder", "files", "membership"),
    [
        ("groups/job/step", V2, "0::/job/step\n"),
        ("groups/memory/job/step", V1, "4:memory:/job/step\n3:cpuset:/\n0::/\n"),
        ("groups/job", V2, "0::/job/step\n"),  # the limit of the group in which it lies
        ("groups", V2, "0::/seen/from/outside\n"),  # a container sees its own group alone
    ],
)
def test_a_control_group_leaves_its_limit_less_what_it_holds_but_for_files(
    tmp_path: Path, folder: str, files: dict[str, str], membership: str
) -> None:
    group(tmp_path / folder, files)
    assert left_in_groups(tmp_path, membership) == [4000]


def test_a_group_without_a_limit_and_a_machine_without_groups_say_nothing(tmp_path: Path) -> None:
    group(tmp_path / "groups", V2 | {"memory.max": "max\n"})
    assert left_in_groups(tmp_path, "0::/\n") == []
    assert list(memory_of_groups(tmp_path / "groups", tmp_path / "nothing")) == []


@pytest.mark.parametrize(
    ("count", "words"),
    [(0, "0.0 bytes"), (1023, "1023.0 bytes"), (48 * 10**9, "44.7 GiB"), (10**102, "8.88e+86 PiB")],
)
def test_amounts_in_words(count: int, words: str) -> None:
    assert amount(count) == words


@pytest.mark.skipif(sys.platform == "win32", reason="Python does not tell")
def test_the_most_memory_that_a_process_held_is_its_own() -> None:
    held = np.ones(300 * 2**20, np.uint8)
    say = "from baldwinlab.core.resources import peak_memory; print(peak_memory())"
    there = subprocess.run([sys.executable, "-c", say], capture_output=True, check=True)
    assert int(there.stdout) < 100 * 2**20 < held.nbytes < (peak_memory() or 0)
