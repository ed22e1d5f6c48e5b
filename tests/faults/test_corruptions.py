"""Reading a study with a damaged file returns the stored values or an error that names the file."""

from __future__ import annotations

import random
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import xarray as xr

from baldwinlab.core.errors import BaldwinLabError
from baldwinlab.lab import Lab
from baldwinlab.lab.sources.live import Live
from baldwinlab.lab.sources.studies import summarize
from baldwinlab.studies.assays.results import open_assay
from baldwinlab.studies.open import open_runs
from tests.faults import amount
from tests.small_studies import shorten_preset
from tests.studies.assays.studies import make_small_study_with_assays

CONDITIONS = [shorten_preset("evo/A"), shorten_preset("evo+self-taught/A")]
ASSAYS = ["innate", "descent"]

Change = Callable[[Path, Path], None]


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_small_study_with_assays(
        tmp_path_factory.mktemp("sound"), names=ASSAYS, runs=2, experiments=CONDITIONS
    ).directory


def list_files(study: Path) -> list[str]:
    return sorted(str(path.relative_to(study)) for path in study.rglob("*") if path.is_file())


def damage(raw: bytes, random_source: random.Random) -> bytes:
    """Return the content of a file after a random kind of damage."""
    offset = random_source.randrange(len(raw))
    noise = random_source.randbytes(20)
    flipped = raw[offset] ^ 1 << random_source.randrange(8)
    kinds = {
        "a bit flipped": raw[:offset] + bytes([flipped]) + raw[offset + 1 :],
        "cut short": raw[:offset],
        "zeros": raw[:offset] + bytes(len(raw) - offset),
        "noise within": raw[:offset] + noise + raw[offset:],
        "noise after it": raw + noise,
        "turned round": raw[offset:] + raw[:offset],
        "emptied": b"",
    }
    return kinds[random_source.choice(list(kinds))]


def summarize_in_lab(study: Path) -> dict[str, Any]:
    """Return the summary of a study in the lab."""
    return summarize(Lab(study.parent, Live()), study.name)


def read_study(study: Path) -> dict[str, xr.Dataset]:
    """Return the runs and assays of a study."""
    values = {"runs": open_runs(study)}
    for name in ASSAYS:
        for experiment in CONDITIONS:
            values[f"{name} {experiment.name}"] = open_assay(study, name, experiment.name)
    return values


def test_a_damaged_file_is_named_or_has_no_effect(study: Path) -> None:
    """Every file is damaged in several ways. sessions.jsonl contains durations but no results."""
    sound = read_study(study)
    for name in list_files(study):
        random_source = random.Random(name)
        path = study / name
        raw = path.read_bytes()
        for _ in range(amount(200, 8)):
            path.write_bytes(damage(raw, random_source))
            try:
                values = read_study(study)
            except BaldwinLabError as error:
                assert name in str(error).replace(str(study) + "/", "")
                assert len(str(error)) < 1000
            else:
                assert all(values[key].identical(data) for key, data in sound.items()), (
                    name,
                    path.read_bytes()[:500],
                )
            assert summarize_in_lab(study)["id"] == study.name
        path.write_bytes(raw)


def remove_file(path: Path, replacement: Path) -> None:
    path.unlink()


def replace_with_different_file(path: Path, replacement: Path) -> None:
    shutil.copy(replacement, path)


def replace_with_folder(path: Path, replacement: Path) -> None:
    path.unlink()
    path.mkdir()


def replace_with_dangling_link(path: Path, replacement: Path) -> None:
    path.unlink()
    path.symlink_to("nowhere")


@pytest.mark.parametrize(
    "change",
    [remove_file, replace_with_different_file, replace_with_folder, replace_with_dangling_link],
)
def test_a_replaced_or_missing_file_is_named_or_has_no_effect(
    study: Path, tmp_path: Path, change: Change
) -> None:
    sound = read_study(study)
    for name in list_files(study):
        copy = tmp_path / name.replace("/", "-")
        shutil.copytree(study, copy)
        candidates = [
            copy / file
            for file in list_files(study)
            if file != name and Path(file).suffix == Path(name).suffix
        ]
        change(copy / name, candidates[0] if candidates else copy / "study.toml")
        try:
            values = read_study(copy)
        except BaldwinLabError as error:
            assert name in str(error).replace(str(copy) + "/", "") or name == "study.toml"
        else:
            may_miss = (
                {"run", "condition"}
                if change is remove_file and name.startswith("runs/")
                else set()
            )
            assert may_miss or all(values[key].identical(data) for key, data in sound.items()), name
