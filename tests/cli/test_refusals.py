"""The command line refuses invalid input with one sentence and changes no file."""

from __future__ import annotations

import errno
import os
import shlex
import shutil
from pathlib import Path

import pytest

from baldwinlab.core import resources
from tests.cli.test_refused_commands import read_tree
from tests.commands import Command
from tests.small_studies import make_small_study

# Other tests draw these figures.
pytestmark = pytest.mark.usefixtures("placeholder_figures_of_module")

NESTED_LISTS = "[" * 500 + "]" * 500
TOO_DEEP = "is not TOML: it is nested too deeply"
LIFE = "--condition evo/A --run 0 --generation 0"
PHYLOGENY = "export study --format phylogeny --condition evo/A --run 0"
FILES = {
    "true.toml": 'base = "evo/A"\nname = true',
    "date.toml": 'base = "evo/A"\nname = 2026-01-01',
    "deep.toml": f"a = {NESTED_LISTS}",
    "deep/paper.toml": f"a = {NESTED_LISTS}",
    "large.toml": 'experiment = "evo/A"\nruns = 100000000\n[fields]\nevolution.elite = [0, 1]',
    "negative.toml": 'experiment = "evo/A"\nruns = 2\n[fields]\nworld.food.0.count = [0, -50]',
}


@pytest.fixture(scope="module")
def stored(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a study with one run per condition."""
    return make_small_study(tmp_path_factory.mktemp("stored"), runs=1).directory


@pytest.mark.parametrize(
    ("line", "sentence"),
    [
        ("run evo/Z", "there is no map 'Z'"),
        ("run true.toml", "true.toml: name = true: must be a text; write it in quotes"),
        ("run date.toml", "date.toml: name = 2026-01-01: must be a text; write it in quotes"),
        # As a path, an empty text is the working directory.
        ("run evo/A --runs 1 --out ''", "baldwinlab: --out needs a value; usage: baldwinlab run"),
        ("report ''", "baldwinlab: DIRECTORY is missing; usage: baldwinlab report"),
        ("replay study --run 0 --generation 1 --out ''", "baldwinlab: --out needs a value"),
        ("run nothing.toml", "cannot read nothing.toml: No such file or directory"),
        (
            "run evo/A --set lifetime.steps=0",
            "lifetime.steps = 0: input should be greater than or equal to 1",
        ),
        (
            "run evo/A --set speed=3",
            "speed: there is no 'speed' here; there are: name, model, world",
        ),
        ("reproduce atlas --steps 3", "--steps applies to a paper; atlas has its own settings"),
        (
            "reproduce what-guides --generations 3",
            "--generations applies to a paper; what-guides has its own settings",
        ),
        (
            "reproduce atlas --checkpoint 30s --backend cpu",
            "--backend, --checkpoint applies to a paper; atlas has its own settings",
        ),
        ("run evo/A --runs 0", "--runs 0 must be a whole number from 1"),
        ("run evo/A --workers -2", "--workers -2 must be a whole number from 1"),
        ("reproduce --variant sloppy", "there is no variant 'sloppy'"),
        ("reproduce --generations 0", "evolution.generations = 0"),
        ("report study --last-generations 0", "--last-generations 0 must be a whole number from 1"),
        ("report nowhere", "nowhere holds no study"),
        (f"replay x {LIFE} --out x.avi", "must end in .nc, .mp4, .gif or .png"),
        (
            "replay study --condition evo/B --run 0 --generation 0 --out x.nc",
            "has no condition 'evo/B'",
        ),
        (
            "replay study --condition evo/A --run 7 --generation 0 --out x.nc",
            "0007.nc does not exist; runs of evo/A that are stored: 1",
        ),
        (
            "replay study --condition evo/A --run 0 --generation 9 --out x.nc",
            "generation = 9: run 0 of evo/A has the generations 0 to 2",
        ),
        (f"replay study {LIFE} --out no/x.gif", "no/x.gif"),
        (
            "assay study --assays innate,instinct",
            "there is no assay 'instinct'; there are descent, innate",
        ),
        ("assay study spoon", "there is no assay 'spoon'"),
        ("assay study --workers 0", "--workers 0 must be a whole number from 1"),
        ("assay study fork --generations 0", "--generations 0 must be a whole number from 1"),
        ("assay study fork --from center", "--from center must be population or mode"),
        ("assay study innate --from mode", "--from mode needs the assay fork"),
        ("assay study innate --generations 4", "--generations 4 needs the assay fork or fork-mode"),
        (
            "export study --format phylogeny --condition evo/B --run 0 --out x.csv",
            "has no condition 'evo/B'",
        ),
        (
            "export study --format phylogeny --condition evo/A --run 7 --out x.csv",
            "0007.nc does not exist",
        ),
        ("run evo/A --out study", "study holds another study"),
        ("run evo/A --runs many", "many"),
        (
            "run evo/A --set learning.teacher=shuffled",
            'learning.teacher: does nothing with learning.rule = "none"',
        ),
        (
            "report innate mine",
            "unexpected argument 'mine'; usage: baldwinlab report DIRECTORY; "
            "baldwinlab report --help lists",
        ),
        (
            "assay study --executor cloud",
            "--executor cloud must be threads, dask:tcp://HOST:PORT or slurm",
        ),
        ("run evo/A --seed 1.5", "--seed: '1.5' must be a whole number"),
        ("run evo/A --workers 1.5", "--workers: '1.5' must be a whole number"),
        (
            "report study --last-generations 99999999999999999999",
            "must be a whole number of at most 18 digits",
        ),
        ("lab study --port 0x10", "--port: '0x10' must be a whole number"),
        (
            "lab study --no-browser --port 65536",
            "baldwinlab: --port 65536 must be from 0 to 65535\n",
        ),
        ("lab none --no-browser", "baldwinlab: none does not exist"),
        *(
            (
                f"lab study --no-browser --root-path {shlex.quote(path)}",
                f"baldwinlab: --root-path {path} must be the path of the proxy",
            )
            for path in ("lab", "http://hub/lab", "/a//b", "/a?b", "/a b")
        ),
        ("report study --out study/study.toml", "--out study/study.toml is inside the study"),
        (
            "report",
            "DIRECTORY is missing; usage: baldwinlab report DIRECTORY; "
            "baldwinlab report --help lists",
        ),
        (
            "replay mine --run 0 --generation 0",
            "--out needs a value; usage: baldwinlab replay [DIRECTORY] --out OUT; "
            "baldwinlab replay --help lists",
        ),
        (
            "run evo/A --part nothing.py",
            "cannot read the part nothing.py: No such file or directory",
        ),
        ("report study --parts 3", "Unknown option: --parts. Did you mean --part?"),
        ("run evo/A --runs 100000000", "100,000,000 runs: needs about"),
        ("sweep large.toml", "Reduce the request or add --force."),
        ("run evo/A --runs 3000000000 --force", "--runs 3000000000 must be a whole number from 1"),
        (
            "run evo/A --set population.size=1000000 evolution.generations=1000000",
            "PiB of memory, but only",
        ),
        (
            "run evo/A --set population.size=1000000 --force",
            "kept_genome would take 22.4 GiB, and netCDF files hold",
        ),
        ("reproduce --steps 100000000 --runs 1", "of memory, but only"),
        ("multiverse --runs 100000000", "9,000,000,000 runs: needs about"),
        ("rum", "there is no command 'rum' (did you mean 'run'?)"),
        ("show deep.toml", f"deep.toml {TOO_DEEP}"),
        ("sweep deep.toml", f"deep.toml {TOO_DEEP}"),
        ("reproduce ./deep", f"deep/paper.toml {TOO_DEEP}"),
        (f"show evo/A --set world.food={NESTED_LISTS}", "world.food = '[[["),
        (
            "sweep negative.toml --out swept",
            "baldwinlab: negative.toml: point-0001: world.food.0.count = -50: "
            "input should be greater than or equal to 0\n",
        ),
        ("sweep nothing.toml", "cannot read nothing.toml: No such file or directory"),
        (
            "run evo/A evo+drift/A --baseline evo+drft/A --out pair",
            "--baseline evo+drft/A is not a condition of the study (did you mean 'evo+drift/A'?)",
        ),
        (
            "run evo/B evo/B --runs 2",
            "baldwinlab: two conditions have the same name, 'evo/B': change name in one of them\n",
        ),
        (
            "report study --claims",
            "baldwinlab: study was made by no paper. Give a file of claims or a paper: "
            "--claims FILE or --claims PAPER.\n",
        ),
        (
            "replay study --run 0 --generation 1 --out life.nc",
            "study: condition is missing; there are evo/A",
        ),
        ("run study --generations 1", "generations = 1 must be at least 3"),
        ("run study --seed 3", "study is a stored study, which determines"),
        ("run study --set lifetime.steps=3", "study is a stored study"),
        ("run study --checkpoint never", "must be a number of generations"),
        ("run evo/A --founders study:evo/A@7", "must be a whole number from 0 to 2"),
        ("run evo/A --founders study", "must be STUDY:CONDITION@GENERATION"),
        ("run evo/A --at learning.rule=none", "must follow a generation"),
        ("run evo/A --at 3 population.size=4", "cannot change during a run"),
    ],
)
def test_invalid_input_prints_one_sentence_and_changes_no_file(
    command: Command, tmp_path: Path, stored: Path, line: str, sentence: str
) -> None:
    shutil.copytree(stored, tmp_path / "study")
    (tmp_path / "deep").mkdir()
    for name, content in FILES.items():
        (tmp_path / name).write_text(content)
    before = read_tree(tmp_path)
    result = command(*shlex.split(line))
    assert result.code == 2
    assert sentence in result.err
    assert "Traceback" not in result.err
    assert len(result.err.strip().splitlines()) == 1
    assert read_tree(tmp_path) == before


def test_force_disables_the_check_of_resources(
    command: Command, tmp_path: Path, stored: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copytree(stored, tmp_path / "study")
    monkeypatch.setattr(resources, "available_memory", lambda: 1_000_000)
    for line in (
        f"replay study {LIFE} --out life.nc",
        "report study",
        "assay study --assays descent",
        "run evo/A --runs 1 --set lifetime.steps=1 evolution.generations=1 --out new",
    ):
        refused = command(*line.split())
        assert refused.code == 2
        assert "of memory, but only 976.6 KiB are free on this machine" in refused.err
        assert command(*line.split(), "--force").code == 0


@pytest.mark.parametrize(
    ("line", "file"),
    [
        # The command writes the claims before the page. With --out, only the page is required.
        ("report study", "study/claims.json"),
        ("report study --out page.html", "page.html"),
        ("run evo/A --runs 1 --out new", "new/runs/evo/A/experiment.toml"),
        (f"{PHYLOGENY} --out x.csv", "x.csv"),
        ("assay study --assays descent --workers 1", "study/assays/descent/evo+self-taught/A.nc"),
        *((f"replay study {LIFE} --out x.{kind}", f"x.{kind}") for kind in ("nc", "png")),
    ],
)
def test_an_error_about_a_full_disk_names_the_file_and_the_folder(
    command: Command,
    tmp_path: Path,
    stored: Path,
    monkeypatch: pytest.MonkeyPatch,
    line: str,
    file: str,
) -> None:
    def fail_without_space(handle: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    shutil.copytree(stored, tmp_path / "study")
    monkeypatch.setattr(os, "fsync", fail_without_space)
    result = command(*line.split())
    assert result.code != 0
    assert file in result.err.splitlines()[-1]
    assert f"no space is left in {Path(file).parent}" in result.err.splitlines()[-1]
    assert "Traceback" not in result.err


def test_a_message_fits_on_a_screen(command: Command, tmp_path: Path) -> None:
    (tmp_path / "keys.toml").write_text("".join(f"key{number} = 1\n" for number in range(20_000)))
    region = "{ x = [9, 0], y = [0, 1], energy = -1 }"
    (tmp_path / "regions.toml").write_text(f"[world]\nfood = [{', '.join([region] * 65)}]")
    (tmp_path / "long.toml").write_text(f"{'a' * 5000} = 1\nname = '{'b' * 5000}'")
    keys = "".join(f"key{number} = 1\n" for number in range(500))
    (tmp_path / "sweep.toml").write_text(f'experiment = "evo/A"\n{keys}')
    for arguments, end in (
        (["run", "keys.toml"], "and 19,990 more"),
        (["run", "regions.toml"], ""),
        (["run", "long.toml"], ""),
        (["sweep", "sweep.toml"], "and 491 more"),
        (["c" * 5000], "more characters"),
    ):
        result = command(*arguments)
        assert result.code != 0
        assert 20 < len(result.err) < 1950
        assert result.err.strip().endswith(end)


def test_a_study_without_runs_has_no_report(command: Command, tmp_path: Path) -> None:
    study = make_small_study(tmp_path / "study", runs=1)
    for condition in study.experiments:
        study.path(condition, 0).unlink()
    result = command("report", "study")
    assert result.code != 0
    assert "holds no finished run yet" in result.err
