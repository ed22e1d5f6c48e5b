"""A record is believed only where it is whole, and only in the place that it says it belongs to."""

from __future__ import annotations

import hashlib
import re
import shutil
import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from scipy.io import netcdf_file

from baldwinlab.core.netcdf import from_bytes, to_bytes
from baldwinlab.core.variables import from_storage as all_of
from baldwinlab.simulation.simulate import simulate
from baldwinlab.studies import records
from baldwinlab.studies.creation import create_study
from baldwinlab.studies.open import open_runs
from baldwinlab.studies.records import DamagedRecordError, StudyError, encode, write_record
from baldwinlab.studies.run import find_missing_runs, run_study
from baldwinlab.studies.store import StudyStore
from tests.small_studies import (
    ignore_message,
    ignore_progress,
    make_small_study,
    read_records,
    rewrite_in_format_1,
    shorten_preset,
)


def test_a_run_comes_back_from_its_record_to_the_bit() -> None:
    for stride in (1, 2, 100):
        run = simulate(shorten_preset().replace(record={"genome_every": stride}), seed=2**31 - 1)
        xr.testing.assert_identical(all_of(from_bytes(encode(run))), run)


def test_a_record_is_plain_netcdf_for_any_other_program(tmp_path: Path) -> None:
    path = tmp_path / "run.nc"
    run = simulate(shorten_preset(), seed=1)
    path.write_bytes(encode(run))
    with netcdf_file(path, mmap=False) as file:
        assert np.array_equal(file.variables["food_eaten"][:], run.food_eaten.values)
        assert getattr(file, "condition") == b"evo+self-taught/A"  # noqa: B009


def test_what_a_record_says_of_itself_is_read_without_its_arrays(tmp_path: Path) -> None:
    study = make_small_study(tmp_path)
    assert study.attributes("evo/A", 1) == study.read("evo/A", 1).attrs
    study.path("evo/A", 1).write_bytes(study.path("evo/A", 1).read_bytes()[:-1])
    with pytest.raises(
        DamagedRecordError, match=r"0001\.nc is damaged: its checksum does not fit its content"
    ):
        study.attributes("evo/A", 1)
    with pytest.raises(StudyError, match=r"0009\.nc does not exist"):
        study.attributes("evo/A", 9)


Replace = Callable[[StudyStore], Path]


def _swapped(study: StudyStore) -> Path:
    one, other = study.path("evo/A", 1), study.path("evo+self-taught/A", 1)
    aside = one.with_suffix(".aside")
    one.rename(aside)
    other.rename(one)
    aside.rename(other)
    return one


def _of_another_run(study: StudyStore) -> Path:
    return Path(shutil.copy(study.path("evo/A", 0), study.path("evo/A", 1)))


def _of_another(seed: int = 5, generations: int = 4, rate: float = 0.05) -> Replace:
    def put(study: StudyStore) -> Path:
        experiment = shorten_preset("evo/A").replace(
            evolution={"generations": generations, "mutation_rate": rate}
        )
        path = study.path("evo/A", 1)
        path.write_bytes(encode(simulate(experiment, seed=seed, run=1)))
        return path

    return put


@pytest.mark.parametrize(
    ("replace", "why"),
    [
        (
            _swapped,
            r"it is run 1 of evo\+self-taught/A with seed 5, and run 1 of evo/A with seed 5 belongs there",
        ),
        (_of_another_run, "it is run 0 of evo/A with seed 5, and run 1 of evo/A"),
        (_of_another(seed=6), "it is run 1 of evo/A with seed 6"),
        (
            _of_another(generations=2),
            "the experiment that it was made with is not that of evo/A in this study",
        ),
        (
            _of_another(rate=0.5),
            "the experiment that it was made with is not that of evo/A in this study",
        ),
    ],
    ids=["swapped", "another run", "another seed", "another length", "another rate"],
)
def test_a_record_in_another_s_place_is_named_set_aside_and_computed_again(
    tmp_path: Path, replace: Replace, why: str
) -> None:
    study = make_small_study(tmp_path)
    sound = read_records(tmp_path)
    path = replace(study)
    with pytest.raises(DamagedRecordError, match=f"{path} is damaged: {why}"):
        open_runs(tmp_path)
    with pytest.raises(DamagedRecordError, match=why):
        study.read("evo/A", 1)
    with pytest.raises(DamagedRecordError, match=why):
        study.attributes("evo/A", 1)
    told: list[str] = []
    run_study(study, find_missing_runs(study, 3, told.append), 1, ignore_progress, ignore_message)
    assert any(str(path) in sentence for sentence in told)
    assert read_records(tmp_path) == sound


