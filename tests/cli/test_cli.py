"""The commands of the command line."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pandas as pd
import pytest
import xarray as xr
from PIL import Image

import baldwinlab as bl
from baldwinlab.core import console
from baldwinlab.experiment.toml import to_toml
from baldwinlab.papers.presets import PRESET_KINDS, load, names
from baldwinlab.simulation import memory
from baldwinlab.studies.assays.results import open_assay
from baldwinlab.studies.open import open_runs
from baldwinlab.studies.store import StudyStore
from baldwinlab.studies.sweeps.design import open_sweep
from tests.commands import Command
from tests.paused_studies import run_until_paused
from tests.small_studies import make_small_study, read_records, shorten_preset
from tests.studies.test_batched_studies import CONDITION, make_study

# Other tests draw these figures.
pytestmark = pytest.mark.usefixtures("placeholder_figures_of_module")

SHORT_PAPER = ["--runs", "2", "--generations", "3", "--steps", "60"]


@pytest.fixture(scope="module")
def stored(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a study with one run per condition."""
    return make_small_study(tmp_path_factory.mktemp("stored"), runs=1).directory


def test_list_presets_describes_every_preset(command: Command) -> None:
    result = command("list", "presets")
    assert result.code == 0
    for kind in PRESET_KINDS:
        for name in names(kind):
            rows = [line.split() for line in result.out.splitlines()]
            assert any(row[:1] == [name] and len(row) > 3 for row in rows)


def test_show_prints_an_experiment_that_can_be_edited_and_run(
    command: Command, tmp_path: Path
) -> None:
    result = command("show", "evo/B", "--set", "lifetime.steps=50", "evolution.generations=2")
    (tmp_path / "mine.toml").write_text(result.out)
    changes = {"lifetime": {"steps": 50}, "evolution": {"generations": 2}}
    assert load(tmp_path / "mine.toml") == load("evo/B").replace(name="mine", **changes)
    result = command("run", "mine.toml", "--runs", "2", "--seed", "4")
    assert result.code == 0
    sizes = {"condition": 1, "run": 2, "generation": 2, "agent": 20}
    assert open_runs("results/mine").food_eaten.sizes == sizes


def test_custom_conditions_with_names_of_variants_are_an_ordinary_study(
    command: Command, tmp_path: Path
) -> None:
    short = load("evo/A").replace(lifetime={"steps": 60}, evolution={"generations": 2})
    for name in ("rank/A", "biases/A"):
        path = tmp_path / f"{name[:4]}.toml"
        path.write_text(to_toml(short.replace(name=name)))
    assert command("run", "rank.toml", "bias.toml", "--runs", "2", "--out", "mine").code == 0
    result = command("report", "mine")
    assert result.code == 0, result.err
    page = (tmp_path / "mine/report.html").read_text()
    assert "Evolution and lifetime learning: rank/A, biases/A" in page
    assert "Comparison of the conditions" in page
    assert not (tmp_path / "mine/multiverse.json").exists()


def test_a_preset_and_a_custom_experiment_are_compared(command: Command, tmp_path: Path) -> None:
    """The terminal, the report, the table and Python show the same comparison."""
    settings = [
        "lifetime.steps=60",
        "evolution.generations=2",
        "world.start.x=400",
        "world.start.y=160",
    ]
    (tmp_path / "short.toml").write_text(
        command("show", "evo/A", "--set", "senses.visual_radius=20").out
    )
    line = "run evo/A short.toml --runs 4 --out pair --set"
    result = command(*line.split(), *settings)
    assert result.code == 0, result.err
    note = (
        "With 4 runs and 2 tests, the smallest corrected p-value is 0.057. "
        "At least 5 runs are needed. To add runs: baldwinlab run pair --runs 5"
    )
    before, after = result.out.split("Comparison of the conditions")
    assert note in before
    assert note in after
    assert "short, average agent: " in after
    assert "Each condition is compared with evo/A." in after
    reported = command("report", "pair", "--baseline", "short")
    assert "evo/A, best agent: " in reported.out
    assert note in reported.out
    rows = pd.read_csv(tmp_path / "pair/statistics.csv", keep_default_na=False)
    expected = bl.open_study(tmp_path / "pair").compare("short")
    pd.testing.assert_frame_equal(
        rows.drop(columns="claim"), expected[rows.columns[1:]], check_dtype=False
    )
    assert "too few runs" in (tmp_path / "pair/report.html").read_text()
    assert json.loads((tmp_path / "pair/claims.json").read_text())["claims"] == []
    assert command("report", "pair", "--paper", "le-2019").code == 0
    assert len(json.loads((tmp_path / "pair/claims.json").read_text())["claims"]) == 9
    extended = command("run", "pair", "--runs", "5")
    assert extended.code == 0 and "At least" not in extended.out


