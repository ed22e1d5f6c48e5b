"""Test the public names of `baldwinlab` and the modules that its import loads."""

from __future__ import annotations

import ast
import builtins
import importlib
import inspect
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from importlib.metadata import packages_distributions
from pathlib import Path
from pkgutil import iter_modules

import pytest
from numpydoc.validate import validate

import baldwinlab
from baldwinlab.analysis import theory

PACKAGE = Path(baldwinlab.__file__).parent
HEAVY = {
    "numba",
    "scipy",
    "matplotlib",
    "xarray",
    "numpy",
    "pandas",
    "PIL",
    "jinja2",
    "starlette",
    "dask",
    "distributed",
}


def list_loaded_packages(code: str) -> set[str]:
    """Return the third-party packages that a new process loads when it runs `code`."""
    code += "\nimport sys; print('loaded', *{name.partition('.')[0] for name in sys.modules})"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return set(done.stdout.splitlines()[-1].split()) & (HEAVY | {"pydantic", "rich", "cyclopts"})


def command_code(*words: str) -> str:
    """Return Python code that runs a command of the command line."""
    start = f"import sys; sys.argv = ['baldwinlab', *{words}]\nfrom baldwinlab.cli import main\n"
    return start + "try: main()\nexcept SystemExit: pass\n"


def test_every_public_name_exists_and_is_listed() -> None:
    for name in baldwinlab.__all__:
        assert getattr(baldwinlab, name) is not None
    assert dir(baldwinlab) == sorted(baldwinlab.__all__)
    with pytest.raises(AttributeError, match="no attribute 'simulator'"):
        getattr(baldwinlab, "simulator")  # noqa: B009


def public_docstrings() -> Iterator[tuple[str, str]]:
    """Yield the public names of the package and of its public classes, with their docstrings."""
    for name in baldwinlab.__all__:
        value = getattr(baldwinlab, name)
        yield name, inspect.getdoc(value) or ""
        if inspect.isclass(value):
            for attribute in vars(value):
                if not attribute.startswith("_"):
                    docstring = inspect.getdoc(getattr(value, attribute))
                    yield f"{name}.{attribute}", docstring or ""


# Checks of numpydoc. The summary and the annotation can say what a parameter or a result is.
DOCSTRING_CHECKS = {
    *("GL06", "GL07", "GL08", "GL10", "SS01", "SS02", "SS03", "SS04", "SS05", "SS06"),
    *("PR01", "PR02", "PR03", "PR04", "PR05", "PR09", "PR10"),
}
PUBLIC_MODULES = (
    "baldwinlab",
    "baldwinlab.parts",
    "baldwinlab.analysis.statistics",
    "baldwinlab.analysis.estimands",
    *(f"baldwinlab.analysis.theory.{module.name}" for module in iter_modules(theory.__path__)),
)


def public_paths(module_name: str) -> Iterator[str]:
    """Yield the import paths of the public functions, classes and methods of a module.

    The helpers for parts, for example `get(array, row, lane)`, need no sections.
    """
    module = importlib.import_module(module_name)
    for name in getattr(module, "__all__", dir(module)):
        value = getattr(module, name)
        home = getattr(value, "__module__", "")
        is_helper = home.startswith(("baldwinlab.engine.", "baldwinlab.models."))
        is_own = home.startswith("baldwinlab.") and not is_helper
        if is_own and not name.startswith("_") and inspect.isroutine(value):
            yield f"{module_name}.{name}"
        elif is_own and inspect.isclass(value):
            yield f"{module_name}.{name}"
            methods = (key for key, method in vars(value).items() if inspect.isroutine(method))
            yield from (f"{module_name}.{name}.{key}" for key in methods if key[0] != "_")


def list_docstring_errors(path: str) -> list[str]:
    """Return what numpydoc reports about a docstring."""
    result = validate(path)
    # The fields of a class without `__init__` are attributes, not parameters.
    is_function = result["type"] in ("function", "method")
    checks = DOCSTRING_CHECKS if is_function else DOCSTRING_CHECKS - {"PR01"}
    return [f"{path}: {code} {text}" for code, text in result["errors"] if code in checks]


def test_docstrings_of_public_names_are_complete() -> None:
    paths = [path for module in PUBLIC_MODULES for path in public_paths(module)]
    assert {"baldwinlab.Study.compare", "baldwinlab.parts.Network.forward"} <= set(paths)
    assert [error for path in paths for error in list_docstring_errors(path)] == []