def test_a_netcdf_file_of_somebody_else_with_a_checksum_is_named(tmp_path: Path) -> None:
    study = make_small_study(tmp_path)
    path = study.path("evo/A", 1)
    path.write_bytes(
        encode(simulate(shorten_preset("evo/A"), seed=5, run=1)).replace(b"condition", b"kondition")
    )
    with pytest.raises(DamagedRecordError, match=r"0001\.nc is damaged"):
        open_runs(tmp_path)


@pytest.mark.parametrize("name", ["1.nc", "00001.nc", "99999999999.nc", "mine.nc", "2147483648.nc"])
def test_a_file_that_could_be_taken_for_a_record_is_named(tmp_path: Path, name: str) -> None:
    study = make_small_study(tmp_path)
    stranger = Path(shutil.copy(study.path("evo/A", 0), study.path("evo/A", 0).with_name(name)))
    with pytest.raises(StudyError, match=f"{stranger} has no name of a record"):
        open_runs(tmp_path)


@pytest.mark.parametrize("kind", ["a folder", "a dangling link"])
def test_what_is_no_file_is_named(tmp_path: Path, kind: str) -> None:
    study = make_small_study(tmp_path)
    path = study.path("evo/A", 7)
    if kind == "a folder":
        path.mkdir()
    else:
        path.symlink_to(tmp_path / "nowhere")
    with pytest.raises(StudyError, match=f"{path} has the name of a record but is not a file"):
        find_missing_runs(study, 3, ignore_message)


def test_an_experiment_that_was_edited_later_is_told_at_once(tmp_path: Path) -> None:
    study = make_small_study(tmp_path)
    path = tmp_path / "runs/evo/A/experiment.toml"
    path.write_text(path.read_text().replace("rate = 0.01", "rate = 0.02"))
    with pytest.raises(
        StudyError,
        match=r"experiment\.toml cannot be read: it has been changed since the study was created",
    ):
        StudyStore(study.directory)


def test_an_edited_experiment_of_an_older_study_is_told_by_its_records(tmp_path: Path) -> None:
    study = make_small_study(tmp_path)
    path = rewrite_in_format_1(tmp_path, list(study.experiments)) / "runs/evo/A/experiment.toml"
    path.write_text(path.read_text().replace("rate = 0.01", "rate = 0.02"))
    with pytest.raises(
        DamagedRecordError,
        match="the experiment that it was made with is not that of evo/A in this study",
    ):
        open_runs(study.directory)


@pytest.mark.parametrize("way", ["study.toml deleted", "folder moved", "folder removed"])
def test_where_the_study_is_gone_no_record_is_written(tmp_path: Path, way: str) -> None:
    directory = tmp_path / "study"
    study = create_study(directory, [shorten_preset("evo/A")], seed=5)
    if way == "study.toml deleted":
        (directory / "study.toml").unlink()
    elif way == "folder moved":
        directory.rename(tmp_path / "elsewhere")
    else:
        shutil.rmtree(directory)
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(FileNotFoundError, match="the study has been removed or moved while it ran"):
        run_study(study, {"evo/A": [0, 1]}, 1, ignore_progress, ignore_message)
    assert [path for path in sorted(tmp_path.rglob("*")) if path.suffix != ".jsonl"] == before
    with pytest.raises(FileNotFoundError):
        write_record(directory, "evo/A", 0, simulate(shorten_preset("evo/A"), seed=5))


