"""Rules that the contracts of import-linter in pyproject.toml do not cover."""

from __future__ import annotations

import ast
import json
import pkgutil
import subprocess
import sys
from collections import Counter
from pathlib import Path

import baldwinlab
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


def test_the_name_of_a_class_is_unique_in_the_package() -> None:
    counts = Counter(
        node.name
        for path in Path(baldwinlab.__file__).parent.rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.ClassDef)
    )
    assert [name for name, count in counts.items() if count > 1] == []
