"""A study is found from any working directory, and messages show paths as the user knows them."""

from __future__ import annotations

import os
import shlex
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import baldwinlab as bl
from baldwinlab.core.files import make_absolute, parse_location, quote_path, shorten_path
from baldwinlab.studies.assays.results import open_assay
from baldwinlab.studies.store import StudyStore
from tests.commands import Command
from tests.small_studies import make_small_study, shorten_preset


@pytest.fixture(scope="module")
def base(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_small_study(tmp_path_factory.mktemp("studies") / "base", runs=2).directory


@pytest.fixture
def second_folder(base: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return another directory. The working directory is that of the study."""
    monkeypatch.chdir(base.parent)
    return tmp_path


def test_an_open_study_is_found_from_another_directory(base: Path, second_folder: Path) -> None:
    study = bl.open_study("base")
    data = bl.open_study("base").data()
    os.chdir(second_folder)
    assert study.directory == base
    assert study.data().sizes["run"] == 2
    assert study.genomes(0, 1, condition="evo/A").sizes["agent"] == 20
    np.testing.assert_array_equal(data.energy.values, study.data().energy.values)


@pytest.mark.parametrize("out", ["new", "./new", "a b/c=d", "../beside", "link/new"])
def test_a_study_that_run_returns_is_found_from_another_directory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, out: str
) -> None:
    start = tmp_path / "start"
    (start / "target").mkdir(parents=True)
    (start / "link").symlink_to(start / "target", target_is_directory=True)
    monkeypatch.chdir(start)
    study = bl.run(shorten_preset("evo/A"), runs=1, out=out)
    monkeypatch.chdir(tmp_path / "start" / "target")
    assert study.data().sizes["run"] == 1
    study.extend(runs=2)
    assert StudyStore(start / out).runs("evo/A") == [0, 1]


def test_a_callback_can_change_the_directory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "second").mkdir()

    def change_directory(run: xr.Dataset) -> None:
        os.chdir(tmp_path / "second")

    study = bl.run(shorten_preset("evo/A"), runs=2, out="new", callback=change_directory)
    assert study.directory == tmp_path / "new"
    assert study.data().sizes["run"] == 2
    assert not any((tmp_path / "second").iterdir())


def test_a_message_shows_a_path_in_the_working_directory_as_a_relative_path(
    base: Path, second_folder: Path
) -> None:
    assert str(shorten_path(base)) == "base"
    assert str(shorten_path(make_absolute(Path("../x")))) == "../x"
    assert shorten_path(second_folder) == second_folder
    assert repr(bl.open_study("base")).startswith("<Study base, ")
    assert quote_path(Path("a b")) == "'a b'"
    # An address of remote storage and an absolute path are unchanged.
    for text in ("memory://bucket/study", "memory://a b/c=d"):
        location = parse_location(text)
        assert str(make_absolute(location)) == str(shorten_path(location)) == str(location) == text
    assert make_absolute(second_folder) == second_folder


def test_the_remedy_of_a_missing_assay_works_if_it_is_pasted(
    command: Command, tmp_path: Path
) -> None:
    make_small_study(tmp_path / "my studies" / "it's", runs=1)
    with pytest.raises(bl.StudyError, match="does not exist; `") as caught:
        open_assay("my studies/it's", "innate", "evo/A")
    _, *words = shlex.split(str(caught.value).split("`")[1])
    assert command(*words).code == 0
    assert open_assay("my studies/it's", "innate", "evo/A").sizes["run"] == 1
