"""Imports point down: the two towers share only the ground they stand on."""

from __future__ import annotations

import ast
from pathlib import Path

import baldwinlab

PACKAGE = Path(baldwinlab.__file__).parent
FLOORS = [
    {"errors", "version"},
    {"files"},
    {"experiment"},
    {"engine"},
    {"papers", "variables"},
    {"presets"},
    {"evolution"},
    {"models"},
    {"runs"},
    {"studies"},
    {"multiverse"},
    {"assays", "sweeps"},
    {"analysis", "movie", "bench"},
    {"figures"},
    {"report"},
    {"publish", "console"},
    {"api"},
    {"lab"},
    {"cli"},
    {"__main__"},
]
FIRST_TOWER = {
    "engine",
    "evolution",
    "models",
    "runs",
    "studies",
    "multiverse",
    "assays",
    "sweeps",
}
SECOND_TOWER = {"analysis", "figures", "report", "movie"}


def parts_imported(path: Path) -> set[str]:
    """The parts of the package that a file imports when it is loaded or used."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom) and node.module and node.module.split(".")[0] == "baldwinlab":
            steps = node.module.split(".")
            found |= {steps[1]} if len(steps) > 1 else {alias.name for alias in node.names}
        elif isinstance(node, ast.Import):
            found |= {alias.name.split(".")[1] for alias in node.names if alias.name.startswith("baldwinlab.")}
    return found


def files_of(part: str) -> list[Path]:
    folder = PACKAGE / part
    return sorted(folder.rglob("*.py")) if folder.is_dir() else [PACKAGE / f"{part}.py"]


def test_every_part_imports_only_from_floors_below() -> None:
    below: set[str] = set()
    for floor in FLOORS:
        for part in floor:
            for path in files_of(part):
                assert parts_imported(path) <= below | {part}, path
        below |= floor


def test_every_part_has_its_floor() -> None:
    parts = {entry.stem for entry in PACKAGE.iterdir() if entry.suffix == ".py" or (entry / "__init__.py").exists()} - {
        "__init__"
    }
    assert parts == set().union(*FLOORS)


def test_the_two_towers_do_not_know_each_other() -> None:
    for tower, other in ((FIRST_TOWER, SECOND_TOWER), (SECOND_TOWER, FIRST_TOWER)):
        for part in tower:
            for path in files_of(part):
                assert not parts_imported(path) & other, path
