"""The command line does what it says."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from PIL import Image

import baldwinlab as bl
from baldwinlab.experiment.toml import to_toml
from baldwinlab.papers.presets import KINDS, load, names
from baldwinlab.studies.assays.results import open_assay
from baldwinlab.studies.open import open_runs
from baldwinlab.studies.sweeps.design import open_sweep
from tests.commands import Command
from tests.small_studies import make_small_study, read_records, shorten_preset

TINY = ["--runs", "2", "--generations", "3", "--steps", "60"]


@pytest.fixture(scope="module")
def stored(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A study with one run of each condition."""
    return make_small_study(tmp_path_factory.mktemp("stored"), runs=1).directory


def test_presets_lists_every_preset_with_a_line(command: Command) -> None:
    done = command("list", "presets")
    assert done.code == 0
    for kind in KINDS:
        for name in names(kind):
            assert any(
                line.split()[:1] == [name] and len(line.split()) > 3
                for line in done.out.splitlines()
            )


def test_show_prints_an_experiment_that_can_be_edited_and_run(
    command: Command, tmp_path: Path
) -> None:
    done = command("show", "evo/B", "--set", "lifetime.steps=50", "evolution.generations=2")
    (tmp_path / "mine.toml").write_text(done.out)
    changes = {"lifetime": {"steps": 50}, "evolution": {"generations": 2}}
    assert load(tmp_path / "mine.toml") == load("evo/B").replace(name="mine", **changes)
    done = command("run", "mine.toml", "--runs", "2", "--seed", "4")
    assert done.code == 0
    assert dict(open_runs("results/mine").food_eaten.sizes) == {
        "condition": 1,
        "run": 2,
        "generation": 2,
        "agent": 20,
    }


def test_several_experiments_are_run_as_one_study(command: Command) -> None:
    cut = ("--set", "lifetime.steps=20", "evolution.generations=2", "--runs", "2")
    done = command("run", "evo/B", "evo+drift/B", "evo+self-taught/B", *cut)
    assert done.code == 0, done.err
    study = open_runs("results/evo-B-evo+drift-B-evo+self-taught-B")
    assert study.condition.values.tolist() == ["evo/B", "evo+drift/B", "evo+self-taught/B"]
    assert command("run", "evo/B", "evo/B", *cut).err == (
        "baldwinlab: two conditions have the same name, 'evo/B': change name in one of them\n"
    )


def test_conditions_of_ones_own_are_an_ordinary_study_whatever_their_names(
    command: Command, tmp_path: Path
) -> None:
    for name in ("rank/A", "biases/A"):
        path = tmp_path / f"{name[:4]}.toml"
        path.write_text(
            to_toml(
                load("evo/A").replace(
                    name=name, lifetime={"steps": 60}, evolution={"generations": 2}
                )
            )
        )
    assert command("run", "rank.toml", "bias.toml", "--runs", "2", "--out", "mine").code == 0
    done = command("report", "mine")
    assert done.code == 0, done.err
    page = (tmp_path / "mine/report.html").read_text()
    assert (
        "Evolution and lifetime learning: rank/A, biases/A" in page
        and "Comparison of the conditions" in page
    )
    assert not (tmp_path / "mine/multiverse.json").exists()


