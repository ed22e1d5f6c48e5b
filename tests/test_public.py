"""What `import baldwinlab` gives, and what it does not load."""

from __future__ import annotations

import ast
import builtins
import inspect
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from importlib.metadata import packages_distributions
from pathlib import Path

import pytest

import baldwinlab

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
    "distributed",
}


def loaded_by(code: str) -> set[str]:
    """The packages, not of the standard library, that a new process has loaded when it has run `code`."""
    code += "\nimport sys; print('loaded', *{name.partition('.')[0] for name in sys.modules})"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return set(done.stdout.splitlines()[-1].split()) & (HEAVY | {"pydantic", "rich", "cyclopts"})


def command(*words: str) -> str:
    """The code of a command of the command line."""
    start = f"import sys; sys.argv = ['baldwinlab', *{words}]\nfrom baldwinlab.cli import main\n"
    return start + "try: main()\nexcept SystemExit: pass"


def test_every_public_name_is_there_and_listed() -> None:
    for name in baldwinlab.__all__:
        assert getattr(baldwinlab, name) is not None
    assert dir(baldwinlab) == sorted(baldwinlab.__all__)
    with pytest.raises(AttributeError, match="no attribute 'simulator'"):
        getattr(baldwinlab, "simulator")  # noqa: B009


@pytest.mark.parametrize(
    ("old", "new"),
    [("experiment_of", "read_experiment"), ("open", "open_study"), ("problem", "make_problem")],
)
def test_an_old_name_works_and_a_warning_names_the_new_one(old: str, new: str) -> None:
    with pytest.warns(FutureWarning, match=f"baldwinlab.{old} was renamed to baldwinlab.{new}"):
        assert getattr(baldwinlab, old) is getattr(baldwinlab, new)
    assert old not in dir(baldwinlab)


def public_docstrings() -> Iterator[tuple[str, str]]:
    """Every public name of the package, and of its public classes, with its docstring."""
    for name in baldwinlab.__all__:
        public = getattr(baldwinlab, name)
        yield name, inspect.getdoc(public) or ""
        if inspect.isclass(public):
            own = (each for each in vars(public) if not each.startswith("_"))
            yield from (
                (f"{name}.{each}", inspect.getdoc(getattr(public, each)) or "") for each in own
            )


def test_docstrings_name_only_exceptions_that_the_package_exports() -> None:
    named = {
        (name, error)
        for name, docstring in public_docstrings()
        for error in re.findall(r"\b[A-Z]\w+(?:Error|Warning|Interrupt)\b", docstring)
    }
    assert ("run", "ArgumentError") in named
    unknown = {pair for pair in named if not hasattr(baldwinlab, pair[1])}
    assert not {pair for pair in unknown if not hasattr(builtins, pair[1])}


def test_no_public_name_is_that_of_a_module() -> None:
    """Whoever imports the module would put it in the name's place."""
    assert not {entry.stem for entry in PACKAGE.iterdir()} & set(baldwinlab.__all__)


def test_types_are_those_of_what_is_loaded() -> None:
    batch = next(
        node
        for node in ast.parse((PACKAGE / "__init__.py").read_text()).body
        if isinstance(node, ast.If)
    )
    typed = {
        each.name: node.module
        for node in batch.body
        if isinstance(node, ast.ImportFrom)
        for each in node.names
    }
    assert typed == {name: f"baldwinlab.{home}" for name, home in baldwinlab._HOME.items()}


def test_to_import_it_loads_nothing_and_makes_no_folder(tmp_path: Path) -> None:
    code = "import os; os.environ['BALDWINLAB_CACHE'] = {!r}; import baldwinlab as bl; bl.load('evo/A'); dir(bl)"
    assert loaded_by(code.format(str(tmp_path / "cache"))) == {"pydantic"}
    assert loaded_by("import baldwinlab") == set()
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    "words",
    [
        ["--help"],
        ["--version"],
        ["list", "papers"],
        ["list", "presets"],
        ["list", "parts"],
        ["show", "evo+self-taught/B", "--set", "lifetime.steps=5"],
        ["rum"],
    ],
)
def test_a_command_that_only_tells_loads_no_engine(words: list[str]) -> None:
    assert not loaded_by(command(*words)) & HEAVY


@pytest.mark.parametrize(
    "words",
    [["--help"], ["list", "presets"], ["bench", "--help"], ["lab", "--help"], ["run", "--help"]],
)
def test_no_command_needs_what_only_unix_has(words: list[str]) -> None:
    without = "import sys\nfor name in ('resource', 'fcntl', 'pwd', 'grp', 'termios'): sys.modules[name] = None\n"
    done = subprocess.run(
        [sys.executable, "-c", without + command(*words)], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout


def test_to_run_a_study_loads_no_figures() -> None:
    assert not loaded_by("import baldwinlab.cli.run") & {
        "matplotlib",
        "PIL",
        "jinja2",
        "starlette",
        "distributed",
    }


def test_whatever_is_imported_is_declared() -> None:
    """In pyproject.toml, so that it is there wherever baldwinlab is; what comes by way of another package may go."""
    project = tomllib.loads((PACKAGE.parent / "pyproject.toml").read_text())["project"]
    extras = [
        project["optional-dependencies"][name]
        for name in ("cuda", "cluster", "exchange", "lab", "rl", "video")
    ]
    lines = sum(extras, project["dependencies"])
    declared = {re.split(r"[^A-Za-z0-9_-]", line)[0].replace("_", "-").lower() for line in lines}
    owners = packages_distributions()
    for name in (
        imported() - sys.stdlib_module_names - {"baldwinlab", "IPython"}
    ):  # a notebook has that
        assert {owner.replace("_", "-").lower() for owner in owners.get(name, [name])} & declared, (
            name
        )


def imported() -> set[str]:
    """The packages that any module of ours imports."""
    nodes = [
        node
        for path in PACKAGE.rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text("utf-8")))
    ]
    names = {alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names}
    names |= {node.module for node in nodes if isinstance(node, ast.ImportFrom) and node.module}
    return {name.partition(".")[0] for name in names}
