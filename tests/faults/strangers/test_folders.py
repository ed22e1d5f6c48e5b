"""No command hangs, fails with a traceback or writes elsewhere, whatever a study contains."""

from __future__ import annotations

import os
import random
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.faults import amount
from tests.faults.strangers.folders import make_hostile
from tests.faults.strangers.oracle import (
    FIRST_SEED,
    WarmProcess,
    find_faults,
    find_losses,
    hash_files,
    start_warm_process,
)
from tests.small_studies import make_small_study, shorten_preset

pytestmark = pytest.mark.skipif(os.name == "nt", reason="Windows has no FIFOs, sockets and forks")

N_FOLDERS = amount(500, 10)
N_COMMANDS = amount(3, 2)
SETTINGS = {
    "population": {"size": 4},
    "lifetime": {"steps": 60},
    "evolution": {"generations": 3},
}
# Starts of the names of the files that commands write beside the study.
OUTPUTS = ("table.", "data.", "life.", "agents.")
LIFE = ["--run", "0", "--generation", "0"]
COMMANDS = [
    ["status", "study"],
    ["status", "study", "--json"],
    ["report", "study"],
    ["report", "study", "--json"],
    ["run", "study"],
    ["run", "study", "--runs", "3"],
    ["assay", "study", "innate"],
    ["export", "study", "--out", "table.csv"],
    ["export", "study", "--out", "data.parquet"],
    ["replay", "study", "--condition", "evo/A", *LIFE, "--out", "life.png"],
    ["freeze", "study:evo/A@2", "--out", "agents.nc"],
    ["show", "study/runs/evo/A/experiment.toml"],
    ["lab", "."],
]


@pytest.fixture(scope="module")
def sound_study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    experiments = [
        shorten_preset(name).replace(**SETTINGS) for name in ("evo/A", "evo+self-taught/A")
    ]
    return make_small_study(
        tmp_path_factory.mktemp("sound") / "study", experiments, runs=2
    ).directory


@pytest.fixture(scope="module")
def warm_process(tmp_path_factory: pytest.TempPathFactory) -> Iterator[WarmProcess]:
    with start_warm_process(tmp_path_factory.mktemp("warm") / "strangers") as process:
        yield process


@pytest.mark.parametrize("seed", range(FIRST_SEED, FIRST_SEED + N_FOLDERS))
def test_a_hostile_folder_harms_nobody(
    warm_process: WarmProcess, sound_study: Path, seed: int
) -> None:
    choice = random.Random(seed)
    work = warm_process.folder / "work"
    shutil.rmtree(work)
    for name in ("study", "neighbor"):
        shutil.copytree(sound_study, work / name)
    case = make_hostile(work / "study", choice)
    before = hash_files(warm_process.folder, "output")
    for command in choice.sample(COMMANDS, N_COMMANDS):
        inside = hash_files(work / "study")
        outcome = warm_process.run(*command)
        faults = find_faults(outcome)
        faults += find_losses(inside, hash_files(work / "study"), outcome)
        after = hash_files(warm_process.folder, "output")
        faults += [
            f"{name} is changed, outside of the study"
            for name in sorted(before | after)
            if before.get(name) != after.get(name) and not is_output(name)
        ]
        assert not faults, f"seed {seed}: {case}\n{', '.join(faults)}\n{outcome.describe()}"


def is_output(name: str) -> bool:
    """Return whether a file is in the study, or is one that the commands write beside it."""
    return name.startswith(("work/study/", *(f"work/{output}" for output in OUTPUTS)))
