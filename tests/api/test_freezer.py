"""Frozen populations begin new studies."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import baldwinlab as bl
from baldwinlab.api.freezer import encode_population, parse_population
from baldwinlab.core.errors import BaldwinLabError
from baldwinlab.evolution import genome_file
from baldwinlab.evolution.genome_file import decode_genomes
from baldwinlab.experiment.toml import from_toml
from baldwinlab.studies.store import StudyStore
from tests.commands import Command
from tests.small_studies import make_small_study, read_records, shorten_preset

SETTINGS = {"evolution.generations": 2, "lifetime.steps": 100}


@pytest.fixture(scope="module")
def source(tmp_path_factory: pytest.TempPathFactory) -> StudyStore:
    return make_small_study(tmp_path_factory.mktemp("source") / "study", runs=2)


def read_genomes(study: StudyStore, run: int = 0) -> Any:
    """Return the genomes of the last generation."""
    return bl.open_study(study.directory).genomes(run, 2, condition="evo/A").values


def test_a_reference_names_a_population(source: StudyStore) -> None:
    population = parse_population(f"{source.directory}:evo+self-taught/A@2[1]")
    assert population[1:] == ("evo+self-taught/A", 2, 1)
    assert population.study.directory == source.directory
    assert parse_population(f"{source.directory}:evo/A@0").run is None
    for reference in ("x", "x:evo/A", "x@3", ":evo/A@3", "x:evo/A@-1"):
        with pytest.raises(BaldwinLabError):
            parse_population(reference)


def test_a_frozen_population_has_the_genomes_of_the_study(source: StudyStore) -> None:
    population = parse_population(f"{source.directory}:evo/A@1")
    genomes = decode_genomes(encode_population(population), "file.nc").genome
    study = bl.open_study(source.directory)
    for run in range(2):
        expected = study.genomes(run, 1, condition="evo/A").values
        np.testing.assert_array_equal(genomes[run], expected)
    agent = decode_genomes(encode_population(population, agent=3), "file.nc").genome
    np.testing.assert_array_equal(agent, genomes[:, 3:4])


def test_freeze_writes_a_file_with_the_experiment_and_the_origin(
    source: StudyStore, tmp_path: Path
) -> None:
    frozen = bl.freeze(f"{source.directory}:evo/A@1[1]", 3, out=tmp_path / "agent.nc")
    content = (tmp_path / "agent.nc").read_bytes()
    assert frozen.sha256 == hashlib.sha256(content).hexdigest()
    assert (frozen.n_runs, frozen.n_agents) == (1, 1)
    origin = decode_genomes(content, "agent.nc").origin
    expected = {"condition": "evo/A", "seed": 5, "generation": 1, "runs": 1, "agent": 3}
    assert {name: origin[name] for name in expected} == expected
    assert from_toml(origin["experiment"], "agent.nc") == source.experiment("evo/A")


@pytest.mark.parametrize(
    ("reference", "agent", "out", "sentence"),
    [
        ("{study}:evo/A@9", None, "a.nc", "generation = 9 must be a whole number from 0 to 2"),
        ("{study}:evo/A@1", 99, "a.nc", "agent = 99 must be a whole number from 0 to 19"),
        ("{study}:evo/A@1[7]", None, "a.nc", "7"),
        ("{study}:evo/C@1", None, "a.nc", "has no condition"),
        ("{study}", None, "a.nc", "must be STUDY:CONDITION@GENERATION"),
        ("{study}:evo/A@1", None, "a.npy", "must end in .nc"),
        ("{study}:evo/A@1", None, "other.nc", "was not written by this command"),
    ],
)
def test_a_bad_request_to_freeze_is_refused_before_anything_is_written(
    source: StudyStore, tmp_path: Path, reference: str, agent: int | None, out: str, sentence: str
) -> None:
    (tmp_path / "other.nc").write_text("another program")
    with pytest.raises(BaldwinLabError, match=sentence):
        bl.freeze(reference.format(study=source.directory), agent, out=tmp_path / out)
    assert [path.name for path in tmp_path.iterdir()] == ["other.nc"]


def test_a_condition_without_runs_cannot_be_frozen(tmp_path: Path) -> None:
    names = ("evo/A", "self-taught/A")
    study = make_small_study(tmp_path / "study", [shorten_preset(name) for name in names])
    for file in study.files("self-taught/A"):
        file.path.unlink()
    with pytest.raises(BaldwinLabError, match="holds no finished run of self-taught/A yet"):
        bl.freeze(f"{study.directory}:self-taught/A@1", out=tmp_path / "a.nc")


def test_the_command_freeze_prints_the_numbers_of_agents_and_overwrites_only_its_files(
    command: Command, source: StudyStore, tmp_path: Path
) -> None:
    reference = f"{source.directory}:evo/A@1"
    for _ in range(2):
        outcome = command("freeze", reference, "--out", "all.nc")
        assert outcome.out == "all.nc: 20 agents of 2 runs\n", outcome.err
    record = json.loads(command("freeze", reference, "--out", "all.nc", "--json").out)
    digest = hashlib.sha256((tmp_path / "all.nc").read_bytes()).hexdigest()
    assert record == {"path": "all.nc", "sha256": digest, "n_runs": 2, "n_agents": 20}


def test_a_study_begins_with_the_population_of_another_on_another_map(
    source: StudyStore, tmp_path: Path
) -> None:
    reference = f"{source.directory}:evo/A@2"
    study = bl.run("evo/B", runs=2, out=tmp_path / "new", set=SETTINGS, founders=reference)
    for run in range(2):
        np.testing.assert_array_equal(
            study.genomes(run, 0).values,
            read_genomes(source, run),
        )
    before = study.data().copy(deep=True)
    repeated = bl.run("evo/B", runs=2, out=tmp_path / "new", set=SETTINGS, founders=reference)
    assert repeated.data().identical(before)
    # The records do not depend on the path of the study.
    bl.run("evo/B", runs=2, out=tmp_path / "second", set=SETTINGS, founders=reference)
    assert read_records(tmp_path / "second") == read_records(tmp_path / "new")


@pytest.mark.parametrize(
    ("experiment", "reference", "runs", "sentence"),
    [
        ("evo/B", "{study}:evo/A@2", 3, "has the genomes of 2 runs"),
        ("evo+self-taught/B", "{study}:evo/A@2", 1, "do not fit"),
        ("evo/B", "{study}:evo/A@9", 1, "generation"),
        ("evo/B", "{study}:evo/C@1", 1, "has no condition"),
        ("evo/B", "{study}:evo/A@1=0.5", 1, "the shares must add up to 1"),
        ("evo/B", "{study}:evo/A@1=1.2.3", 1, "share"),
        ("evo/B", "{study}", 1, "must be STUDY:CONDITION@GENERATION"),
        ("evo/B", "missing.nc", 1, "missing.nc cannot be read"),
    ],
)
def test_founders_that_do_not_fit_are_refused_before_anything_is_written(
    source: StudyStore, tmp_path: Path, experiment: str, reference: str, runs: int, sentence: str
) -> None:
    reference = reference.format(study=source.directory)
    with pytest.raises(BaldwinLabError, match=sentence):
        bl.run(experiment, runs=runs, out=tmp_path / "new", set=SETTINGS, founders=reference)
    assert not (tmp_path / "new").exists()


def test_other_founders_in_the_same_directory_are_refused(
    source: StudyStore, tmp_path: Path
) -> None:
    directory = tmp_path / "new"
    first, second = (f"{source.directory}:evo/A@{generation}" for generation in (1, 2))
    bl.run(shorten_preset("evo/A"), runs=1, out=directory, founders=first)
    with pytest.raises(BaldwinLabError, match="holds a study with other founders"):
        bl.run(shorten_preset("evo/A"), runs=1, out=directory, founders=second)


def forget_files(monkeypatch: pytest.MonkeyPatch) -> None:
    """Forget which files this process has seen, as another process does not know them."""
    monkeypatch.setattr("baldwinlab.experiment.file._PATHS", {})
    genome_file.read_genomes.cache_clear()


def test_founders_of_two_studies_with_one_condition_and_generation_are_both_kept(
    source: StudyStore, tmp_path: Path
) -> None:
    second_source = make_small_study(tmp_path / "second", runs=2, seed=6)
    references = [f"{study.directory}:evo/A@2" for study in (source, second_source)]
    study = bl.run("evo/B", runs=2, out=tmp_path / "new", set=SETTINGS, founders=references)
    paths = [entry.path for entry in study.experiment("evo/B").evolution.founders]
    assert len({*paths}) == 2
    assert sorted(paths) == sorted(
        path.relative_to(study.directory).as_posix()
        for path in study.directory.glob("inputs/evo-A-generation-2-*.nc")
    )
    genomes = study.genomes(0, 0).values
    for first_agent, origin in ((0, source), (10, second_source)):
        population = read_genomes(origin)
        copies = (genomes[first_agent : first_agent + 10, None] == population).all(axis=(2, 3))
        assert copies.any(axis=1).all()


@pytest.mark.parametrize("name", ["new", "a b/c=d"])
def test_a_study_with_founders_works_without_the_other_study(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    monkeypatch.chdir(tmp_path)
    make_small_study(Path("base"), runs=2)
    bl.run("evo/B", runs=1, out=name, set=SETTINGS, founders="base:evo/A@2")
    forget_files(monkeypatch)
    Path("base").rename("renamed")
    Path(name).rename("moved")
    monkeypatch.chdir(tmp_path / "renamed")
    study = bl.open_study("../moved")
    study.extend(3, runs=2)
    assert study.assay("innate").sizes["run"] == 2
    assert study.replay(run=0, generation=0).sizes["agent"] == 20
    study.export(tmp_path / "new.csv")
    repeated = bl.open_study(tmp_path / "renamed").genomes(1, 2, condition="evo/A").values
    np.testing.assert_array_equal(study.genomes(1, 0).values, repeated)


def test_genome_files_of_one_name_are_both_kept(source: StudyStore, tmp_path: Path) -> None:
    genomes = read_genomes(source)
    for folder, values in (("first", genomes), ("second", genomes[::-1])):
        (tmp_path / folder).mkdir()
        np.save(tmp_path / folder / "genomes.npy", values)
    paths = [str(tmp_path / folder / "genomes.npy") for folder in ("first", "second")]
    study = bl.run("evo/B", runs=1, out=tmp_path / "new", set=SETTINGS, founders=paths)
    assert len([*study.directory.glob("inputs/genomes-*.npy")]) == 2


def test_genomes_that_are_not_finite_are_refused_with_their_index(
    source: StudyStore, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    genomes = read_genomes(source).copy()
    for value in (np.nan, np.inf, -np.inf):
        genomes[7, 0, 5] = value
        np.save("wrong.npy", genomes)
        message = rf"gene 5 of the module 'action' of genome 7 is {value:g}; every gene"
        with pytest.raises(BaldwinLabError, match=rf"wrong\.npy: {message}"):
            bl.run("evo/B", runs=1, out="new", set=SETTINGS, founders="wrong.npy")
    assert [path.name for path in tmp_path.iterdir()] == ["wrong.npy"]


def test_a_study_in_remote_storage_keeps_its_founders(
    source: StudyStore, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    reference = f"{source.directory}:evo/A@2"
    bl.run("evo/B", runs=1, out="memory://founders/new", set=SETTINGS, founders=reference)
    forget_files(monkeypatch)
    study = bl.open_study("memory://founders/new")
    study.extend(runs=2)
    bl.run("evo/B", runs=2, out="local", set=SETTINGS, founders=reference)
    for run in range(2):
        expected = bl.open_study("local").genomes(run, 1).values
        np.testing.assert_array_equal(study.genomes(run, 1).values, expected)
    assert [path.name for path in tmp_path.iterdir()] == ["local"]


def test_another_file_is_refused_without_the_word_checksum(tmp_path: Path) -> None:
    for content in (b"", b"text", b"CDF\x01\0\0\0\0"):
        (tmp_path / "other.nc").write_bytes(content)
        message = "is no genome file: give a file of `baldwinlab fr"
        with pytest.raises(BaldwinLabError, match=message):
            bl.run("evo/B", runs=1, out=tmp_path / "new", founders=str(tmp_path / "other.nc"))
    assert not (tmp_path / "new").exists()
