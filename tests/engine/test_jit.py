"""Compiled code is kept for the next start, and is never stale."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import baldwinlab

COUNT_AND_RUN = """
from pathlib import Path
from baldwinlab.engine import jit, rng
before = len(list(jit.CACHE_DIRECTORY.rglob("*.nbc")))
print(jit.CACHE_DIRECTORY.name, before, rng.unit(2**31), len(list(jit.CACHE_DIRECTORY.rglob("*.nbc"))))
"""


def start(package: Path, cache: Path) -> list[str]:
    environment = {**os.environ, "PYTHONPATH": str(package), "BALDWINLAB_CACHE": str(cache)}
    done = subprocess.run(
        [sys.executable, "-c", COUNT_AND_RUN], env=environment, cwd=package, capture_output=True, text=True, check=True
    )
    return done.stdout.split()


def test_the_next_start_finds_compiled_code_and_an_edit_anywhere_in_the_engine_does_not(tmp_path: Path) -> None:
    package = tmp_path / "source"
    shutil.copytree(Path(baldwinlab.__file__).parent, package / "baldwinlab", ignore=shutil.ignore_patterns("__pycache__"))
    cache = tmp_path / "cache"
    first = start(package, cache)
    second = start(package, cache)
    assert first[1:3] == ["0", "0.5"]
    assert second[0] == first[0]
    assert int(second[1]) == int(first[3]) == int(second[3]) > 0
    rng = package / "baldwinlab" / "engine" / "rng.py"
    rng.write_text(rng.read_text().replace("2.0**-24", "2.0**-23"))
    third = start(package, cache)
    assert third[0] != first[0]
    assert third[2] == "1.0"


def test_where_the_cache_cannot_be_written_another_place_is_taken(tmp_path: Path) -> None:
    blocked = tmp_path / "a file, not a folder"
    blocked.write_text("")
    environment = {**os.environ, "BALDWINLAB_CACHE": str(blocked), "TMPDIR": str(tmp_path)}
    code = "from baldwinlab.engine import jit; print(jit.CACHE_DIRECTORY)"
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    assert Path(done.stdout.strip()).is_relative_to(tmp_path)
