"""Lifetimes of frozen genomes, and of genomes of external optimizers."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import baldwinlab as bl
from baldwinlab.api.freezer import read_frozen
from baldwinlab.api.replay import replay_frozen
from baldwinlab.core.errors import BaldwinLabError
from tests.commands import Command
from tests.small_studies import make_small_study

CONDITION = "evo+self-taught/A"
SHORT = ["lifetime.steps=50"]


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> bl.Study:
    return bl.open_study(make_small_study(tmp_path_factory.mktemp("source") / "study").directory)


@pytest.fixture(scope="module")
def population(study: bl.Study, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("frozen") / "population.nc"
    bl.freeze(f"{study.directory}:{CONDITION}@2[1]", out=path)
    return path


def test_a_replayed_population_has_the_bits_of_the_stored_lifetime(
    study: bl.Study, population: Path
) -> None:
    replayed = replay_frozen(read_frozen(population))
    stored = study.replay(CONDITION, run=1, generation=2)
    assert int(stored.eaten.sum()) > 0
    assert replayed.equals(stored)
    assert bl.replay(genome=population).equals(stored)
    trace = bl.replay(
        genome=population, map="B", set={"lifetime": {"steps": 50}}, seed=6, run=0, generation=1
    )
    frozen = read_frozen(population, map_name="B", assignments=SHORT)
    assert trace.equals(replay_frozen(frozen, seed=6, run=0, generation=1))
    with pytest.raises(BaldwinLabError, match="there is no map 'Z'"):
        bl.replay(genome=population, map="Z")


def test_another_generation_run_or_seed_gives_another_lifetime(population: Path) -> None:
    frozen = read_frozen(population, assignments=SHORT)
    lifetime = replay_frozen(frozen)
    for seed, run, generation in ((6, 1, 2), (5, 0, 2), (5, 1, 0)):
        changed = replay_frozen(frozen, seed=seed, run=run, generation=generation)
        assert not changed.x.equals(lifetime.x)


def test_one_agent_is_replayed_on_another_map(study: bl.Study, tmp_path: Path) -> None:
    bl.freeze(f"{study.directory}:{CONDITION}@1[0]", 4, out=tmp_path / "agent.nc")
    frozen = read_frozen(tmp_path / "agent.nc", map_name="B", assignments=SHORT)
    assert isinstance(frozen.experiment, bl.Experiment)
    assert frozen.experiment.world == bl.load("evo+self-taught/B").world
    trace = replay_frozen(frozen)
    assert trace.sizes["agent"] == 1
    genome = study.genomes(0, 1, 4, condition=CONDITION)
    np.testing.assert_array_equal(trace.weight_birth.values[0], genome.values)


@pytest.mark.parametrize("shape", [(-1,), (1, -1), (1, 2, -1), (1, 1, 2, -1)])
def test_an_array_of_an_optimizer_needs_an_experiment(
    tmp_path: Path, shape: tuple[int, ...]
) -> None:
    experiment = bl.load(CONDITION).replace(population={"size": 1})
    genome = bl.make_problem(experiment, seed=1).founders(1)
    np.save(tmp_path / "best.npy", genome.reshape(shape))
    frozen = read_frozen(tmp_path / "best.npy", CONDITION, assignments=SHORT)
    np.testing.assert_array_equal(replay_frozen(frozen).weight_birth.values.ravel(), genome[0])
    with pytest.raises(BaldwinLabError, match="names no experiment; give the experiment"):
        read_frozen(tmp_path / "best.npy")


def test_the_command_replay_writes_the_lifetime_of_a_genome_file(
    command: Command, population: Path, tmp_path: Path
) -> None:
    options = ("--genome", str(population), "--set", *SHORT)
    for name in ("life.nc", "life.png"):
        outcome = command("replay", *options, "--out", name)
        assert outcome.code == 0, outcome.err
    with xr.open_dataset(tmp_path / "life.nc") as trace:
        assert trace.sizes["step"] == 50
    genomes = np.zeros((3, 60), np.float32)
    np.save(tmp_path / "best.npy", genomes)
    outcome = command("replay", "evo/B", "--genome", "best.npy", "--set", *SHORT, "--out", "b.nc")
    assert outcome.out == "b.nc: 50 steps, 3 agents, 0 items eaten\n", outcome.err


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ([], "give the directory of a study, or a genome file with --genome FILE"),
        (["study"], "study: add --run RUN and --generation GENERATION"),
        (
            ["study", "--run", "0", "--generation", "0", "--map", "B"],
            "--seed, --map and --set apply to --genome FILE",
        ),
        (["--genome", "missing.nc"], "the genome file missing.nc cannot be read: No such file"),
        (["--genome", "FILE", "--condition", "x"], "--condition x applies to a study"),
        (["--genome", "FILE", "--map", "Q"], "there is no map 'Q'"),
        (["evo/A", "--genome", "FILE"], "do not fit evo/A: their modules"),
        (["--genome", "FILE", "--set", "population.size=3"], "must be 20, the number of genomes"),
        (["--genome", "FILE", "--seed", "-1"], "--seed -1 must be a whole number from 0"),
        (["hinton-nowlan-1987:guessing", "--genome", "FILE"], "do not fit"),
        (["evo/A", "--genome", "nan.npy"], "gene 3 of the module 'action' of agent 0 is not"),
    ],
)
def test_a_bad_request_is_refused_with_one_sentence(
    command: Command, population: Path, tmp_path: Path, arguments: list[str], sentence: str
) -> None:
    genome = np.zeros(60, np.float32)
    genome[3] = np.nan
    np.save(tmp_path / "nan.npy", genome)
    words = [str(population) if word == "FILE" else word for word in arguments]
    outcome = command("replay", *words, "--out", "life.nc")
    assert outcome.code == 2
    assert sentence in outcome.err
    assert outcome.err.count("\n") == 1
    assert not (tmp_path / "life.nc").exists()


def test_a_file_of_several_runs_needs_the_number_of_a_run(study: bl.Study, tmp_path: Path) -> None:
    bl.freeze(f"{study.directory}:{CONDITION}@1", out=tmp_path / "all.nc")
    frozen = read_frozen(tmp_path / "all.nc", assignments=SHORT)
    with pytest.raises(BaldwinLabError, match="of the runs 0, 1, 2: choose one with --run"):
        replay_frozen(frozen)
    with pytest.raises(BaldwinLabError, match="of the runs 0, 1, 2: not of run 3"):
        replay_frozen(frozen, run=3)
    np.testing.assert_array_equal(
        replay_frozen(frozen, run=2).weight_birth, study.genomes(2, 1, condition=CONDITION)
    )


def test_a_replay_has_an_experiment_or_a_genome_file(study: bl.Study, population: Path) -> None:
    experiment = study.experiment(CONDITION)
    expected = study.replay(CONDITION, run=1, generation=2)
    assert bl.replay(experiment, seed=study.seed, run=1, generation=2).equals(expected)
    assert bl.replay(experiment, genome=population).equals(expected)
    energy = study.data().energy.sel(condition=CONDITION, run=1)
    refused = {
        "give an experiment, or a genome file": {},
        "map and set apply to a genome file": {"experiment": experiment, "map": "B"},
        "energy applies to an experiment": {"genome": population, "energy": energy},
    }
    replay: Any = bl.replay
    for message, arguments in refused.items():
        with pytest.raises(BaldwinLabError, match=message):
            replay(**arguments)