def test_a_preset_and_an_experiment_of_ones_own_are_compared(
    command: Command, tmp_path: Path
) -> None:
    """In the terminal, the report, the table and Python alike."""
    cut = (
        "--set",
        "lifetime.steps=60",
        "evolution.generations=2",
        "world.start.x=400",
        "world.start.y=160",
    )
    (tmp_path / "short.toml").write_text(
        command("show", "evo/A", "--set", "senses.visual_radius=20").out
    )
    done = command("run", "evo/A", "short.toml", *cut, "--runs", "4", "--out", "pair")
    assert done.code == 0, done.err
    needed = "With 4 runs and 2 tests, the smallest corrected p-value is 0.057. At least 5 runs are needed."
    before, after = done.out.split("Comparison of the conditions")
    assert needed in before and needed in after
    assert (
        "short against evo/A, average agent" in after
        and "Each condition is compared with evo/A." in after
    )
    reported = command("report", "pair", "--baseline", "short")
    assert "evo/A against short, best agent" in reported.out and needed in reported.out
    rows = pd.read_csv(tmp_path / "pair/statistics.csv", keep_default_na=False)
    expected = bl.open_study(tmp_path / "pair").compare("short")
    pd.testing.assert_frame_equal(
        rows.drop(columns="claim"), expected[rows.columns[1:]], check_dtype=False
    )
    assert "too few runs" in (tmp_path / "pair/report.html").read_text()
    assert json.loads((tmp_path / "pair/claims.json").read_text())["claims"] == []
    claimed = command("report", "pair", "--paper", "le-2019")
    assert (
        claimed.code == 0
        and len(json.loads((tmp_path / "pair/claims.json").read_text())["claims"]) == 9
    )


def test_a_baseline_that_the_study_has_not_is_refused_before_the_runs(
    command: Command, tmp_path: Path
) -> None:
    done = command("run", "evo/A", "evo+drift/A", "--baseline", "evo+drft/A", "--out", "pair")
    assert (
        done.code == 2
        and "--baseline evo+drft/A is not a condition of the study (did you mean 'evo+drift/A'?)"
        in done.err
    )
    assert not (tmp_path / "pair").exists()


def test_claims_need_a_paper_or_a_file(command: Command, tmp_path: Path) -> None:
    make_small_study(tmp_path / "study", runs=1)
    assert (
        "study was made by no paper. Give claims by --claims FILE or --paper NAME."
        in command("claims", "study").err
    )
    assert "The claims of le-2019" in command("claims", "study", "--paper", "le-2019").out


def test_set_may_be_given_once_for_all_or_once_for_each(command: Command) -> None:
    once = command("show", "evo/A", "--set", "lifetime.steps=5", "population.size=3")
    each = command("show", "evo/A", "--set", "lifetime.steps=5", "--set", "population.size=3")
    assert once.out == each.out
    assert "size = 3" in once.out


def test_a_part_of_ones_own_is_given_as_a_file(command: Command) -> None:
    part = str(Path(__file__).parents[2] / "examples" / "parts" / "social.py")
    chosen = ("--set", "learning.rule=social", "learning.social.least=3")
    assert "[learning.social]\nleast = 3 #" in command("show", "evo/A", "--part", part, *chosen).out


@pytest.mark.nightly  # README has a smaller one, which the quick suite runs
def test_reproduce_runs_the_paper_and_leaves_claims_statistics_figures_and_report(
    command: Command, tmp_path: Path
) -> None:
    done = command("reproduce", *TINY, "--out", "small")
    assert done.code == 0, done.err
    for number in range(1, 10):
        assert f"C{number}" in done.out
    first, then = (
        part.strip() for part in done.out.split("report: small/report.html")[:2]
    )  # before the assays, and with them
    assert "assays to do" not in first
    assert then.startswith("The report lacks the assays. They run now; then it is written again.")
    assert "assays to do" in then and done.out.count("report: ") == 2
    claims = json.loads((tmp_path / "small/claims.json").read_text())["claims"]
    assert [claim["id"] for claim in claims] == [f"C{number}" for number in range(1, 10)]
    fields = {
        "id",
        "condition",
        "comparison",
        "effect",
        "interval",
        "p",
        "p_holm",
        "a12",
        "verdict",
        "paper",
    }
    assert all(fields <= set(claim) for claim in claims)
    assert (tmp_path / "small/statistics.csv").read_text().count("\n") > 15
    assert {path.suffix for path in (tmp_path / "small/figures").iterdir()} == {
        ".svg",
        ".png",
        ".csv",
    }
    assert "<html" in (tmp_path / "small/report.html").read_text()
    again = command("reproduce", *TINY, "--out", "small")
    assert "all 12 runs are already stored" in again.out
    assert again.out.count("report: ") == 1  # there is nothing to wait for


