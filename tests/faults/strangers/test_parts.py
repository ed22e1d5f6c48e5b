"""A faulty file of parts ends each command with a message and a status that is not 0."""

from __future__ import annotations

import os
import random
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.faults import amount
from tests.faults.strangers.oracle import (
    FIRST_SEED,
    Outcome,
    WarmProcess,
    find_faults,
    hash_files,
    start_warm_process,
)
from tests.faults.strangers.parts import write_part, write_rule

pytestmark = pytest.mark.skipif(os.name == "nt", reason="Windows has no forks")

N_PARTS = amount(200, 10)
N_RULES = amount(60, 4)
COMMANDS = [
    ["check", "part.py", "--requirements", "fields"],
    ["check", "part.py", "--requirements", "fields", "--json"],
    ["show", "evo/A", "--part", "part.py"],
    ["show", "evo/A", "--part", "part.py", "--json"],
    ["list", "parts", "--part", "part.py"],
    ["run", "evo/A", "--part", "part.py", "--runs", "1", "--generations", "0", "--out", "study"],
]
SETTINGS = ["learning.rule=stranger", "population.size=2", "lifetime.steps=9"]
SIMULATION = [
    *["run", "evo/A", "--part", "part.py", "--runs", "1", "--generations", "1"],
    *["--out", "study", "--set", *SETTINGS],
]


@pytest.fixture(scope="module")
def warm_process(tmp_path_factory: pytest.TempPathFactory) -> Iterator[WarmProcess]:
    folder = tmp_path_factory.mktemp("warm") / "strangers"
    with start_warm_process(folder, NUMBA_DISABLE_JIT="1") as process:
        yield process


@pytest.fixture
def work(warm_process: WarmProcess) -> Path:
    """An empty folder, in which the warm process executes its commands."""
    folder = warm_process.folder / "work"
    shutil.rmtree(folder)
    folder.mkdir()
    return folder


@pytest.mark.parametrize("seed", range(FIRST_SEED, FIRST_SEED + N_PARTS))
def test_a_faulty_part_ends_with_a_message(
    warm_process: WarmProcess, work: Path, seed: int
) -> None:
    choice = random.Random(seed)
    content, is_error = write_part(choice)
    command = choice.choice(COMMANDS)
    faults, outcome = run_with_part(warm_process, content, command)
    if is_error and outcome.status == "0":
        faults.append("status 0")
    assert not faults, f"seed {seed}: {content!r}\n{', '.join(faults)}\n{outcome.describe()}"


@pytest.mark.parametrize("seed", range(FIRST_SEED, FIRST_SEED + N_RULES))
def test_a_rule_that_fails_in_a_simulation_is_named(
    warm_process: WarmProcess, work: Path, seed: int
) -> None:
    content = write_rule(random.Random(seed))
    faults, outcome = run_with_part(warm_process, content, SIMULATION)
    if outcome.status == "0":
        faults.append("status 0")
    # A fault that the source shows has the file and the line instead of the name.
    if "stranger" not in outcome.err and "part.py:" not in outcome.err:
        faults.append("neither the name of the rule nor its line")
    assert not faults, f"seed {seed}: {content!r}\n{', '.join(faults)}\n{outcome.describe()}"


def run_with_part(
    warm_process: WarmProcess, content: bytes, command: list[str]
) -> tuple[list[str], Outcome]:
    """Execute a command with a part. Return what is wrong, and its outcome."""
    Path(warm_process.folder, "work", "part.py").write_bytes(content)
    before = hash_files(warm_process.folder, "output")
    outcome = warm_process.run(*command)
    after = hash_files(warm_process.folder, "output")
    faults = find_faults(outcome)
    faults += [f"{name} is changed" for name in before if after.get(name) != before[name]]
    faults += [f"{name} is new" for name in after.keys() - before if not is_expected(name)]
    return faults, outcome


def is_expected(name: str) -> bool:
    """Return whether a command or a part of the grammar may create the file."""
    return name.startswith(("work/study", "work/file-of-the-part"))
