"""Genome files keep genomes, their layout and their origin, and refuse what does not fit."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import baldwinlab as bl
from baldwinlab.core.errors import PartError, RefusedError
from baldwinlab.evolution import GenerationKey, require_founders
from baldwinlab.evolution.genome_file import (
    decode_genomes,
    describe_layout,
    encode_genomes,
    read_genomes,
)
from baldwinlab.experiment import BaseExperiment, ExperimentError
from tests.evolution.single_runs import draw_genomes, make_founders

EXPERIMENT = bl.load("evo/A").replace(population={"size": 8})
KEY = GenerationKey(1, 0, 0)


def draw_runs(experiment: BaseExperiment = EXPERIMENT, runs: int = 2) -> np.ndarray:
    return np.stack([draw_genomes(experiment, GenerationKey(7, run, 0)) for run in range(runs)])


def write_file(path: Path, experiment: BaseExperiment = EXPERIMENT, runs: int = 2) -> Path:
    path.write_bytes(encode_genomes(draw_runs(experiment, runs), experiment, {"seed": 7}))
    return path


def add_files(
    *files: tuple[Path, float], experiment: BaseExperiment = EXPERIMENT
) -> BaseExperiment:
    founders = [{"path": str(path), "share": share} for path, share in files]
    return experiment.replace(evolution={"founders": founders})


def test_a_genome_file_returns_the_genomes_and_their_layout() -> None:
    content = encode_genomes(draw_runs(), EXPERIMENT, {"seed": 7})
    stored = decode_genomes(content, "file.nc")
    np.testing.assert_array_equal(stored.genome, draw_runs())
    assert stored.layout == describe_layout(EXPERIMENT)
    assert content == encode_genomes(draw_runs(), EXPERIMENT, {"seed": 7})


@pytest.mark.parametrize(
    ("stored_runs", "population_of_run"), [(2, {0: 0, 1: 1}), (1, {0: 0, 5: 0})]
)
def test_founders_are_the_population_of_the_run_or_of_the_only_run(
    tmp_path: Path, stored_runs: int, population_of_run: dict[int, int]
) -> None:
    experiment = add_files((write_file(tmp_path / "a.nc", runs=stored_runs), 1))
    for run, population in population_of_run.items():
        founders = make_founders(experiment, KEY._replace(run=run))
        np.testing.assert_array_equal(founders, draw_runs(runs=stored_runs)[population])


def test_a_mixture_has_the_stated_shares_and_no_genome_twice(tmp_path: Path) -> None:
    first = write_file(tmp_path / "first.nc")
    second = tmp_path / "second.npy"
    np.save(second, draw_runs() + 10)
    founders = make_founders(add_files((first, 0.25), (second, 0.75)), KEY)
    is_second = founders[:, 0, 0] > 5
    assert is_second.tolist() == [False] * 2 + [True] * 6
    assert len(np.unique(founders[:, 0, 0])) == 8


def test_an_array_of_agents_with_all_weights_in_a_row_founds_a_population(tmp_path: Path) -> None:
    experiment = bl.load("evo+self-taught/A").replace(population={"size": 8})
    genomes = draw_runs(experiment, 1)[0]
    np.save(tmp_path / "a.npy", genomes.reshape(8, -1))
    founders = make_founders(add_files((tmp_path / "a.npy", 1), experiment=experiment), KEY)
    np.testing.assert_array_equal(founders, genomes)


def test_a_small_file_founds_a_larger_population(tmp_path: Path) -> None:
    path = write_file(tmp_path / "small.nc")
    founders = make_founders(add_files((path, 1), experiment=bl.load("evo/A")), KEY)
    assert founders.shape[0] == 20
    _, counts = np.unique(founders[:, 0, 0], return_counts=True)
    assert sorted(counts.tolist()) == [2] * 4 + [3] * 4


@pytest.mark.parametrize(
    ("name", "content", "condition", "message"),
    [
        ("a.nc", EXPERIMENT, "evo+self-taught/A", r"do not fit evo\+self-taught/A: their modules"),
        ("a.npy", np.zeros((8, 1, 3)), "evo/A", "1 x 3 modules and genes, and evo/A has 1 x 60"),
        ("a.nc", b"no genomes", "evo/A", "is no genome file"),
        ("a.npy", b"no genomes", "evo/A", "is no genome file"),
    ],
)
def test_a_file_with_other_content_is_refused_with_the_difference(
    tmp_path: Path, name: str, content: Any, condition: str, message: str
) -> None:
    path = tmp_path / name
    if isinstance(content, bytes):
        path.write_bytes(content)
    elif isinstance(content, np.ndarray):
        np.save(path, content)
    else:
        write_file(path, content)
    with pytest.raises(RefusedError, match=message):
        require_founders(add_files((path, 1), experiment=bl.load(condition)), 1)


@pytest.mark.parametrize("shape", [(10**12,), (10**6, 10**9), (200,), (10**400,)])
def test_a_header_that_declares_more_than_the_file_is_refused_before_it_is_read(
    monkeypatch: pytest.MonkeyPatch, shape: tuple[int, ...]
) -> None:
    file = io.BytesIO()
    header = {"descr": "<f4", "fortran_order": False, "shape": shape}
    np.lib.format.write_array_header_1_0(file, header)
    file.write(bytes(200))
    monkeypatch.setattr(np, "load", lambda *_, **__: pytest.fail("The array is not read."))
    message = r"short\.npy is no genome file: its header declares [\d,]+ bytes, and the file has "
    with pytest.raises(RefusedError, match=message):
        decode_genomes(file.getvalue(), "short.npy")


@pytest.mark.parametrize("header", [b"{'descr': (", b"[" * 5000, b"{1: 2, 'a': 3}", b"9" * 5000])
def test_an_invalid_header_is_refused(header: bytes) -> None:
    content = b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header
    with pytest.raises(RefusedError, match=r"a\.npy is no genome file: "):
        decode_genomes(content, "a.npy")


def test_too_few_runs_are_refused(tmp_path: Path) -> None:
    experiment = add_files((write_file(tmp_path / "two.nc"), 1))
    require_founders(experiment, 2)
    with pytest.raises(RefusedError, match="has the genomes of 2 runs, and 3 runs of evo/A"):
        require_founders(experiment, 3)


def test_a_changed_file_is_refused(tmp_path: Path) -> None:
    path = write_file(tmp_path / "two.nc")
    experiment = add_files((path, 1))
    write_file(path, runs=1)
    with pytest.raises(PartError, match="has changed since the experiment was made"):
        read_genomes(experiment.evolution.founders[0])


def test_a_gene_that_is_not_finite_is_refused(tmp_path: Path) -> None:
    genomes = draw_runs()
    genomes[0, 3, 0, 2] = np.nan
    np.save(tmp_path / "a.npy", genomes)
    with pytest.raises(RefusedError, match=r"evolution.founders = '.*a.npy' left gene 2 "):
        make_founders(add_files((tmp_path / "a.npy", 1)), KEY)


def test_shares_that_do_not_add_up_are_refused(tmp_path: Path) -> None:
    path = write_file(tmp_path / "two.nc")
    with pytest.raises(ExperimentError, match="the shares must add up to 1"):
        add_files((path, 0.5), (path, 0.4))
