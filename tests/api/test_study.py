"""A study in Python: run, open, read, compare, assay, report, resume, and show in a notebook."""

from __future__ import annotations

import base64
import re
import shutil
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
import xarray as xr

import baldwinlab as bl
from baldwinlab import BaldwinLabError, Study
from baldwinlab.analysis.figures.style import choose_style
from baldwinlab.studies.assays.results import open_assay
from baldwinlab.studies.open import open_runs
from tests.small_studies import SHORT_SETTINGS, make_small_study, read_records, shorten_preset

SHORT = {"evolution.generations": 3, "lifetime": {"steps": 300}}


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Study:
    return bl.run(
        [shorten_preset("evo/A"), shorten_preset("evo+self-taught/A")],
        runs=2,
        seed=5,
        out=tmp_path_factory.mktemp("mine") / "study",
    )


@pytest.fixture
def copied_study(study: Study, tmp_path: Path) -> Study:
    """A copy for tests that add files, which other tests of the study must not see."""
    return bl.open_study(shutil.copytree(study.directory, tmp_path / "copy"))


def test_a_run_is_the_study_that_the_command_line_makes(study: Study, tmp_path: Path) -> None:
    make_small_study(tmp_path / "other", runs=2)
    assert read_records(study.directory) == read_records(tmp_path / "other")
    assert study.conditions == ("evo/A", "evo+self-taught/A")
    assert study.runs("evo/A") == [0, 1]
    assert study.experiment("evo/A") == shorten_preset("evo/A")


def test_settings_change_all_presets_of_a_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    study = bl.run(["evo/A", bl.load("evo+self-taught/A")], runs=1, set=SHORT)
    assert study.directory == tmp_path / "results/evo-A-evo+self-taught-A"
    assert study.experiment("evo/A") == bl.load("evo/A").replace(**SHORT_SETTINGS)
    single = bl.run("evo/A", runs=1, set={**SHORT, "world.food.0.count": 3}, out="single")
    assert single.experiment("evo/A").world.food[0].count == 3
    (tmp_path / "mine.toml").write_text(
        'name = "mine"\n[lifetime]\nsteps = 5\n[evolution]\ngenerations = 1\n'
    )
    assert bl.run(Path("mine.toml"), runs=1).conditions == ("mine",)


def test_the_same_call_runs_the_missing_runs(
    copied_study: Study, capsys: pytest.CaptureFixture[str]
) -> None:
    resumed = bl.run(
        [shorten_preset("evo/A"), shorten_preset("evo+self-taught/A")],
        runs=3,
        seed=5,
        out=copied_study.directory,
    )
    assert "4 of 6 runs stored" in capsys.readouterr().out
    assert resumed.runs("evo/A") == copied_study.runs("evo/A") == [0, 1, 2]


def test_an_open_study_has_its_data_and_replays_lifetimes(study: Study) -> None:
    opened = bl.open_study(study.directory)
    xr.testing.assert_identical(opened.data(), open_runs(study.directory))
    assert opened.data(["evo/A"]).sizes["condition"] == 1
    trace = opened.replay("evo+self-taught/A", run=1, generation=2)
    eaten = opened.data().food_eaten.sel(condition="evo+self-taught/A", run=1, generation=2)
    assert np.array_equal(trace.eaten.sum("step"), eaten)
    assert str(study.directory) in repr(opened)
    assert f"evo/A: {len(opened.runs('evo/A'))} runs" in repr(opened)


def test_conditions_are_compared_with_the_first_or_with_a_baseline(study: Study) -> None:
    table = study.compare()
    rows = [["evo+self-taught/A", "evo/A", measure] for measure in ("mean", "best")]
    assert table[["condition_a", "condition_b", "measure"]].values.tolist() == rows
    # All three generations are among the last ten.
    means = study.data().energy.mean(["agent", "generation"]).median("run")
    difference = means.sel(condition="evo+self-taught/A") - means.sel(condition="evo/A")
    np.testing.assert_allclose(table["effect"][0], difference, rtol=1e-6)
    assert set(table["verdict"]) == {"too few runs"} and table.attrs["too_few"].endswith(
        f"At least 5 runs are needed. To add runs: baldwinlab run {study.directory} --runs 5"
    )
    turned = study.compare("evo+self-taught/A")
    assert set(turned["condition_b"]) == {"evo+self-taught/A"}
    np.testing.assert_allclose(turned["effect"], -table["effect"])
    with pytest.raises(bl.StudyError, match="has no condition 'evo/C'"):
        study.compare("evo/C")
    with pytest.raises(BaldwinLabError, match="last = 0"):
        study.compare(last=0)


