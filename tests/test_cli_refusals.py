"""The command line refuses in one clear sentence, with a non-zero exit."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from tests.commands import Command
from tests.small import contents, small_study


@pytest.fixture(scope="module")
def stored(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A study with one run of each condition."""
    return small_study(tmp_path_factory.mktemp("stored"), runs=1).directory


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["run", "evo/C"], "there is no map 'C'"),
        (["run", "nothing.toml"], "cannot read nothing.toml: No such file or directory"),
        (["run", "evo/A", "--set", "lifetime.steps=0"], "lifetime.steps = 0: input should be greater than or equal to 1"),
        (["run", "evo/A", "--set", "speed=3"], "speed: there is no 'speed' here; there are: name, model, world"),
        (["run", "evo/A", "--runs", "0"], "--runs 0 must be at least 1"),
        (["run", "evo/A", "--workers", "-2"], "--workers -2 must be at least 1"),
        (["run", "evo/A", "--seed", "-1"], "--seed -1 must be at least 0 and less than 2147483648"),
        (["reproduce", "--reading", "sloppy"], "there is no reading 'sloppy'"),
        (["reproduce", "--generations", "0"], "evolution.generations = 0"),
        (["report", "study", "--last", "0"], "--last 0 must be at least 1"),
        (["report", "nowhere"], "nowhere holds no study"),
        (
            ["replay", "nowhere", "--condition", "evo/A", "--run", "0", "--generation", "0", "--out", "x.nc"],
            "nowhere holds no study",
        ),
        (
            ["replay", "x", "--condition", "evo/A", "--run", "0", "--generation", "0", "--out", "x.avi"],
            "must end in .nc, .mp4, .gif or .png",
        ),
        (
            ["replay", "study", "--condition", "evo/B", "--run", "0", "--generation", "0", "--out", "x.nc"],
            "has no condition 'evo/B'",
        ),
        (
            ["replay", "study", "--condition", "evo/A", "--run", "7", "--generation", "0", "--out", "x.nc"],
            "0007.nc does not exist; runs of evo/A that are stored: 1",
        ),
        (
            ["replay", "study", "--condition", "evo/A", "--run", "0", "--generation", "9", "--out", "x.nc"],
            "generation = 9 must be",
        ),
        (["replay", "study", "--condition", "evo/A", "--run", "0", "--generation", "0", "--out", "no/x.gif"], "no/x.gif"),
        (["assay", "nowhere"], "nowhere holds no study"),
        (
            ["assay", "study", "--only", "innate,instinct"],
            "there is no assay 'instinct'; there are innate, neutral",
        ),
        (["assay", "study", "--workers", "0"], "--workers 0 must be at least 1"),
        (["phylogeny", "study", "--condition", "evo/B", "--run", "0", "--out", "x.csv"], "has no condition 'evo/B'"),
        (["phylogeny", "study", "--condition", "evo/A", "--run", "7", "--out", "x.csv"], "0007.nc does not exist"),
        (["phylogeny", "study", "--condition", "evo/A", "--run", "0", "--out", "no/x.csv"], "there is no folder no"),
        (["run", "evo/A", "--out", "study"], "study holds another study"),
        (["run", "evo/A", "--runs", "many"], "many"),
        (["run", "evo/A", "--set", "learning.teacher=shuffled"], 'learning.teacher: does nothing with learning.rule = "none"'),
        (["assay", "innate", "mine"], "'mine' is too much; write: baldwinlab assay DIRECTORY [--only ONLY] [--workers WORKERS]"),
        (["assay", "study", "--executor", "cloud"], "--executor cloud must be threads, dask:tcp://HOST:PORT or slurm"),
        (["run", "evo/A", "--seed", "1.5"], "--seed: '1.5' must be a whole number"),
        (
            ["replay", "study", "--condition", "evo/A", "--run", "0.6", "--generation", "0", "--out", "x.nc"],
            "'0.6' must be",
        ),
        (["report", "study", "--last", "99999999999999999999"], "must be a whole number of at most 18 digits"),
        (["lab", "study", "--port", "0x10"], "--port: '0x10' must be a whole number"),
        (["report", "study", "--out", "study/study.toml"], "--out study/study.toml belongs to the study in"),
        (
            ["phylogeny", "study", "--condition", "evo/A", "--run", "0", "--out", "study/runs/evo/A/0000.nc"],
            "belongs to the study",
        ),
        (["report"], "requires an argument"),
        (["run", "evo/A", "--part", "nothing.py"], "cannot read the part nothing.py: No such file or directory"),
        (["report", "study", "--lats", "3"], "Unknown option: --lats. Did you mean --last?"),
        (["rum"], "there is no command 'rum' (did you mean 'run'?); there are assay, bench, check, lab"),
    ],
)
def test_bad_input_gets_one_clear_sentence_and_a_non_zero_exit(
    command: Command, tmp_path: Path, stored: Path, arguments: list[str], sentence: str
) -> None:
    shutil.copytree(stored, tmp_path / "study")
    before = contents(tmp_path)
    done = command(*arguments)
    assert done.code != 0
    assert sentence in done.err + done.out
    assert "Traceback" not in done.err
    assert len(done.err.strip().splitlines()) == 1
    assert contents(tmp_path) == before


def test_a_study_with_nothing_in_it_has_no_report_yet(command: Command, tmp_path: Path) -> None:
    study = small_study(tmp_path / "study", runs=1)
    for condition in study.experiments:
        study.path(condition, 0).unlink()
    done = command("report", "study")
    assert done.code != 0
    assert "holds no finished run yet" in done.err
