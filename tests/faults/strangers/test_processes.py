"""Two processes work on one study at the same time: one can change its length or be killed."""

from __future__ import annotations

import random
import shutil
import signal
import time
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from baldwinlab.studies.open import open_runs
from tests.faults import amount
from tests.faults.strangers.oracle import FIRST_SEED
from tests.faults.test_kills import start_process

CONDITION = "evo/A"
N_PAIRS = amount(60, 4)
RUNS = 20
GENERATIONS = 4
TINY = ("--set", "population.size=4", "lifetime.steps=60", f"evolution.generations={GENERATIONS}")
CREATE = ("run", CONDITION, *TINY, "--runs", str(RUNS), "--out", "study")
EXTENSIONS = (
    ("run", "study", "--generations", "8"),
    ("run", "study", "--generations", "8", "--runs", "40"),
    ("run", "study", "--generations", "12"),
    ("run", "study", "--runs", "40"),
)
COMMANDS = (
    *EXTENSIONS,
    ("run", "study"),
    ("assay", "study", "--assays", "innate"),
    ("export", "study", "--out", "runs.csv", "--force"),
    ("status", "study"),
)


def run_to_end(command: tuple[str, ...], folder: Path) -> None:
    """Run a command in another process to its end."""
    folder.mkdir(exist_ok=True)
    process = start_process(command, folder, {})
    process.join()
    assert process.exitcode == 0, (folder / "output").read_text()


@pytest.fixture(scope="module")
def stored(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a finished study."""
    folder = tmp_path_factory.mktemp("stored")
    run_to_end(CREATE, folder)
    return folder / "study"


@pytest.fixture(scope="module")
def expected(stored: Path, tmp_path_factory: pytest.TempPathFactory) -> xr.Dataset:
    """The runs that one process simulates with the largest numbers of runs and generations."""
    folder = tmp_path_factory.mktemp("expected")
    shutil.copytree(stored, folder / "study")
    run_to_end(("run", "study", "--generations", "12", "--runs", "40"), folder)
    return open_runs(folder / "study").load()


def read_generations(study: Path) -> dict[int, int]:
    """Return the number of stored generations of each run."""
    data = open_runs(study)
    energy = data["energy"].sel(condition=CONDITION).isel(agent=0)
    counts = energy.count("generation").values.tolist()
    return dict(zip(data["run"].values.tolist(), counts, strict=True))


@pytest.mark.parametrize("seed", range(FIRST_SEED, FIRST_SEED + N_PAIRS))
def test_two_processes_lose_no_generation(
    stored: Path, expected: xr.Dataset, tmp_path: Path, seed: int
) -> None:
    choice = random.Random(seed)
    commands = [choice.choice(EXTENSIONS), choice.choice(COMMANDS)]
    seconds = choice.uniform(0, 0.4)
    killed = choice.choice([None, None, None, 0, 1])
    case = f"seed {seed}: {commands[0]}, after {seconds:.2f} s {commands[1]}, killed: {killed}"
    study = Path(shutil.copytree(stored, tmp_path / "stored"))
    # Each process has a folder for its output.
    folders = [tmp_path / "first", tmp_path / "second"]
    processes = []
    for command, folder in zip(commands, folders, strict=True):
        folder.mkdir()
        (folder / "study").symlink_to(study)
        processes.append(start_process(command, folder, {}))
        time.sleep(seconds)
    if killed is not None:
        time.sleep(choice.uniform(0, 0.4))
        processes[killed].kill()
    for number, process in enumerate(processes):
        process.join()
        file = folders[number] / "output"
        output = file.read_text() if file.exists() else ""
        allowed = (0, 2, -signal.SIGKILL) if number == killed else (0, 2)
        assert process.exitcode in allowed, f"{case}\n{output}"
        assert "Traceback" not in output, f"{case}\n{output}"
        assert "damaged" not in output, f"{case}\n{output}"
    assert killed is not None or any(process.exitcode == 0 for process in processes), case
    assert min(read_generations(study).values()) >= GENERATIONS, case
    run_to_end(("run", "study"), folders[0])
    data = open_runs(study).load()
    assert {*read_generations(study).values()} == {data.sizes["generation"]}, case
    in_one_process = expected.sel(run=data["run"], generation=data["generation"])
    np.testing.assert_array_equal(data["energy"], in_one_process["energy"], case)