def test_the_first_request_of_an_assay_runs_it(
    copied_study: Study, capsys: pytest.CaptureFixture[str]
) -> None:
    innate = copied_study.assay("innate", "evo+self-taught/A", workers=1)
    xr.testing.assert_identical(
        innate, open_assay(copied_study.directory, "innate", "evo+self-taught/A")
    )
    assert "2 assays to do" in capsys.readouterr().out
    all_conditions = copied_study.assay("innate")
    assert "assays to do" not in capsys.readouterr().out
    assert all_conditions.condition.values.tolist() == ["evo/A", "evo+self-taught/A"]
    learned = all_conditions.energy.sel(condition="evo+self-taught/A")
    np.testing.assert_array_equal(
        learned.dropna("life", how="all"), innate.energy.transpose(*learned.dims)
    )
    assert "assays: innate" in repr(copied_study)
    with pytest.raises(BaldwinLabError, match="there is no assay 'instinct'"):
        copied_study.assay("instinct")


def test_an_assay_of_conditions_with_different_settings_has_the_settings_of_all(
    copied_study: Study,
) -> None:
    joined = copied_study.assay("reaction")
    for condition in copied_study.conditions:
        stored = open_assay(copied_study.directory, "reaction", condition)
        of_condition = joined.energy.sel(condition=condition).dropna("setting", how="all")
        for coordinate in ("field", "value"):
            assert set(of_condition[coordinate].values) == set(stored[coordinate].values)
        for number in stored.setting.values:
            field, value = (stored[name].values[number] for name in ("field", "value"))
            is_setting = (of_condition.field == field) & (of_condition.value == value)
            (energy,) = of_condition.transpose("setting", ...).values[is_setting.values]
            np.testing.assert_array_equal(energy, stored.energy.sel(setting=number))
    assert not joined.energy.isnull().all(("condition", "run", "agent")).any()


@pytest.mark.nightly  # two reports
def test_its_report_lies_in_it_or_where_one_says(copied_study: Study, tmp_path: Path) -> None:
    assert copied_study.report() == copied_study.directory / "report.html"
    assert "<html" in copied_study.report(tmp_path / "page.html", last=2).read_text("utf-8")


def test_a_record_leads_to_its_experiment(copied_study: Study) -> None:
    study = copied_study
    evo, taught = shorten_preset("evo/A"), shorten_preset("evo+self-taught/A")
    assert bl.load(bl.simulate(evo, seed=1)) == evo
    assert bl.load(study.replay("evo+self-taught/A", run=0, generation=1)) == taught
    assert bl.load(study.data().sel(condition="evo+self-taught/A")) == taught
    assert bl.load(study.assay("innate", "evo/A")) == evo
    with pytest.raises(BaldwinLabError, match="there are evo/A, evo\\+self-taught/A"):
        bl.load(study.data())
    with pytest.raises(BaldwinLabError, match="has no attribute or variable"):
        bl.load(xr.Dataset())


def test_invalid_arguments_are_refused_before_the_study_is_created(tmp_path: Path) -> None:
    out = tmp_path / "study"
    for sentence, arguments in {
        "executor = 'cloud' must be threads": {"executor": "cloud"},
        "lifetime.steps = 0: input should be": {"set": {"lifetime.steps": 0}},
    }.items():
        with pytest.raises(BaldwinLabError, match=sentence):
            bl.run("evo/A", out=out, **arguments)  # type: ignore[arg-type]
    with pytest.raises(BaldwinLabError, match="at least one experiment"):
        bl.run([], out=out)
    with pytest.raises(BaldwinLabError, match="holds no study"):
        bl.open_study(out)
    assert not out.exists()


def test_a_setting_without_effect_in_every_condition_is_refused(tmp_path: Path) -> None:
    idle = {"learning.teacher": "shuffled", "evolution.lamarckian_share": 0.5}
    with pytest.raises(
        bl.ExperimentError, match=r'learning.teacher: does nothing with learning.rule = "none"'
    ) as refused:
        bl.run("evo/A", set=idle, out=tmp_path / "study")
    assert len(str(refused.value).splitlines()) == 2
    bl.run(["evo/A", "evo+self-taught/A"], runs=1, set={**SHORT, **idle}, out=tmp_path / "study")


