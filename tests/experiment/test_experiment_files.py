"""Experiment files: the base, the name, and the warning about a world without food."""

from __future__ import annotations

import tomllib
import warnings
from collections.abc import Callable
from pathlib import Path

import pytest

import baldwinlab as bl
from baldwinlab.studies.sweeps import read_sweep
from baldwinlab.studies.sweeps.design import expand_sweep
from tests.commands import Command

Write = Callable[[str, str], Path]


@pytest.fixture
def write(tmp_path: Path) -> Write:
    def write(name: str, text: str) -> Path:
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(text)
        return path

    return write


def test_a_file_changes_its_base_preset(write: Write) -> None:
    path = write("near.toml", 'base = "evo+self-taught/B"\n[senses]\nvisual_radius = 20')
    preset = bl.load("evo+self-taught/B")
    assert bl.load(path) == preset.replace(name="near", senses={"visual_radius": 20})


def test_the_base_can_be_a_file_with_a_relative_path(
    write: Write, monkeypatch: pytest.MonkeyPatch
) -> None:
    write(
        "bases/taught.toml", 'base = "evo+self-taught/A"\nname = "my/taught"\nlearning.rate = 0.5'
    )
    path = write("files/short.toml", 'base = "../bases/taught.toml"\nlifetime.steps = 7')
    monkeypatch.chdir("/")
    loaded = bl.load(path)
    assert (loaded.name, loaded.learning.rate, loaded.steps) == ("short", 0.5, 7)
    assert bl.load(path.parent.parent / "bases" / "taught.toml").name == "my/taught"


def test_a_different_part_removes_the_settings_of_the_part_of_the_base(write: Write) -> None:
    write("social.toml", 'base = "evo/A"\nlearning.rule = "reward"')
    path = write("plain.toml", 'base = "social.toml"\nlearning.rule = "self-taught"')
    assert bl.load(path) == bl.load("evo+self-taught/A").replace(name="plain")


def test_the_base_can_be_a_preset_of_a_paper_in_a_folder(
    write: Write, monkeypatch: pytest.MonkeyPatch
) -> None:
    paper = (
        'name = "mine"\ntitle = "T"\nauthors = ["A"]\nyear = 2026\n'
        'citation = "C"\ndescription = "D"'
    )
    write("paper/paper.toml", paper)
    conditions = write("paper/paper.toml", paper).parent / "conditions"
    conditions.mkdir()
    (conditions / "plain.toml").write_text('description = "without food"\nlifetime.steps = 9')
    path = write("longer.toml", 'base = "paper:plain"\npopulation.size = 3')
    monkeypatch.chdir("/")
    assert (bl.load(path).steps, bl.load(path).population.size) == (9, 3)


@pytest.mark.parametrize(
    ("base", "refusal"),
    [
        ('"none.toml"', r"a.toml: base = 'none.toml': cannot read .*none.toml: No such file"),
        ('"evo/Q"', r"a.toml: base = 'evo/Q': there is no map 'Q' of evo; there are A, B"),
        ("3", r"a.toml: base = 3: must be the name of a preset or of a TOML file"),
        ('"a.toml"', r"a.toml: base = 'a.toml': the bases form a cycle: .*a.toml -> .*a.toml"),
        ('"b.toml"', r"b.toml: base = 'c.toml': .*c.toml: base = 'b.toml': the bases form a cycle"),
        (
            '"evo/A"\nmodel = "nk-climbers"',
            r"a.toml: model = 'nk-climbers': the base 'evo/A' is of the model",
        ),
        ('"evo/A"\nlearning = 5', r"a.toml: learning = 5: input should be"),
        ('"evo/A"\nself = 5', r"a.toml: self: there is no such field"),
        ('"evo/A"\nsenses.radius = 5', r"a.toml: senses.radius: there is no such field"),
    ],
)
def test_an_invalid_base_is_refused(write: Write, base: str, refusal: str) -> None:
    write("b.toml", 'base = "c.toml"')
    write("c.toml", 'base = "b.toml"')
    with pytest.raises(bl.ExperimentError, match=refusal):
        bl.load(write("a.toml", f"base = {base}"))


