"""Two processes work on one study at the same time, and one of them can change its length."""

from __future__ import annotations

import random
import shutil
import time
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from baldwinlab.studies.open import open_runs
from tests.faults import amount
from tests.faults.test_kills import start_process

CONDITION = "evo/A"
SEED = 67
RUNS = 20
GENERATIONS = 4
TINY = ("--set", "population.size=4", "lifetime.steps=60", f"evolution.generations={GENERATIONS}")
CREATE = ("run", CONDITION, *TINY, "--runs", str(RUNS), "--out", "study")
COMMANDS = (
    ("run", "study", "--generations", "8"),
    ("run", "study", "--generations", "8", "--runs", "40"),
    ("run", "study", "--generations", "12"),
    ("run", "study", "--runs", "40"),
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


def test_pairs_of_processes_lose_no_generation(
    stored: Path, expected: xr.Dataset, tmp_path: Path
) -> None:
    numbers = random.Random(SEED)
    for number in range(amount(50, 4)):
        first, second = numbers.choices(COMMANDS[:4], k=1) + numbers.choices(COMMANDS, k=1)
        seconds = numbers.uniform(0, 0.4)
        case = f"pair {number} of seed {SEED}: {first}, after {seconds:.2f} s {second}"
        folders = [tmp_path / f"{number}-{name}" for name in ("first", "second")]
        for folder in folders:
            folder.mkdir()
        study = Path(shutil.copytree(stored, tmp_path / str(number)))
        for folder in folders:
            (folder / "study").symlink_to(study)
        processes = [start_process(first, folders[0], {})]
        time.sleep(seconds)
        processes.append(start_process(second, folders[1], {}))
        for process, folder in zip(processes, folders, strict=True):
            process.join()
            output = (folder / "output").read_text()
            assert process.exitcode in (0, 2), f"{case}\n{output}"
            assert "Traceback" not in output, f"{case}\n{output}"
            assert "damaged" not in output, f"{case}\n{output}"
        assert any(process.exitcode == 0 for process in processes), case
        generations = read_generations(study)
        assert min(generations.values()) >= GENERATIONS, case
        run_to_end(("run", "study"), folders[0])
        data = open_runs(study).load()
        assert {*read_generations(study).values()} == {data.sizes["generation"]}, case
        in_one_process = expected.sel(run=data["run"], generation=data["generation"])
        np.testing.assert_array_equal(data["energy"], in_one_process["energy"], case)
