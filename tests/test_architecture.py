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

# The modules that open, list and remove what is in a user's folder.
FILE_MODULES = ("core/files.py", "core/file_writing.py")
# Calls that skip the checks of these modules: links, pipes, devices, sizes, and study folders.
FILE_CALLS = {
    *("iterdir", "glob", "rglob", "walk", "scandir", "listdir", "unlink", "rmtree", "remove"),
    *("read_bytes", "read_text", "open"),
}
# Names whose methods of these names are no access to files, or only to the modules' own files.
OTHER_OWNERS = {"ast", "console", "partial_path"}
# Modules with such calls, none of which has the path of a user's file, by reason.
EXCEPTIONS = {
    "data of the package": (
        *("analysis/assays/criteria.py", "analysis/assays/sentences.py", "analysis/typeface.py"),
        *("cli/options.py", "engine/bitcode.py", "engine/fingerprint.py", "engine/wasm.py"),
        *("lab/pages/explorable/__init__.py", "lab/pages/export.py", "lab/pages/lesson_pack.py"),
        *("lab/pages/single_page.py", "models/miniworld/backends/wasm_modules.py"),
        "papers/rules.py",
    ),
    "source code of imported modules": ("parts/lane_check.py", "parts/loading.py"),
    "private folder of the user": ("engine/cache.py", "lab/server/access.py"),
    "files of the operating system": ("core/extras.py", "core/resources.py"),
    "movies in a temporary folder": ("analysis/movie.py", "lab/pages/downloads.py"),
    "lock of a folder": ("studies/study_length.py",),
}


def test_two_modules_open_list_and_remove_the_files_of_users() -> None:
    package = Path(baldwinlab.__file__).parent
    callers = {
        path.relative_to(package).as_posix()
        for path in package.rglob("*.py")
        if any(map(is_file_call, ast.walk(ast.parse(path.read_text()))))
    }
    exceptions = {name for names in EXCEPTIONS.values() for name in names}
    assert callers - exceptions == set(FILE_MODULES)
    # An exception that is no longer needed is removed from the list.
    assert exceptions <= callers


def is_file_call(node: ast.AST) -> bool:
    """Return whether a node is a call such as `path.glob()`, `os.walk()` or `open()`."""
    if not isinstance(node, ast.Call):
        return False
    if isinstance(node.func, ast.Name):
        return node.func.id == "open"
    if not isinstance(node.func, ast.Attribute) or node.func.attr not in FILE_CALLS:
        return False
    owner = ast.unparse(node.func.value)
    # The null device is no user's file, and lists have a method `remove`.
    opens_null_device = bool(node.args) and ast.unparse(node.args[0]) == "os.devnull"
    is_other_remove = node.func.attr == "remove" and owner != "os"
    return not (owner in OTHER_OWNERS or opens_null_device or is_other_remove)


def test_a_call_that_opens_or_removes_a_file_is_recognized() -> None:
    code = "open(p); p.open(); os.remove(p); p.glob('*'); os.walk(p); shutil.rmtree(p); p.unlink()"
    calls = [node for node in ast.walk(ast.parse(code)) if isinstance(node, ast.Call)]
    assert len(calls) == 7
    assert all(map(is_file_call, calls))
    assert not any(map(is_file_call, ast.walk(ast.parse("names.remove(n)"))))


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
