"""Whatever happens to a file of a study, who reads it gets what was stored, or a sentence that names the file."""

from __future__ import annotations

import random
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import xarray as xr

from baldwinlab.assays import open_assay
from baldwinlab.errors import BaldwinLabError
from baldwinlab.lab import Lab
from baldwinlab.lab.live import Live
from baldwinlab.lab.studies import summary
from baldwinlab.studies.study import open_study
from tests.assays.studies import measured
from tests.faults.amount import amount
from tests.small import small

CONDITIONS = [small("evo/A"), small("evo+self-taught/A")]
ASSAYS = ["innate", "descent"]


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return measured(tmp_path_factory.mktemp("sound"), names=ASSAYS, runs=2, experiments=CONDITIONS).directory


def files(study: Path) -> list[str]:
    return sorted(str(path.relative_to(study)) for path in study.rglob("*") if path.is_file())


def damage(raw: bytes, chance: random.Random) -> bytes:
    """What a bad disk, a full one, an editor or a careless script may leave of a file."""
    place = chance.randrange(len(raw))
    return chance.choice(
        [
            lambda: raw[:place] + bytes([raw[place] ^ 1 << chance.randrange(8)]) + raw[place + 1 :],
            lambda: raw[:place],
            lambda: raw[:place] + bytes(len(raw) - place),
            lambda: raw[:place] + chance.randbytes(20) + raw[place:],
            lambda: raw + chance.randbytes(20),
            lambda: raw[place:] + raw[:place],
            lambda: b"",
        ]
    )()


def listed(study: Path) -> dict[str, Any]:
    """What the lab lists of it."""
    return summary(Lab(study.parent, Live(study.parent)), study.name)


def read(study: Path) -> dict[str, xr.Dataset]:
    """All that is read of a study."""
    found = {"runs": open_study(study)}
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
                assert all(found[which].identical(data) for which, data in sound.items()), (name, path.read_bytes()[:500])
            assert listed(study)["id"] == study.name
        path.write_bytes(raw)


WAYS: dict[str, Callable[[Path, Path], object]] = {
    "removed": lambda path, other: path.unlink(),
    "another's": lambda path, other: shutil.copy(other, path),
    "a folder": lambda path, other: (path.unlink(), path.mkdir()),
    "a link to nowhere": lambda path, other: (path.unlink(), path.symlink_to("nowhere")),
}


@pytest.mark.parametrize("way", WAYS)
def test_a_file_that_is_another_or_none_is_named_or_makes_no_difference(study: Path, tmp_path: Path, way: str) -> None:
    sound = read(study)
    for name in files(study):
        copy = tmp_path / name.replace("/", "-")
        shutil.copytree(study, copy)
        others = [copy / other for other in files(study) if other != name and Path(other).suffix == Path(name).suffix]
        WAYS[way](copy / name, others[0] if others else copy / "study.toml")
        try:
            found = read(copy)
        except BaldwinLabError as error:
            assert name in str(error).replace(str(copy) + "/", "") or name == "study.toml"
        else:
            lost = {"run", "condition"} if way == "removed" and name.startswith("runs/") else set()
            assert lost or all(found[which].identical(data) for which, data in sound.items()), name
