"""Test imports by name, which the contracts of import-linter in pyproject.toml do not cover."""

from __future__ import annotations

import json
import pkgutil
import subprocess
import sys

from baldwinlab import analysis

SIMULATION = ("engine", "parts", "evolution", "models", "simulation", "studies", "api", "lab")
SCRIPT = """
import importlib, json, sys
for name in json.loads(sys.argv[1]):
    importlib.import_module(name)
print(json.dumps([name for name in sys.modules if name.startswith("baldwinlab.")]))
"""


def test_the_modules_of_analysis_load_no_module_that_simulates() -> None:
    modules = [
        name for _, name, _ in pkgutil.walk_packages(analysis.__path__, "baldwinlab.analysis.")
    ]
    command = [sys.executable, "-c", SCRIPT, json.dumps(modules)]
    loaded = json.loads(subprocess.check_output(command, text=True))
    assert set(modules) <= set(loaded)
    assert [name for name in loaded if name.split(".")[1] in SIMULATION] == []