def test_a_long_chain_of_bases_is_refused(write: Write) -> None:
    for number in range(30):
        write(f"{number}.toml", f'base = "{number + 1}.toml"')
    with pytest.raises(
        bl.ExperimentError,
        match=r"20\.toml: base = '21\.toml': more than 20 files are based on each other",
    ):
        bl.load(write("start.toml", 'base = "1.toml"'))


def test_a_cycle_through_a_link_is_refused(write: Write, tmp_path: Path) -> None:
    path = write("a.toml", 'base = "link.toml"')
    (tmp_path / "link.toml").symlink_to(path)
    with pytest.raises(bl.ExperimentError, match="cycle"):
        bl.load(path)


@pytest.mark.parametrize(
    ("file", "name"),
    [("mine", "mine"), ("my file (2)", "my-file-2"), ("_", "experiment"), ("ü", "experiment")],
)
def test_the_name_is_the_stem_of_the_file(write: Write, file: str, name: str) -> None:
    assert bl.load(write(f"{file}.toml", 'base = "evo/A"')).name == name


def test_a_file_without_base_and_without_food_gives_a_warning(write: Write) -> None:
    with pytest.warns(UserWarning, match=r'short.toml: the world has no food, .* base = "evo/A"'):
        bl.load(write("short.toml", "[senses]\nvisual_radius = 20"))


@pytest.mark.parametrize(
    "text", ['base = "evo/A"', "[world]\nfood = []", 'model = "hinton-nowlan"']
)
def test_a_file_with_food_or_with_an_explicit_empty_list_gives_no_warning(
    write: Write, text: str
) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        bl.load(write("file.toml", text))


def test_a_copy_of_a_preset_can_run_together_with_the_preset(
    command: Command, tmp_path: Path
) -> None:
    (tmp_path / "copy.toml").write_text(
        command("show", "evo/B", "--set", "senses.visual_radius=20").out
    )
    short = (
        "--set",
        "lifetime.steps=5",
        "evolution.generations=2",
        "--runs",
        "1",
        "--out",
        "study",
    )
    assert command("run", "evo/B", "copy.toml", *short).code == 0
    assert bl.open_study(tmp_path / "study").conditions == ("evo/B", "copy")


def test_show_prints_only_a_given_name(command: Command, tmp_path: Path) -> None:
    (tmp_path / "file.toml").write_text('base = "evo/B"\nname = "given"')
    assert tomllib.loads(command("show", "file.toml").out)["name"] == "given"
    assert tomllib.loads(command("show", "evo/B", "--set", "name=given").out)["name"] == "given"
    assert "name" not in tomllib.loads(command("show", "evo/B").out)


def test_a_study_stores_the_complete_experiment(write: Write, tmp_path: Path) -> None:
    path = write("near.toml", 'base = "evo/A"\nlifetime.steps = 5\nevolution.generations = 2')
    study = bl.run(path, runs=1, out=tmp_path / "study")
    path.unlink()
    stored = tomllib.loads((study.directory / "runs" / "near" / "experiment.toml").read_text())
    assert "base" not in stored
    assert stored["world"]["food"]
    assert bl.open_study(tmp_path / "study").experiment("near").world == bl.load("evo/A").world


def test_a_sweep_and_an_exported_page_start_from_a_file_with_a_base(
    write: Write, command: Command
) -> None:
    write("near.toml", 'base = "evo/A"\nlifetime.steps = 5')
    sweep = write("sweep.toml", 'experiment = "near.toml"\n[fields]\npopulation.size = [2, 3]')
    assert [point.steps for point in expand_sweep(read_sweep(sweep), sweep)] == [5, 5]
    assert command("export", "near.toml", "--out", "page.html").code == 0
