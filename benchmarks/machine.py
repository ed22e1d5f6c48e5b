"""Describe the machine, the versions, and the size of an installation."""

from __future__ import annotations

import os
import platform
import re
import tomllib
from collections.abc import Iterable
from importlib.metadata import PackageNotFoundError, distribution, version
from pathlib import Path
from typing import Any

from packaging.requirements import Requirement

ROOT = Path(__file__).parent.parent
NEEDS = {
    "python_plain": [],
    "numpy_vectorised": ["numpy"],
    "jax_scan": ["jax"],
    "evojax_waterworld": ["evojax"],
    "mesa_boids": ["mesa", "networkx"],
}
VERSIONS = ("numpy", "numba", "jax", "jaxlib", "evojax", "flax", "Mesa")


def needs(contender: str) -> list[str]:
    """Return the direct requirements of a contender."""
    dependencies = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["dependencies"]
    return dependencies if contender.startswith("baldwinlab") else NEEDS[contender]


def installed_mib(contender: str) -> float | None:
    """Return the size of all distributions that a contender needs, in MiB.

    The result is None if a distribution is not installed.
    """
    try:
        size = sum(_size(name) for name in closure(needs(contender)))
    except PackageNotFoundError:
        return None
    if contender.startswith("baldwinlab"):
        size += sum(
            path.stat().st_size
            for path in (ROOT / "baldwinlab").rglob("*")
            if path.is_file() and path.suffix != ".pyc"
        )
    return size / 2**20


def closure(requirements: Iterable[str]) -> set[str]:
    """Return the names of all required distributions, direct and indirect.

    Raises PackageNotFoundError if one is not installed.
    """
    names: set[str] = set()
    waiting = [Requirement(text) for text in requirements]
    while waiting:
        requirement = waiting.pop()
        name = re.sub(r"[-_.]+", "-", requirement.name).lower()
        if name not in names:
            names.add(name)
            indirect = map(Requirement, distribution(name).requires or ())
            extras = requirement.extras or {""}
            waiting += [dependency for dependency in indirect if _applies(dependency, extras)]
    return names


def _applies(requirement: Requirement, extras: Iterable[str]) -> bool:
    return not requirement.marker or any(
        requirement.marker.evaluate({"extra": extra}) for extra in extras
    )


def _size(name: str) -> int:
    paths = [Path(str(file.locate())) for file in distribution(name).files or ()]
    return sum(path.stat().st_size for path in paths if path.is_file())


def provenance() -> dict[str, Any]:
    """Return CPU, cores, system, versions, and the load of the machine by other processes."""
    has_affinity = hasattr(os, "sched_getaffinity")
    return {
        "cpu": _cpu(),
        "cores": len(os.sched_getaffinity(0)) if has_affinity else os.cpu_count(),
        "system": f"{platform.system()} {platform.machine()}",
        "python": platform.python_version(),
        "load": round(os.getloadavg()[0], 2),
        "versions": _versions(),
    }


def _cpu() -> str:
    information = Path("/proc/cpuinfo")
    text = information.read_text(encoding="utf-8") if information.exists() else ""
    names = re.search(r"model name\s*: (.*)", text)
    vectors = next(
        (name for flag, name in (("avx512f", "AVX-512"), ("avx2", "AVX2")) if f" {flag}" in text),
        "",
    )
    return f"{names[1] if names else platform.processor()}{', ' + vectors if vectors else ''}"


def _versions() -> dict[str, str]:
    versions = {}
    for name in VERSIONS:
        try:
            versions[name] = version(name)
        except PackageNotFoundError:
            versions[name] = "not installed"
    return versions