def test_several_settings_can_follow_one_or_several_set_options(command: Command) -> None:
    once = command("show", "evo/A", "--set", "lifetime.steps=5", "population.size=3")
    repeated = command("show", "evo/A", "--set", "lifetime.steps=5", "--set", "population.size=3")
    assert once.out == repeated.out
    assert "size = 3" in once.out


def test_a_custom_part_is_loaded_from_a_file(command: Command) -> None:
    part = str(Path(__file__).parents[2] / "examples" / "parts" / "social.py")
    settings = ("--set", "learning.rule=social", "learning.social.least=3")
    assert (
        "[learning.social]\nleast = 3 #" in command("show", "evo/A", "--part", part, *settings).out
    )


# The quick suite runs a smaller example of the README.
@pytest.mark.nightly
def test_reproduce_writes_claims_statistics_figures_and_a_report(
    command: Command, tmp_path: Path
) -> None:
    console.info_once.cache_clear()
    result = command("reproduce", *SHORT_PAPER, "--workers", "2", "--out", "small")
    assert result.code == 0, result.err
    # The line is not repeated for the assays.
    assert result.out.count("Workers: 2; usable cores: ") == 1
    for number in range(1, 10):
        assert f"C{number}" in result.out
    # The report is written before the assays and again after them.
    first_part, second_part = (
        part.strip() for part in result.out.split("report: small/report.html")[:2]
    )
    assert "assays to do" not in first_part
    assert second_part.startswith(
        "The report lacks the assays. They run now; then it is written again."
    )
    assert "assays to do" in second_part
    assert result.out.count("report: ") == 2
    claims = json.loads((tmp_path / "small/claims.json").read_text())["claims"]
    assert [claim["id"] for claim in claims] == [f"C{number}" for number in range(1, 10)]
    fields = "id condition comparison effect interval p p_holm a12 verdict paper"
    assert all({*fields.split()} <= set(claim) for claim in claims)
    assert (tmp_path / "small/statistics.csv").read_text().count("\n") > 15
    suffixes = {path.suffix for path in (tmp_path / "small/figures").iterdir()}
    assert suffixes == {".svg", ".pdf", ".png", ".csv"}
    assert "<html" in (tmp_path / "small/report.html").read_text()
    repeated = command("reproduce", *SHORT_PAPER, "--out", "small")
    assert "12 runs stored, none to do" in repeated.out
    # The report is written once because all assays are stored.
    assert repeated.out.count("report: ") == 1


# The test draws all figures, as the previous test does.
@pytest.mark.nightly
def test_reproduce_stores_a_variant_in_a_separate_folder(command: Command, tmp_path: Path) -> None:
    line = "reproduce --runs 1 --generations 1 --steps 10 --variant literal --workers 1"
    result = command(*line.split())
    assert result.code == 0, result.err
    (study,) = (tmp_path / "results").iterdir()
    assert study.name == "paper-literal-generations1-steps10"
    assert "visual_radius = 4.0" in (study / "runs/evo/A/experiment.toml").read_text()


def test_report_uses_only_stored_results(command: Command, stored: Path, tmp_path: Path) -> None:
    shutil.copytree(stored, tmp_path / "study")
    result = command("report", "study", "--out", "page.html")
    assert result.code == 0, result.err
    assert (tmp_path / "page.html").exists()
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


