"""Imports point down: a room knows those below it, capabilities not each other, and what reads results needs no engine."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

import baldwinlab

PACKAGE = Path(baldwinlab.__file__).parent
FLOORS = [
    {"errors", "factors", "palette", "suggestions", "version"},
    {"extras"},
    {"files"},
    {"netcdf", "outputs"},
    {"resources"},
    {"experiment"},
    {"engine", "variables", "statistics"},
    {"papers", "parts"},
    {"presets"},
    {"evolution"},
    {"models"},
    {"library"},
    {"runs"},
    {"check"},
    {"studies"},
    {"movie", "bench", "doctor"},
    {"figures"},
    {"report"},
    {"assays", "multiverse", "sweeps"},
    {"results", "console", "gallery", "exchange"},
    {"publish"},
    {"api"},
    {"lab"},
    {"cli"},
    {"__main__"},
]
CAPABILITIES = ("assays", "multiverse", "sweeps")
LIVES = {"engine", "parts", "evolution", "models", "library", "runs", "check", "studies"}
READS = {"statistics", "figures", "report", "movie"}  # besides these files of each capability:
FILES_THAT_READ = {"stored", "norms", "analysis", "figures", "section", "verdict", "glance", "ways"}


def name_of(path: Path) -> str:
    """The module in a file, below the package: report.words, or assays of studies/assays/__init__.py."""
    return ".".join(path.relative_to(PACKAGE).with_suffix("").parts).removesuffix(".__init__")


MODULES = {name_of(path): path for path in PACKAGE.rglob("*.py") if path != PACKAGE / "__init__.py"}


def room(module: str) -> str:
    """A capability's command belongs to the command line."""
    first, *rest = module.split(".")
    return "cli" if rest == ["command"] else first


def statements(tree: ast.AST) -> Iterator[ast.AST]:
    """All there are, but for what is imported for type checkers alone."""
    for node in ast.iter_child_nodes(tree):
        if not (isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"):
            yield node
            yield from statements(node)


@cache
def imported(module: str) -> set[str]:
    """The modules of the package that a module imports when it is loaded or used."""
    names = set()
    for node in statements(ast.parse(MODULES[module].read_text())):
        if (
            isinstance(node, ast.ImportFrom)
            and node.module
            and node.module.split(".")[0] == "baldwinlab"
        ):
            names |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
        elif isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
    return {name.removeprefix("baldwinlab.") for name in names} & MODULES.keys()


def loaded(module: str) -> set[str]:
    """What is loaded with a module: what it imports, what that imports, and the packages that they lie in."""
    found, ahead = set[str](), [module]
    while ahead:
        name = ahead.pop()
        if name not in found and name in MODULES:
            found.add(name)
            ahead += [*imported(name), name.rpartition(".")[0]]
    return found


def reads(module: str) -> bool:
    first, *rest = module.split(".")
    return first in READS or (
        first in CAPABILITIES and rest[:1] != [] and rest[0] in FILES_THAT_READ
    )


def test_every_room_imports_only_from_floors_below() -> None:
    below: set[str] = set()
    for floor in FLOORS:
        for module in MODULES:
            if room(module) in floor:
                assert {room(name) for name in imported(module)} <= below | {room(module)}, module
        below |= floor


def test_every_room_has_its_floor() -> None:
    assert {room(module) for module in MODULES} == set().union(*FLOORS)


@pytest.mark.parametrize("capability", CAPABILITIES)
def test_of_a_capability_design_analysis_figures_section_and_command_lie_beside_each_other(
    capability: str,
) -> None:
    files = {path.name for path in (PACKAGE / capability).iterdir()}
    assert {"analysis.py", "figures.py", "section.py", "section.html", "command.py"} <= files


@pytest.mark.parametrize("module", [module for module in MODULES if reads(module)])
def test_what_reads_results_loads_nothing_that_lives(module: str) -> None:
    assert not {name for name in loaded(module) if room(name) in LIVES}


def test_what_lives_knows_nothing_of_what_reads() -> None:
    for module in MODULES:
        if room(module) in LIVES:
            assert not {name for name in imported(module) if reads(name)}, module