def test_docstrings_name_only_exceptions_that_the_package_exports() -> None:
    named = {
        (name, error)
        for name, docstring in public_docstrings()
        for error in re.findall(r"\b[A-Z]\w+(?:Error|Warning|Interrupt)\b", docstring)
    }
    assert ("run", "ArgumentError") in named
    unknown = {pair for pair in named if not hasattr(baldwinlab, pair[1])}
    assert not {pair for pair in unknown if not hasattr(builtins, pair[1])}


def test_no_public_name_is_the_name_of_a_module() -> None:
    """An import of the module would replace the public name."""
    assert not {entry.stem for entry in PACKAGE.iterdir()} & set(baldwinlab.__all__)


def test_imports_for_type_checkers_agree_with_imports_at_run_time() -> None:
    tree = ast.parse((PACKAGE / "__init__.py").read_text())
    block = next(node for node in tree.body if isinstance(node, ast.If))
    typed = {
        alias.name: node.module
        for node in block.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    assert typed == {
        name: f"baldwinlab.{home}" for name, home in baldwinlab._MODULE_BY_NAME.items()
    }


def test_importing_the_package_loads_no_library_and_creates_no_folder(tmp_path: Path) -> None:
    cache = str(tmp_path / "cache")
    start = f"import os; os.environ['BALDWINLAB_CACHE'] = {cache!r}; "
    code = "import baldwinlab as bl; bl.load('evo/A'); dir(bl)"
    assert list_loaded_packages(start + code) == {"pydantic"}
    assert list_loaded_packages("import baldwinlab") == set()
    assert not list(tmp_path.iterdir())


def test_commands_that_only_print_load_no_engine() -> None:
    """One process runs all commands, because each start takes a second."""
    commands = (
        ["--help"],
        ["--version"],
        ["list", "papers"],
        ["list", "presets"],
        ["list", "parts"],
        ["show", "evo+self-taught/B", "--set", "lifetime.steps=5"],
        ["rum"],
    )
    code = "".join(command_code(*words) for words in commands)
    assert not list_loaded_packages(code) & HEAVY


@pytest.mark.parametrize(
    "words",
    [["--help"], ["list", "presets"], ["doctor", "--help"], ["lab", "--help"], ["run", "--help"]],
)
def test_no_command_needs_a_module_that_only_unix_has(words: list[str]) -> None:
    modules = ("resource", "fcntl", "pwd", "grp", "termios")
    block = f"import sys\nfor name in {modules}: sys.modules[name] = None\n"
    code = block + command_code(*words)
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stdout


def test_a_run_loads_no_library_of_datasets_figures_or_servers(tmp_path: Path) -> None:
    words = ["run", "evo/A", "--generations", "1", "--runs", "1", "--out", str(tmp_path / "study")]
    loaded = list_loaded_packages(command_code(*words))
    assert (tmp_path / "study" / "runs" / "evo" / "A" / "0000.nc").exists()
    assert loaded & HEAVY <= {"numba", "numpy", "scipy"}


def test_every_imported_package_is_a_declared_dependency() -> None:
    """An indirect dependency can disappear with a new version of the direct one."""
    project = tomllib.loads((PACKAGE.parent / "pyproject.toml").read_text())["project"]
    extras = [
        project["optional-dependencies"][name]
        for name in ("cuda", "cluster", "exchange", "lab", "rl", "video")
    ]
    lines = sum(extras, project["dependencies"])
    declared = {re.split(r"[^A-Za-z0-9_-]", line)[0].replace("_", "-").lower() for line in lines}
    owners = packages_distributions()
    # IPython is imported only in a notebook, which has it.
    for name in list_imports() - sys.stdlib_module_names - {"baldwinlab", "IPython"}:
        distributions = {owner.replace("_", "-").lower() for owner in owners.get(name, [name])}
        assert distributions & declared, name


def list_imports() -> set[str]:
    """Return the packages that the modules of baldwinlab import."""
    nodes = [
        node
        for path in PACKAGE.rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text("utf-8")))
    ]
    names = {alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names}
    names |= {node.module for node in nodes if isinstance(node, ast.ImportFrom) and node.module}
    return {name.partition(".")[0] for name in names}
