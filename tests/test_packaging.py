"""Test that the wheel and the source archive are complete and run from an empty folder."""

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
def archives(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build the wheel and the source archive and return their folder."""
    folder = tmp_path_factory.mktemp("dist")
    subprocess.run(
        [sys.executable, "-m", "hatchling", "build", "-d", str(folder)],
        cwd=ROOT,
        check=True,
        capture_output=True,
    )
    return folder


@pytest.mark.parametrize("kind", ["*.whl", pytest.param("*.tar.gz", marks=pytest.mark.nightly)])
def test_an_archive_runs_from_an_empty_folder(archives: Path, tmp_path: Path, kind: str) -> None:
    (archive,) = archives.glob(kind)
    pip = [sys.executable, "-m", "pip", "install"]
    options = ["--no-deps", "--no-index", "--no-build-isolation", "--target", "installed"]
    subprocess.run([*pip, *options, str(archive)], cwd=tmp_path, check=True, capture_output=True)
    code = "import baldwinlab, baldwinlab.__main__ as it; print(baldwinlab.__file__); it.main()"
    done = subprocess.run(
        [sys.executable, "-c", code, "list", "papers"],
        cwd=tmp_path,
        env={"PYTHONPATH": "installed"},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    module = tmp_path / done.stdout.splitlines()[0]
    assert module.is_relative_to(tmp_path / "installed")
    assert "hinton-nowlan-1987" in done.stdout


def test_the_wheel_has_all_files_of_the_package(archives: Path) -> None:
    (wheel,) = archives.glob("*.whl")
    names = set(zipfile.ZipFile(wheel).namelist())
    tracked = subprocess.run(
        ["git", "ls-files", "baldwinlab"], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert set(tracked.stdout.split()) <= names, "a tracked file is missing"
    assert {"baldwinlab/py.typed", "baldwinlab/lab/pages/teaching/lesson-1.md"} <= names


def test_citation_and_changelog_have_the_version_of_the_package() -> None:
    cited = re.search(r"^version: (.+)$", (ROOT / "CITATION.cff").read_text(), re.MULTILINE)
    assert cited and cited.group(1) == __version__
    assert __version__ in (ROOT / "CHANGELOG.md").read_text()


def test_the_classifiers_agree_with_the_required_python_version() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    versions = [
        line.rpartition(" ")[2]
        for line in project["classifiers"]
        if re.search(r"Python :: 3\.\d", line)
    ]
    assert versions == ["3.11", "3.12", "3.13", "3.14"]
    assert project["requires-python"] == ">=3.11"
