"""Test the comparison of a GPU with the CPU: in Numba's simulator, and of the CPU with itself."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from baldwinlab.models.miniworld.backends import cpu, cuda
from scripts import check_gpu

ROOT = Path(__file__).parents[1]
SHORT_LIFE = {"lifetime": {"steps": 3}}
SHORT_STUDY = {"lifetime.steps": 3, "evolution.generations": 2}


class DamagedBatch(cpu.CpuBatch):
    def simulate(self, first_step: int, last_step: int) -> None:
        super().simulate(first_step, last_step)
        self.state.positions[0, 0] += 1


class FailingBatch(cpu.CpuBatch):
    def simulate(self, first_step: int, last_step: int) -> None:
        raise OSError("the driver is gone")


@pytest.mark.parametrize(
    ("batch", "remark"),
    [
        (cpu.CpuBatch, ""),
        (DamagedBatch, "differs in positions"),
        (FailingBatch, "fails with OSError: the driver is gone"),
    ],
)
def test_a_different_array_and_a_failure_are_reported(
    batch: Any, remark: str, monkeypatch: pytest.MonkeyPatch, in_plain_python: None
) -> None:
    monkeypatch.setattr(cuda, "CudaBatch", batch)
    assert check_gpu.compare_kind("no food", 1, SHORT_LIFE) == remark


def test_a_damaged_byte_of_a_record_file_is_found(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert check_gpu.compare_studies(tmp_path, ("cpu", "cpu"), runs=1, set=SHORT_STUDY)
    assert "6 of 6 record files are byte-identical." in capsys.readouterr().out
    study, copy = tmp_path / "0-cpu", tmp_path / "1-cpu"
    path = copy / "runs/evo/A/0000.nc"
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)
    assert check_gpu.list_different_files(study, copy) == (["runs/evo/A/0000.nc"], 6)
    path.unlink()
    assert check_gpu.list_different_files(study, copy) == (["runs/evo/A/0000.nc"], 6)


def test_a_machine_without_a_gpu_gets_one_sentence(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(cuda, "unavailable_reason", lambda: "no GPU was found")
    assert check_gpu.main() == 1
    assert capsys.readouterr().out == "no GPU was found\n"


SIMULATION = """
from scripts import check_gpu

if __name__ == "__main__":
    assert check_gpu.compare_kinds(["no food", "memory"], 1, {"lifetime": {"steps": 3}})
"""


@pytest.mark.nightly
def test_kinds_of_experiments_are_compared_in_the_simulator(tmp_path: Path) -> None:
    simulator = {"NUMBA_ENABLE_CUDASIM": "1", "NUMBA_DISABLE_JIT": "1", "PYTHONPATH": str(ROOT)}
    # A process that is spawned imports the file.
    script = tmp_path / "simulation.py"
    script.write_text(SIMULATION, "utf-8")
    command = [sys.executable, "-W", "ignore::RuntimeWarning", script.name]
    output = subprocess.run(
        command, env=os.environ | simulator, cwd=tmp_path, check=True, capture_output=True
    ).stdout.decode()
    assert output == "no food: bit-identical\nmemory: bit-identical\n"
