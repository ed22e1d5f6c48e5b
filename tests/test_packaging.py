"""What is shipped: a wheel and a source archive, each installed into an empty folder, with all that it needs."""

from __future__ import annotations

import re
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest

from baldwinlab._version import __version__

ROOT = Path(__file__).parent.parent


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("dist")
    subprocess.run(
        [sys.executable, "-m", "hatchling", "build", "-d", str(folder)],
        cwd=ROOT,
        check=True,
        capture_output=True,
    )
    return folder


@pytest.mark.parametrize("kind", ["*.whl", "*.tar.gz"])
def test_what_is_built_runs_from_an_empty_folder(built: Path, tmp_path: Path, kind: str) -> None:
    (archive,) = built.glob(kind)
    pip = [
        sys.executable,
        "-m",
        "pip",
        "install",
        "--no-deps",
        "--no-index",
        "--no-build-isolation",
        "--target",
        "here",
    ]
    subprocess.run([*pip, str(archive)], cwd=tmp_path, check=True, capture_output=True)
    code = "import baldwinlab, baldwinlab.__main__ as it; print(baldwinlab.__file__); it.main()"
    done = subprocess.run(
        [sys.executable, "-c", code, "papers"],
        cwd=tmp_path,
        env={"PYTHONPATH": "here"},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    assert Path(done.stdout.splitlines()[0]).is_relative_to(
        tmp_path / "here"
    ) or done.stdout.startswith("here")
    assert "hinton-nowlan-1987" in done.stdout


def test_the_wheel_holds_types_pages_papers_and_modules(built: Path) -> None:
    (wheel,) = built.glob("*.whl")
    there = set(zipfile.ZipFile(wheel).namelist())
    tracked = subprocess.run(
        ["git", "ls-files", "baldwinlab"], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert set(tracked.stdout.split()) <= there, "everything that is tracked is shipped"
    assert "baldwinlab/py.typed" in there


def test_the_version_is_one() -> None:
    cited = re.search(r"^version: (.+)$", (ROOT / "CITATION.cff").read_text(), re.MULTILINE)
    assert cited and cited.group(1) == __version__
    assert __version__ in (ROOT / "CHANGELOG.md").read_text()


def test_pythons_that_are_promised_are_those_that_are_required() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    named = [
        line.rpartition(" ")[2]
        for line in project["classifiers"]
        if re.search(r"Python :: 3\.\d", line)
    ]
    assert named == ["3.11", "3.12", "3.13", "3.14"] and project["requires-python"] == ">=3.11"
