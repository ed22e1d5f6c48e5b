"""Describe the machine and the versions."""

from __future__ import annotations

import os
import platform
import re
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from baldwinlab.engine.threads import available_cores

VERSIONS = ("numpy", "numba", "jax", "jaxlib")


def provenance() -> dict[str, Any]:
    """Return CPU, cores, system, versions, and the load of the machine by other processes."""
    return {
        "cpu": _cpu(),
        "cores": available_cores(),
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
