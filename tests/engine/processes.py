"""New Python processes, which import the package from the folder of these tests."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

ROOT = Path(__file__).parents[2]


def run_python(
    code: str,
    *arguments: str,
    environment: Mapping[str, str] | None = None,
    folder: Path = ROOT,
    check: bool = True,
) -> subprocess.CompletedProcess[str]:
    """Run Python code, and return status and output. `check`: raise if the status is not 0."""
    return subprocess.run(
        [sys.executable, "-c", code, *arguments],
        env={**os.environ, "PYTHONPATH": str(folder), **(environment or {})},
        cwd=folder,
        capture_output=True,
        text=True,
        check=check,
    )
