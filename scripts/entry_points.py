"""Compile the entry points whose bitcode the package contains: about a minute.

Run the script after a change of the code of a module in `sources.json`: a test fails until then.
"""

import os
import subprocess
import sys
import tempfile

from baldwinlab.engine import bitcode, jit
from baldwinlab.experiment import BaseExperiment
from baldwinlab.papers import presets
from baldwinlab.simulation.compilation import compile_experiments


def list_experiments() -> list[BaseExperiment]:
    """Return the experiments whose code the package contains."""
    return list(presets.paper())


def compile_entry_points() -> None:
    """Write the bitcode of all entry points that the experiments use."""
    for experiment in list_experiments():
        compile_experiments([experiment])
    bitcode.write_bitcode(jit.list_entry_points())


def main() -> None:
    """Compile in a new process, with an empty cache, for a processor with AVX2."""
    (bitcode.FOLDER / bitcode.REQUIREMENTS).unlink(missing_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        settings = {"NUMBA_CPU_NAME": "x86-64-v3", "NUMBA_CPU_FEATURES": ""}
        environment = os.environ | settings | {"BALDWINLAB_CACHE": folder}
        code = "from scripts import entry_points; entry_points.compile_entry_points()"
        subprocess.run([sys.executable, "-c", code], env=environment, check=True)
    for path in sorted(bitcode.FOLDER.iterdir()):
        print(f"{path.name}: {path.stat().st_size:,} bytes")


if __name__ == "__main__":
    main()
