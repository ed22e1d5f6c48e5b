"""Test that the locked files agree with pyproject.toml."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
import sysconfig
import tomllib
from pathlib import Path

import numpy as np
import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from scripts import removed_names

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
        *(line for name, lines in EXTRAS.items() if name != "cuda" for line in lines),
    ],
    "requirements-cuda.txt": [*CORE, *EXTRAS["cuda"]],
    "requirements-nightly.txt": [
        *CORE,
        *EXTRAS["rl"],
        *PROJECT["dependency-groups"]["nightly"],
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


def test_every_line_of_a_locked_file_is_a_pin_with_hashes_and_no_address() -> None:
    faults = []
    for file in LOCKED:
        text = (ROOT / file).read_text("utf-8")
        lines = [line for line in text.splitlines() if line and not line.startswith((" ", "#"))]
        if not lines or len(list_pins(file)) != len(lines) or "://" in text:
            faults.append(file)
    assert not faults


def test_a_locked_file_has_one_fitting_version_of_each_requirement() -> None:
    faults = {
        (file, python): lines
        for file in LOCKED
        for python in SUPPORTED
        if (lines := list_unmet_requirements(file, python))
    }
    assert not faults


def list_unmet_requirements(file: str, python: str) -> list[str]:
    """Return the requirements of which a locked file has no, several or a wrong version."""
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
    faults = [name for name, numbers in versions.items() if len(numbers) != 1]
    for line in LOCKED[file]:
        requirement = Requirement(line)
        pinned = versions.get(canonicalize_name(requirement.name), [])
        if not pinned or not requirement.specifier.contains(pinned[0]):
            faults.append(line)
    return faults


PLATFORMS = {
    "requirements.txt": (
        "x86_64-manylinux_2_28",
        "aarch64-manylinux_2_28",
        "x86_64-pc-windows-msvc",
        "aarch64-apple-darwin",
    ),
    "requirements-dev.txt": ("x86_64-manylinux_2_28", "x86_64-pc-windows-msvc"),
    "requirements-cuda.txt": (
        "x86_64-manylinux_2_28",
        "aarch64-manylinux_2_28",
        "x86_64-pc-windows-msvc",
    ),
}
WINDOWS_ON_ARM = [("requirements.txt", "aarch64-pc-windows-msvc", ("3.13", "3.14"))]


# The test needs the package index. README.md names the platforms.
@pytest.mark.nightly
@pytest.mark.parametrize(
    ("file", "platform", "pythons"),
    [
        *((file, name, tuple(SUPPORTED)) for file, names in PLATFORMS.items() for name in names),
        *WINDOWS_ON_ARM,
    ],
)
def test_every_locked_version_has_a_wheel_and_permits_the_others(
    file: str, platform: str, pythons: tuple[str, ...], tmp_path: Path
) -> None:
    uv = str(Path(sys.executable).parent / "uv")
    wheels = ["--dry-run", "--quiet", "--only-binary", ":all:", "--require-hashes", "-r", file]
    target = ["--python-platform", platform, "--target", str(tmp_path)]
    for python in pythons:
        command = [uv, "pip", "install", *wheels, *target, "--python-version", python]
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
        assert done.returncode == 0, (python, done.stderr)


COMPILE_KERNEL = """
from types import SimpleNamespace
from numba.cuda import dispatcher, types
from numba.cuda.cudadrv import devices
from baldwinlab.engine.gpu import kernel
from tests.engine.gpu_code import compile_kernel

device = SimpleNamespace(compute_capability=(9, 0))
dispatcher.get_current_device = lambda: device
devices.get_context = lambda: SimpleNamespace(device=device)

def increase(numbers):
    numbers[0] += 1

print(compile_kernel(kernel(32)(increase), (types.float32[::1],)).get_asm_str())
"""


# The test needs the package index.
@pytest.mark.nightly
def test_a_kernel_compiles_with_the_locked_versions_on_the_newest_python(tmp_path: Path) -> None:
    uv = str(Path(sys.executable).parent / "uv")
    command = [uv, "python", "list", "--only-installed", "--output-format", "json"]
    interpreters = json.loads(subprocess.run(command, check=True, capture_output=True).stdout)
    versions = {
        (parts["major"], parts["minor"]): python["path"]
        for python in interpreters
        if (parts := python["version_parts"]) and python["implementation"] == "cpython"
    }
    newest = max(version for version in versions if "{}.{}".format(*version) in SUPPORTED)
    folder = tmp_path / "environment"
    environment = os.environ | {"VIRTUAL_ENV": str(folder), "PYTHONPATH": str(ROOT)}
    files = ["-r", "requirements.txt", "-r", "requirements-cuda.txt"]
    for words in (
        ["venv", "--quiet", "--python", versions[newest], str(folder)],
        ["pip", "install", "--quiet", "--require-hashes", *files],
        ["pip", "check", "--quiet"],
        ["run", "--quiet", "--no-project", "--active", "python", "-c", COMPILE_KERNEL],
    ):
        done = subprocess.run(
            [uv, *words], cwd=ROOT, env=environment, capture_output=True, text=True
        )
        assert done.returncode == 0, (newest, words[0], done.stderr)
    assert "add.rn.f32" in done.stdout


# The search in all installed libraries takes a minute.
@pytest.mark.nightly
def test_no_installed_library_uses_a_removed_name_of_numpy(
    capsys: pytest.CaptureFixture[str],
) -> None:
    removed_names.main(Path(sysconfig.get_path("purelib")))
    names = {line.partition(": ")[2] for line in capsys.readouterr().out.splitlines()}
    # Numba returns before its use of `MachAr`. SciPy misspells `zeros_like`.
    accepted = {f"numpy.{name} is not in {np.__version__}" for name in ("MachAr", "zeroslike")}
    assert names <= accepted


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
