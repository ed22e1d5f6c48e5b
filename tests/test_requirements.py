"""Test that the locked files agree with pyproject.toml."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parent.parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
EXTRAS = PROJECT["project"]["optional-dependencies"]
CORE = PROJECT["project"]["dependencies"]
LOCKED = {
    "requirements.txt": [
        *CORE,
        *(line for name in ("build", "lab", "video") for line in EXTRAS[name]),
    ],
    "requirements-dev.txt": [
        *CORE,
        *(
            line
            for name, lines in EXTRAS.items()
            if name not in ("bench", "cuda", "wasm")
            for line in lines
        ),
    ],
    "requirements-bench.txt": [*CORE, *EXTRAS["bench"]],
    "requirements-cuda.txt": [*CORE, *EXTRAS["cuda"]],
    "requirements-wasm.txt": [*CORE, *EXTRAS["wasm"]],
    "requirements-validators.txt": PROJECT["dependency-groups"]["validators"],
    "requirements-rl-clients.txt": [
        *CORE,
        *EXTRAS["rl"],
        *PROJECT["dependency-groups"]["rl-clients"],
    ],
}
SUPPORTED = [
    line.rpartition(" ")[2]
    for line in PROJECT["project"]["classifiers"]
    if re.search(r"Python :: 3\.\d", line)
]


def list_pins(file: str) -> list[tuple[Requirement, int]]:
    """Return each pin of a locked file with the number of its hashes."""
    text = (ROOT / file).read_text("utf-8")
    hashes = r"((?: +--hash=sha256:[0-9a-f]{64}(?: \\)?\n)+)"
    blocks = re.findall(r"^(\S[^\n]*==[^\n]*?) \\\n" + hashes, text, re.MULTILINE)
    return [(Requirement(pin), lines.count("--hash")) for pin, lines in blocks]


@pytest.mark.parametrize("file", LOCKED)
def test_every_line_of_a_locked_file_is_a_pin_with_hashes_and_no_address(file: str) -> None:
    text = (ROOT / file).read_text("utf-8")
    lines = [line for line in text.splitlines() if line and not line.startswith((" ", "#"))]
    assert lines and len(list_pins(file)) == len(lines)
    assert "://" not in text


@pytest.mark.parametrize("file", LOCKED)
@pytest.mark.parametrize("python", SUPPORTED)
def test_a_locked_file_has_one_fitting_version_of_each_requirement(file: str, python: str) -> None:
    system = {
        "python_version": python,
        "python_full_version": f"{python}.0",
        "sys_platform": "linux",
    }
    versions: dict[str, list[str]] = {}
    for pin, _ in list_pins(file):
        if pin.marker is None or pin.marker.evaluate(system):
            (specifier,) = pin.specifier
            versions.setdefault(canonicalize_name(pin.name), []).append(specifier.version)
    assert all(len(numbers) == 1 for numbers in versions.values())
    for line in LOCKED[file]:
        requirement = Requirement(line)
        (version,) = versions[canonicalize_name(requirement.name)]
        assert requirement.specifier.contains(version), line


# The test needs the package index.
@pytest.mark.nightly
def test_the_locked_files_are_the_resolution_of_pyproject(tmp_path: Path) -> None:
    for name in ("pyproject.toml", "Makefile", *LOCKED):
        shutil.copy(ROOT / name, tmp_path / name)
    prefix = Path(sys.executable).parent
    make = ["make", "lock", f"BIN={prefix}", "VENV=environment", "--assume-old=environment/.dev"]
    (tmp_path / "environment").mkdir()
    (tmp_path / "environment/.dev").touch()
    subprocess.run(make, cwd=tmp_path, check=True, capture_output=True)
    for name in LOCKED:
        assert (tmp_path / name).read_text("utf-8") == (ROOT / name).read_text("utf-8"), name