@pytest.mark.nightly  # which draws all figures, as the test before it does
def test_reproduce_takes_a_variant_and_keeps_it_apart(command: Command, tmp_path: Path) -> None:
    done = command(
        "reproduce",
        "--runs",
        "1",
        "--generations",
        "1",
        "--steps",
        "10",
        "--variant",
        "literal",
        "--workers",
        "1",
    )
    assert done.code == 0, done.err
    (study,) = (tmp_path / "results").iterdir()
    assert study.name == "paper-literal-generations1-steps10"
    assert "visual_radius = 4.0" in (study / "runs/evo/A/experiment.toml").read_text()


def test_report_is_rebuilt_from_stored_results_alone(command: Command, tmp_path: Path) -> None:
    make_small_study(tmp_path / "study")
    done = command("report", "study", "--out", "elsewhere.html")
    assert done.code == 0, done.err
    assert (tmp_path / "elsewhere.html").exists()
    assert (tmp_path / "study/claims.json").exists()


SWEEP = """
experiment = "evo/A"
runs = 2
[set]
lifetime.steps = 60
evolution.generations = 2
[fields]
world.food.0.count = [0, 50]
"""


def test_a_sweep_is_run_reported_and_carried_on(command: Command, tmp_path: Path) -> None:
    (tmp_path / "food.toml").write_text(SWEEP)
    done = command("sweep", "food.toml")
    assert done.code == 0, done.err
    assert "report: results/food/report.html" in done.out
    study = tmp_path / "results/food"
    assert dict(open_sweep(study).energy.sizes) == {
        "world.food.0.count": 2,
        "run": 2,
        "generation": 2,
        "agent": 20,
    }
    rows = (study / "responses.csv").read_text().splitlines()
    assert rows[1:4] == [
        "0,0,best,2,0.0,0.0,0.0",
        "0,0,mean,2,0.0,0.0,0.0",
        "0,0,share,2,0.0,0.0,0.0",
    ]
    (study / "report.html").unlink()
    assert command("report", "results/food").code == 0
    assert "sweep of world.food.0.count" in (study / "report.html").read_text()
    (tmp_path / "food.toml").write_text(SWEEP.replace("runs = 2", "runs = 3"))
    assert "4 of 6 runs stored, 2 to do" in command("sweep", "food.toml", "--workers", "1").out


def test_a_sweep_that_cannot_be_is_refused_before_anything_is_written(
    command: Command, tmp_path: Path
) -> None:
    (tmp_path / "food.toml").write_text(SWEEP.replace("[0, 50]", "[0, -50]"))
    done = command("sweep", "food.toml", "--out", "swept")
    assert done.code == 2
    assert done.err == (
        "baldwinlab: food.toml: point-0001: world.food.0.count = -50: input should be greater than or equal to 0\n"
    )
    assert not (tmp_path / "swept").exists()
    assert (
        "cannot read nothing.toml: No such file or directory"
        in command("sweep", "nothing.toml").err
    )