def test_a_study_is_extended_to_the_bits_of_a_longer_one(tmp_path: Path) -> None:
    study = bl.run(shorten_preset("evo/A"), runs=1, seed=5, out=tmp_path / "extended")
    study.extend(5, runs=2)
    longer = shorten_preset("evo/A").replace(evolution={"generations": 5})
    make_small_study(tmp_path / "longer", [longer], runs=2)
    assert read_records(study.directory) == read_records(tmp_path / "longer")
    assert study.data().sizes["generation"] == 5


def test_a_schedule_changes_settings_by_generation(tmp_path: Path) -> None:
    study = bl.run(
        shorten_preset("evo+self-taught/A"),
        runs=1,
        seed=5,
        out=tmp_path / "study",
        schedule={2: {"learning.rule": "none"}, 1: {"motor.noise": 0.5}},
    )
    experiment = study.experiment("evo+self-taught/A")
    assert [change.generation for change in experiment.schedule] == [1, 2]
    assert (experiment.at(1).learns, experiment.at(2).learns) == (True, False)
    assert experiment.at(2).motor.noise == 0.5


def test_a_callback_gets_each_generation_and_cannot_change_a_run(tmp_path: Path) -> None:
    calls: list[tuple[int, int]] = []

    def count_and_clear(data: xr.Dataset) -> None:
        calls.append((int(data.attrs["run"]), data.sizes["generation"]))
        for name in data.data_vars:
            data[name].values[:] = 0

    experiment = shorten_preset("evo/A")
    study = bl.run(experiment, runs=3, seed=5, out=tmp_path / "a", callback=count_and_clear)
    assert sorted(calls) == [(run, count) for run in range(3) for count in (1, 2, 3)]
    make_small_study(tmp_path / "b", [experiment], runs=3)
    assert read_records(study.directory) == read_records(tmp_path / "b")
    # It would run on another machine.
    with pytest.raises(BaldwinLabError, match="a callback runs on this machine only"):
        bl.run("evo/A", runs=1, out=tmp_path / "c", executor="slurm", callback=print)
    assert not (tmp_path / "c").exists()


@pytest.fixture(scope="module")
def escaped_study(tmp_path_factory: pytest.TempPathFactory) -> Study:
    """Return a study whose name has a tag of HTML."""
    directory = tmp_path_factory.mktemp("inline") / "<b>small"
    make_small_study(directory, runs=2)
    return bl.open_study(directory)


def drawings(page: str) -> list[ElementTree.Element]:
    return [
        ElementTree.fromstring(base64.b64decode(code))
        for code in re.findall(r"data:image/svg\+xml;base64,([^\"]+)", page)
    ]


def test_a_study_shows_its_content_and_a_curve_per_condition(escaped_study: Study) -> None:
    page = escaped_study._repr_html_()
    assert "evo+self-taught/A: 2 runs" in page
    (drawing,) = drawings(page)
    styles = " ".join(element.get("style", "") for element in drawing.iter())
    strokes = [f"stroke: {choose_style(number).color.lower()}" for number in range(3)]
    assert [stroke in styles for stroke in strokes] == [True, True, False]
    assert "<b>" not in page
    assert len(page) < 150_000
    assert not re.findall(r"""(?:src|href)=["'](?!data:)""", page)


def test_only_its_first_conditions_are_drawn(
    escaped_study: Study, monkeypatch: pytest.MonkeyPatch
) -> None:
    full_length = len(escaped_study._repr_html_())
    monkeypatch.setattr("baldwinlab.api.study.MAX_LISTED_CONDITIONS", 1)
    page = escaped_study._repr_html_()
    assert "and 1 more conditions" in page
    assert len(page) < full_length


def test_a_study_without_runs_or_with_a_damaged_record_has_no_curves(
    tmp_path: Path, escaped_study: Study
) -> None:
    make_small_study(tmp_path / "new", [shorten_preset("evo/A")], runs=0)
    page = bl.open_study(tmp_path / "new")._repr_html_()
    assert "evo/A: 0 runs" in page
    assert not drawings(page)
    make_small_study(tmp_path / "hurt", [shorten_preset("evo/A")], runs=1)
    (record,) = (tmp_path / "hurt").rglob("*.nc")
    record.write_bytes(record.read_bytes()[:-1])
    page = bl.open_study(tmp_path / "hurt")._repr_html_()
    assert record.name in page
    assert not drawings(page)
