"""A faulty file of parts ends each command with a message and a status that is not 0."""

from __future__ import annotations

import os
import random
import shutil
from collections.abc import Iterator

import pytest

from tests.faults import amount
from tests.faults.strangers.oracle import (
    WarmProcess,
    find_faults,
    hash_files,
    start_warm_process,
)
from tests.faults.strangers.parts import write_part

pytestmark = pytest.mark.skipif(os.name == "nt", reason="Windows has no forks")

N_PARTS = amount(200, 10)
FIRST_SEED = int(os.environ.get("STRANGERS_SEED", "0"))
COMMANDS = [
    ["check", "part.py", "--requirements", "fields"],
    ["check", "part.py", "--requirements", "fields", "--json"],
    ["show", "evo/A", "--part", "part.py"],
    ["show", "evo/A", "--part", "part.py", "--json"],
    ["list", "parts", "--part", "part.py"],
    ["run", "evo/A", "--part", "part.py", "--runs", "1", "--generations", "0"],
]


@pytest.fixture(scope="module")
def warm_process(tmp_path_factory: pytest.TempPathFactory) -> Iterator[WarmProcess]:
    folder = tmp_path_factory.mktemp("warm") / "strangers"
    with start_warm_process(folder, NUMBA_DISABLE_JIT="1") as process:
        yield process


@pytest.mark.parametrize("seed", range(FIRST_SEED, FIRST_SEED + N_PARTS))
def test_a_faulty_part_ends_with_a_message(warm_process: WarmProcess, seed: int) -> None:
    choice = random.Random(seed)
    work = warm_process.folder / "work"
    shutil.rmtree(work)
    work.mkdir()
    content, is_error = write_part(choice)
    (work / "part.py").write_bytes(content)
    before = hash_files(work)
    command = choice.choice(COMMANDS)
    outcome = warm_process.run(*command)
    faults = find_faults(outcome)
    if is_error and outcome.status == "0":
        faults.append("status 0")
    if {name: hash for name, hash in hash_files(work).items() if name in before} != before:
        faults.append("the part is changed")
    assert not faults, f"seed {seed}: {content!r}\n{', '.join(faults)}\n{outcome.describe()}"
