"""Whatever happens to a file of a study, who reads it gets what was stored, or a sentence that names the file."""

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
from baldwinlab.lab.live import Live
from baldwinlab.lab.studies import summarize
from baldwinlab.studies.assays.results import open_assay
from baldwinlab.studies.open import open_runs
from tests.faults.amount import amount
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


def files(study: Path) -> list[str]:
    return sorted(str(path.relative_to(study)) for path in study.rglob("*") if path.is_file())


def damage(raw: bytes, chance: random.Random) -> bytes:
    """What a bad disk, a full one, an editor or a careless script may leave of a file."""
    place, noise = chance.randrange(len(raw)), chance.randbytes(20)
    flipped = raw[place] ^ 1 << chance.randrange(8)
    kinds = {
        "a bit flipped": raw[:place] + bytes([flipped]) + raw[place + 1 :],
        "cut short": raw[:place],
        "zeros": raw[:place] + bytes(len(raw) - place),
        "noise within": raw[:place] + noise + raw[place:],
        "noise after it": raw + noise,
        "turned round": raw[place:] + raw[:place],
        "emptied": b"",
    }
    return kinds[chance.choice(list(kinds))]


def listed(study: Path) -> dict[str, Any]:
    """What the lab lists of it."""
    return summarize(Lab(study.parent, Live()), study.name)


def read(study: Path) -> dict[str, xr.Dataset]:
    """All that is read of a study."""
    found = {"runs": open_runs(study)}
    for name in ASSAYS:
        for experiment in CONDITIONS:
            found[f"{name} {experiment.name}"] = open_assay(study, name, experiment.name)
    return found


def test_a_damaged_file_is_named_or_makes_no_difference(study: Path) -> None:
    """Of every file, so many kinds of damage; sessions.jsonl holds how long things took, and nothing of a result."""
    sound = read(study)
    for name in files(study):
        chance, raw, path = random.Random(name), (study / name).read_bytes(), study / name
        for _ in range(amount(200, 8)):
            path.write_bytes(damage(raw, chance))
            try:
                found = read(study)
            except BaldwinLabError as error:
                assert name in str(error).replace(str(study) + "/", "")
                assert len(str(error)) < 1000
            else:
                assert all(found[which].identical(data) for which, data in sound.items()), (
                    name,
                    path.read_bytes()[:500],
                )
            assert listed(study)["id"] == study.name
        path.write_bytes(raw)


def remove(path: Path, other: Path) -> None:
    path.unlink()


def put_another_there(path: Path, other: Path) -> None:
    shutil.copy(other, path)


def make_a_folder_of_it(path: Path, other: Path) -> None:
    path.unlink()
    path.mkdir()


def let_it_lead_nowhere(path: Path, other: Path) -> None:
    path.unlink()
    path.symlink_to("nowhere")


@pytest.mark.parametrize(
    "change", [remove, put_another_there, make_a_folder_of_it, let_it_lead_nowhere]
)
def test_a_file_that_is_another_or_none_is_named_or_makes_no_difference(
    study: Path, tmp_path: Path, change: Change
) -> None:
    sound = read(study)
    for name in files(study):
        copy = tmp_path / name.replace("/", "-")
        shutil.copytree(study, copy)
        others = [
            copy / other
            for other in files(study)
            if other != name and Path(other).suffix == Path(name).suffix
        ]
        change(copy / name, others[0] if others else copy / "study.toml")
        try:
            found = read(copy)
        except BaldwinLabError as error:
            assert name in str(error).replace(str(copy) + "/", "") or name == "study.toml"
        else:
            lost = {"run", "condition"} if change is remove and name.startswith("runs/") else set()
            assert lost or all(found[which].identical(data) for which, data in sound.items()), name
