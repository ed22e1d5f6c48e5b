"""Describe the machine of a measurement."""

from __future__ import annotations

import platform
from pathlib import Path
from typing import Any

import numba
import numpy as np

from baldwinlab.studies.run import available_cores


def describe_machine() -> dict[str, Any]:
    """Return the platform, the processor and the versions of this machine.

    Returns
    -------
    dict
        The keys "platform", "processor", "cores", "python", "numpy" and "numba". Plain data for
        JSON.
    """
    return {
        "platform": platform.platform(),
        "processor": _read_processor_name(),
        "cores": available_cores(),
        "python": platform.python_version(),
        "numpy": np.__version__,
        "numba": numba.__version__,
    }


def _read_processor_name() -> str:
    # On Linux, `platform.processor` returns less than this file.
    try:
        lines = Path("/proc/cpuinfo").read_text("utf-8").splitlines()
    except OSError:
        return platform.processor()
    for line in lines:
        key, _, name = line.partition(":")
        if key.startswith("model name"):
            return name.strip()
    return platform.processor()
