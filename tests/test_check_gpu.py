"""Test the comparison of a GPU with the CPU: in Numba's simulator, and of the CPU with itself."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import pytest

from baldwinlab.models.miniworld.backends import cpu, cuda
from scripts import check_gpu
from tests.small_studies import make_small_study

ROOT = Path(__file__).parents[1]
SHORT_LIFE = {"lifetime": {"steps": 3}}


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


def test_a_damaged_byte_of_a_record_file_is_found(tmp_path: Path) -> None:
    study = make_small_study(tmp_path / "study").directory
    copy = shutil.copytree(study, tmp_path / "copy")
    assert check_gpu.list_different_files(study, copy) == ([], 6)
    path = copy / "runs/evo/A/0000.nc"
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)
    assert check_gpu.list_different_files(study, copy) == (["runs/evo/A/0000.nc"], 6)
    path.unlink()
    assert check_gpu.list_different_files(study, copy) == (["runs/evo/A/0000.nc"], 6)


def test_a_study_that_fails_or_does_not_end_is_reported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(tempfile, "mkdtemp", lambda prefix: str(tmp_path))
    results = [EOFError(), TimeoutError()]
    monkeypatch.setattr(check_gpu, "call_side_by_side", lambda *arguments: results)
    assert not check_gpu.compare_studies(check_gpu.FULL, 30)
    lines = capsys.readouterr().out.splitlines()
    assert lines[:2] == [
        "the study of the paper on cpu: failed",
        "the study of the paper on cuda: not finished after 30 s",
    ]
    assert lines[2].startswith("0 of 0 record files differ between cpu and cuda")


def test_calls_side_by_side_return_results_in_order_and_end_at_the_limit() -> None:
    assert check_gpu.call_side_by_side(divmod, [(7, 2), (9, 4)], 300) == [(3, 1), (2, 1)]
    (result,) = check_gpu.call_side_by_side(time.sleep, [(10**6,)], 0)
    assert isinstance(result, TimeoutError)
    (result,) = check_gpu.call_side_by_side(os._exit, [(1,)], 300)
    assert isinstance(result, EOFError)


def test_a_machine_without_a_gpu_gets_one_sentence(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(cuda, "unavailable_reason", lambda: "no GPU was found")
    assert check_gpu.main() == 1
    assert capsys.readouterr().out == "no GPU was found\n"


SIMULATION = """
from scripts import check_gpu

if __name__ == "__main__":
    short = {"lifetime": {"steps": 3}, "evolution": {"generations": 2}}
    kinds = ["no food", "memory"]
    check_gpu.main(check_gpu.Sizes(1, [1, 2], 1, 1, short, kinds, limits=[86_400] * 4))
"""


@pytest.mark.nightly
def test_all_steps_run_in_the_simulator(tmp_path: Path) -> None:
    simulator = {"NUMBA_ENABLE_CUDASIM": "1", "NUMBA_DISABLE_JIT": "1", "PYTHONPATH": str(ROOT)}
    # A process that is spawned imports the file.
    script = tmp_path / "simulation.py"
    script.write_text(SIMULATION, "utf-8")
    command = [sys.executable, "-W", "ignore::RuntimeWarning", script.name]
    process = subprocess.run(
        command, env=os.environ | simulator, cwd=tmp_path, capture_output=True, text=True
    )
    output = process.stdout
    assert process.returncode == 0, output + process.stderr
    assert "no food: bit-identical\nmemory: bit-identical\ncompare_kinds: " in output
    rates = re.findall(r"(.*): [\d.e+]+ agent-steps/s", output)
    assert [re.sub(r"JAX [\d.]+", "JAX", rate) for rate in rates] == [
        "evo/A, start of the paper, 1 worlds",
        "evo/A, start of the paper, 2 worlds",
        "evo+self-taught/A, start of the paper, 1 worlds",
        "evo+self-taught/A, start of the paper, 2 worlds",
        "JAX, evo/A, 1 worlds",
        "JAX, evo+self-taught/A, 1 worlds",
    ]
    assert "6 of 6 record files are byte-identical.\ncompare_studies: " in output