def test_a_sweep_can_be_run_reported_and_extended(command: Command, tmp_path: Path) -> None:
    (tmp_path / "food.toml").write_text(SWEEP)
    result = command("sweep", "food.toml")
    assert result.code == 0, result.err
    assert "report: results/food/report.html" in result.out
    study = tmp_path / "results/food"
    sizes = {"world.food.0.count": 2, "run": 2, "generation": 2, "agent": 20}
    assert open_sweep(study).energy.sizes == sizes
    rows = (study / "responses.csv").read_text().splitlines()
    assert rows[1:4] == [f"0,0,{measure},2,0.0,0.0,0.0" for measure in ("best", "mean", "share")]
    (study / "report.html").unlink()
    assert command("report", "results/food").code == 0
    assert "sweep of world.food.0.count" in (study / "report.html").read_text()
    (tmp_path / "food.toml").write_text(SWEEP.replace("runs = 2", "runs = 3"))
    assert "4 of 6 runs stored, 2 to do" in command("sweep", "food.toml", "--workers", "1").out


def test_replay_writes_a_trace_a_movie_or_an_image(
    command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # The movie lasts a second.
    monkeypatch.setattr("baldwinlab.analysis.movie.MAX_SECONDS", 1)
    # Settings of the user have no effect on the picture.
    monkeypatch.setitem(mpl.rcParams, "savefig.bbox", "tight")
    monkeypatch.setitem(mpl.rcParams, "savefig.dpi", 30)
    study = make_small_study(tmp_path / "study")
    for name in ("life.nc", "life.gif", "life.mp4", "life.png"):
        line = f"replay study --condition evo+self-taught/A --run 1 --generation 2 --out {name}"
        result = command(*line.split())
        assert result.code == 0, result.err
        assert (tmp_path / name).stat().st_size > 1000
    with xr.open_dataset(tmp_path / "life.nc") as trace:
        assert np.array_equal(
            trace.eaten.sum("step"), study.read("evo+self-taught/A", 1).food_eaten[2]
        )
    with Image.open(tmp_path / "life.png") as picture:
        # Old versions of Matplotlib truncate a height of 819.99 pixels.
        assert picture.size in ((720, 819), (720, 820))


def test_replay_uses_the_condition_of_a_study_with_a_single_one(
    command: Command, tmp_path: Path
) -> None:
    make_small_study(tmp_path / "one", [shorten_preset("evo/A")], runs=1)
    line = "replay one --run 0 --generation 1 --out life.nc"
    assert command(*line.split()).code == 0
    assert (tmp_path / "life.nc").exists()


def test_runs_and_assays_print_the_number_of_workers_once(command: Command) -> None:
    console.info_once.cache_clear()
    settings = ("--set", "evolution.generations=2", "lifetime.steps=40")
    arguments = ("evo+self-taught/A", "--runs", "2", "--out", "study", "--workers", "2")
    result = command("run", *arguments, *settings)
    assert result.out.count("Workers: 2; usable cores: ") == 1, result.err
    assert "Workers: " not in command("assay", "study", "--assays", "innate", "--workers", "2").out
    console.info_once.cache_clear()
    result = command("assay", "study", "--assays", "descent", "--workers", "1")
    assert result.out.count("Workers: 1; usable cores: ") == 1, result.err


def test_assay_runs_each_assay_once_and_updates_the_report(
    command: Command, stored: Path, tmp_path: Path
) -> None:
    shutil.copytree(stored, tmp_path / "study")
    result = command("assay", "study", "descent", "--assays", "modules", "--workers", "2")
    assert result.code == 0, result.err
    # 4 pairs of modules, 20 learners and 300 steps.
    assert "3 assays to do (24,000 agent-steps)" in result.out
    assert (tmp_path / "study/report.html").exists()
    energy = open_assay("study", "modules", "evo+self-taught/A").energy
    assert energy.dims == ("run", "modules", "agent")
    repeated = command("assay", "study", "--assays", "descent")
    assert "all assays are already stored" in repeated.out


def test_a_fork_from_the_mode_is_another_assay(
    command: Command, stored: Path, tmp_path: Path
) -> None:
    study = shutil.copytree(stored, tmp_path / "study")
    outcome = command("assay", "study", "fork", "--from", "mode", "--generations", "1")
    assert outcome.code == 0, outcome.err
    assert [path.name for path in (study / "assays").iterdir()] == ["fork-mode"]
    assert "Further evolution" in (study / "report.html").read_text("utf-8")


def test_interrupted_assays_report_their_progress_and_can_be_resumed(
    command: Command, stored: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copytree(stored, tmp_path / "study")

    @contextmanager
    def interrupt_at_once(description: str, total: int) -> Iterator[Callable[[int], None]]:
        def stop(amount: int) -> None:
            raise KeyboardInterrupt

        yield stop

    with monkeypatch.context() as patched:
        patched.setattr("baldwinlab.core.console.progress", interrupt_at_once)
        result = command("assay", "study", "--assays", "reaction")
    assert result.code == 130
    message = "Interrupted. 0 of 2 assays are stored in study. Repeat the command to continue."
    assert message in result.err
    assert "2 assays to do" in command("assay", "study", "--assays", "reaction").out


def test_ctrl_c_reports_the_stored_runs_and_the_same_command_resumes(
    command: Command, tmp_path: Path
) -> None:
    arguments = ["run", "evo+self-taught/A", "--runs", "24", "--workers", "1", "--out", "study"]
    arguments += ["--set", "evolution.generations=4", "--set", "lifetime.steps=300"]
    with run_until_paused(
        "from baldwinlab.__main__ import main; main()",
        tmp_path / "study",
        1,
        arguments,
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    ) as process:
        process.send_signal(signal.SIGINT)
        _, err = process.communicate()
    assert process.returncode == 130
    stored = len(read_records(tmp_path))
    # The second of two tasks had not begun.
    assert 0 < stored < 24
    message = f"{stored} of 24 runs are stored in study. Repeat the command to continue."
    assert f"Interrupted. {message}" in err
    assert "Traceback" not in err
    repeated = command(*arguments)
    assert repeated.code == 0
    assert f"{stored} of 24 runs stored" in repeated.out
    assert StudyStore(tmp_path / "study").runs("evo+self-taught/A") == list(range(24))


def test_matplotlib_settings_in_the_working_directory_are_ignored(tmp_path: Path) -> None:
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
    result = subprocess.run(
        [sys.executable, "-c", code],
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
        check=True,
    )
    assert result.stdout.splitlines()[-1] == f"1.5 {tmp_path}"
    assert result.stderr == ""


def test_a_traceback_shows_control_characters_of_third_party_text() -> None:
    code = """
from baldwinlab import cli

def fail(arguments, exit_on_error):
    raise RuntimeError("\\x1b]0;title\\x07[bold]\\u202e")

cli.app = fail
cli.main()
"""
    command = [sys.executable, "-c", code, "show", "evo/A"]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    assert result.returncode == 1
    assert "RuntimeError: \\u001b]0;title\\u0007[bold]\\u202e\n" in result.stderr
    assert result.stderr.startswith("Traceback (most recent call last):\n")


def test_a_stored_study_is_extended_by_its_directory(command: Command, tmp_path: Path) -> None:
    settings = ("--set", "lifetime.steps=100", "--generations")
    assert command("run", "evo/A", *settings, "2", "--runs", "1", "--out", "study").code == 0
    assert command("run", "study", "--generations", "4", "--runs", "2").code == 0
    assert command("run", "evo/A", *settings, "4", "--runs", "2", "--out", "longer").code == 0
    assert read_records(tmp_path / "study") == read_records(tmp_path / "longer")


def test_status_shows_stored_and_missing_runs_and_failures(
    command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    directory = tmp_path / "study"
    with monkeypatch.context() as earlier:
        earlier.setattr(memory, "MAX_RUNS_PER_FILE", 1)
        make_study(directory, runs=20)
    path = directory / "runs" / CONDITION / "0003.nc"
    path.rename(f"{path}.damaged")
    result = command("status", "study")
    assert result.code == 0
    assert "study: 19 of 20 runs stored" in result.out
    assert f"{CONDITION}: 19 stored, 1 missing" in result.out
    assert "not running; the last session had" in result.out
    assert "0003.nc.damaged was damaged" in result.err
    content = json.loads(command("status", "study", "--json").out)
    assert (content["done"], content["missing"]) == (19, 1)
    assert content["is_running"] is False
    assert content["seconds_left"] > 0
    assert len(content["failures"]) == 1