def test_a_study_that_goes_while_a_record_is_written_is_told_in_the_same_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    directory = tmp_path / "study"
    create_study(directory, [shorten_preset("evo/A")], seed=5)

    def moved_meanwhile(path: Path, content: bytes) -> None:
        directory.rename(tmp_path / "elsewhere")
        path.write_bytes(content)

    monkeypatch.setattr(records, "write_atomically", moved_meanwhile)
    with pytest.raises(FileNotFoundError, match="the study has been removed or moved while it ran"):
        write_record(directory, "evo/A", 0, simulate(shorten_preset("evo/A"), seed=5))


@pytest.mark.parametrize(
    "foreign", ["other variables", "other sizes", "no coordinates", "text for numbers"]
)
def test_netcdf_that_is_no_run_is_named_though_its_checksum_fits(
    tmp_path: Path, foreign: str
) -> None:
    study = make_small_study(tmp_path / "study", runs=1)
    path = study.path("evo/A", 0)
    run = from_bytes(path.read_bytes())
    path.write_bytes(
        to_bytes(
            {
                "other variables": xr.Dataset({"rain": ("day", np.zeros(3))}, attrs=run.attrs),
                "other sizes": run.isel(generation=slice(2)),
                "no coordinates": run.drop_vars(list(run.coords)),
                "text for numbers": run.assign(energy=run.energy.astype("S1")),
            }[foreign]
        )
    )
    with pytest.raises(
        DamagedRecordError, match=r"0000\.nc is damaged: it does not contain the variables of 3 gen"
    ):
        study.read("evo/A", 0)
    assert find_missing_runs(study, 1, ignore_message)["evo/A"] == [0]


def resealed(raw: bytes) -> bytes:
    """A record with a checksum that fits, whatever its content is."""
    found = re.search(rb"checksum.{8}([0-9a-f]{64})", raw, re.DOTALL)
    assert found is not None
    blank = raw[: found.start(1)] + b"0" * 64 + raw[found.end(1) :]
    return blank.replace(b"0" * 64, hashlib.sha256(blank).hexdigest().encode(), 1)


@pytest.mark.parametrize("field", ["kept_generation", "numrecs"])
def test_a_changed_number_in_the_header_is_named_even_where_the_checksum_fits(
    tmp_path: Path, field: str
) -> None:
    study = make_small_study(tmp_path, [shorten_preset("evo/A")], runs=1)
    path = study.path("evo/A", 0)
    raw = path.read_bytes()
    place = 4 if field == "numrecs" else raw.index(b"kept_generation") + 16
    number = struct.pack(">i", 2**31 - 1 if field == "numrecs" else 0)
    changed = raw[:place] + number + raw[place + 4 :]
    for content, why in (
        (changed, "its checksum does not fit its content"),
        (resealed(changed), "its header counts rows|the generations of its genomes are not those"),
    ):
        path.write_bytes(content)
        with pytest.raises(DamagedRecordError, match=rf"0000\.nc is damaged: .*({why})"):
            study.read("evo/A", 0)
    path.write_bytes(resealed(raw))
    study.read("evo/A", 0)


def test_a_run_is_read_without_its_genomes_where_only_a_few_of_many_are_kept(
    tmp_path: Path,
) -> None:
    study = make_small_study(
        tmp_path / "study", [shorten_preset().replace(record={"genome_every": 3})], runs=1
    )
    whole = study.read("evo+self-taught/A", 0)
    assert whole.genome.shape[0] == 3
    xr.testing.assert_identical(
        study.read("evo+self-taught/A", 0, genomes=False),
        whole.drop_vars(["genome", "module", "weight"]),
    )