def test_replay_writes_a_trace_a_movie_or_a_picture(
    command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("baldwinlab.analysis.movie.MAX_DURATION", 1)  # second
    study = make_small_study(tmp_path / "study")
    for name in ("life.nc", "life.gif", "life.mp4", "life.png"):
        done = command(
            "replay",
            "study",
            "--condition",
            "evo+self-taught/A",
            "--run",
            "1",
            "--generation",
            "2",
            "--out",
            name,
        )
        assert done.code == 0, done.err
        assert (tmp_path / name).stat().st_size > 1000
    with xr.open_dataset(tmp_path / "life.nc") as trace:
        assert np.array_equal(
            trace.eaten.sum("step"), study.read("evo+self-taught/A", 1).food_eaten[2]
        )
    with Image.open(tmp_path / "life.png") as picture:
        assert min(picture.size) > 500


def test_replay_takes_the_only_condition_and_lists_them_where_there_are_several(
    command: Command, tmp_path: Path
) -> None:
    make_small_study(tmp_path / "two")
    make_small_study(tmp_path / "one", [shorten_preset("evo/A")], runs=1)
    life = ("--run", "0", "--generation", "1", "--out", "life.nc")
    assert command("replay", "one", *life).code == 0 and (tmp_path / "life.nc").exists()
    done = command("replay", "two", *life)
    assert done.code == 2 and "two: condition is missing; there are evo/A" in done.err


def test_assay_measures_a_study_once_and_rebuilds_its_report(
    command: Command, stored: Path, tmp_path: Path
) -> None:
    shutil.copytree(stored, tmp_path / "study")
    done = command("assay", "study", "--assays", "descent,modules", "--workers", "2")
    assert done.code == 0, done.err
    assert (
        "3 assays to do (24,000 agent-steps)" in done.out
    )  # 4 pairs of modules of 20 learners who live 300 steps
    assert (tmp_path / "study/report.html").exists()
    assert open_assay("study", "modules", "evo+self-taught/A").energy.dims == (
        "run",
        "modules",
        "agent",
    )
    again = command("assay", "study", "--assays", "descent")
    assert "all assays are already stored" in again.out


def test_assays_that_are_stopped_say_how_far_they_came_and_carry_on(
    command: Command, stored: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copytree(stored, tmp_path / "study")

    @contextmanager
    def stopped_at_once(description: str, total: int) -> Iterator[Callable[[int], None]]:
        def stop(amount: int) -> None:
            raise KeyboardInterrupt

        yield stop

    with monkeypatch.context() as patched:
        patched.setattr("baldwinlab.core.console.progress", stopped_at_once)
        done = command("assay", "study", "--assays", "reaction")
    assert done.code == 130
    assert (
        "Interrupted. 0 of 2 assays are stored in study. Repeat the command to continue."
        in done.err
    )
    assert "2 assays to do" in command("assay", "study", "--assays", "reaction").out


def test_phylogeny_writes_who_begot_whom(command: Command, stored: Path) -> None:
    run = ("--condition", "evo/A", "--run", "0", "--out", "descent.csv")
    done = command("export", str(stored), "--format", "phylogeny", *run)
    assert done.code == 0, done.err
    lines = Path("descent.csv").read_text(encoding="utf-8").splitlines()
    assert lines[:2] == ["id,ancestor_list,origin_time,destruction_time", '0,"[none]",0,1']
    assert len(lines) == 1 + 3 * 20


def test_ctrl_c_says_what_is_stored_and_the_same_command_carries_on(tmp_path: Path) -> None:
    words = [
        sys.executable,
        "-m",
        "baldwinlab",
        "run",
        "evo+self-taught/A",
        "--runs",
        "24",
        "--out",
        "study",
    ]
    words += ["--set", "evolution.generations=4", "--set", "lifetime.steps=2000"]
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])}
    process = subprocess.Popen(
        words,
        cwd=tmp_path,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    while process.poll() is None and not read_records(tmp_path):
        time.sleep(0.005)
    process.send_signal(signal.SIGINT)
    _, err = process.communicate()
    assert process.returncode == 130
    stored = len(read_records(tmp_path))
    assert 0 < stored < 24
    assert (
        f"Interrupted. {stored} of 24 runs are stored in study. Repeat the command to continue."
        in err
    )
    assert "Traceback" not in err
    again = subprocess.run(
        words, cwd=tmp_path, env=environment, capture_output=True, text=True, check=True
    )
    assert f"{stored} of 24 runs stored" in again.stdout
    assert len(read_records(tmp_path)) == 24


def test_settings_of_matplotlib_in_the_working_directory_are_not_read(tmp_path: Path) -> None:
    (tmp_path / "matplotlibrc").write_bytes(b"lines.linewidth: 77\nnonsense: \xff\n")
    code = """
import sys
from baldwinlab.cli import main
sys.argv = ["baldwinlab", "--version"]
try:
    main()
except SystemExit:
    pass
import os, matplotlib
print(matplotlib.rcParams["lines.linewidth"], os.getcwd())
"""
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])}
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.splitlines()[-1] == f"1.5 {tmp_path}"
    assert done.stderr == ""
