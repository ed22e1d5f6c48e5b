"""A sweep is a study whose points have fields. Invalid sweeps are refused before the simulation."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from baldwinlab import sweep
from baldwinlab.experiment import Experiment, ExperimentError
from baldwinlab.experiment.conditions import SWEEP
from baldwinlab.experiment.toml import to_toml
from baldwinlab.simulation.simulate import simulate
from baldwinlab.studies.creation import create_study
from baldwinlab.studies.open import open_runs
from baldwinlab.studies.records import StudyError
from baldwinlab.studies.store import StudyStore
from baldwinlab.studies.sweeps import Sweep, read_sweep
from baldwinlab.studies.sweeps.design import (
    SWEEP_FILE_NAME,
    expand_sweep,
    name_points,
    open_sweep,
)
from tests.small_studies import make_small_study, shorten_preset
from tests.studies.completion import complete_runs, read_files

HEAD = """
experiment = "evo/A"
[set]
lifetime.steps = 100
evolution.generations = 2
population.size = 4
world.start = { x = 380 }
"""
GRID = HEAD + "[fields]\nworld.food.0.count = [0, 50]\nevolution.mutation_rate = [0.5, 0, 0.05]\n"
SOBOL = (
    'design = "sobol"\nsamples = 20\n'
    + HEAD
    + """[fields]
senses.visual_radius = { low = 1, high = 100, scale = "log" }
world.food.0.count = { low = 3, high = 5 }
evolution.selection = ["rank", "roulette"]
contact.reach = { low = 2, high = 20 }
"""
)
VALUES = list(range(101))


def expand_text(text: str, folder: Path) -> list[Experiment]:
    return expand_sweep(read_text(text, folder), folder / "sweep-file.toml")


def read_text(text: str, folder: Path) -> Sweep:
    path = folder / "sweep-file.toml"
    path.write_text(text)
    return read_sweep(path)


def run_sweep(text: str, folder: Path, runs: int) -> StudyStore:
    """Create or resume a sweep in `folder`/sweep with the given number of runs."""
    plan = read_text(text, folder)
    points = expand_sweep(plan, folder / "sweep-file.toml")
    study = create_study(folder / "sweep", points, plan.seed, SWEEP)
    (study.directory / SWEEP_FILE_NAME).write_text(text)
    complete_runs(study, runs)
    return study


@pytest.fixture(scope="module")
def grid(tmp_path_factory: pytest.TempPathFactory) -> StudyStore:
    return run_sweep(GRID, tmp_path_factory.mktemp("grid"), runs=2)


def test_a_grid_contains_all_combinations_of_its_fields(grid: StudyStore) -> None:
    data = open_sweep(grid.directory)
    assert list(data.food_eaten.sizes.items()) == [
        ("world.food.0.count", 2),
        ("evolution.mutation_rate", 3),
        ("run", 2),
        ("generation", 2),
        ("agent", 4),
    ]
    rate = data["evolution.mutation_rate"]
    # The values have the order of the file.
    assert rate.values.tolist() == [0.5, 0, 0.05]
    assert rate.attrs["long_name"] == "probability of a mutation, per weight or per child"
    assert (data.attrs["design"], data.attrs["base"], data.attrs["seed"]) == ("grid", "evo/A", 0)
    eaten = open_sweep(grid.directory).food_eaten.sum(
        ["run", "generation", "agent", "evolution.mutation_rate"]
    )
    assert eaten.sel({"world.food.0.count": 0}) == 0
    assert eaten.sel({"world.food.0.count": 50}) > 0
    study = open_runs(grid.directory)
    assert study["condition"].values.tolist() == [f"point-{number:04d}" for number in range(6)]
    names = name_points(grid)
    assert list(names) == list(grid.experiments)
    assert names["point-0001"] == "world.food.0.count = 0, evolution.mutation_rate = 0.0"


def test_each_point_of_a_grid_contains_the_runs_of_its_experiment(grid: StudyStore) -> None:
    data = open_sweep(grid.directory)
    for experiment in grid.experiments.values():
        point: dict[str, float] = {
            "world.food.0.count": experiment.world.food[0].count,
            "evolution.mutation_rate": experiment.evolution.mutation_rate,
        }
        expected = simulate(experiment, seed=0, run=1).energy
        np.testing.assert_array_equal(data.energy.sel(point).sel(run=1), expected)
        assert str(data.experiment.sel(point).values) == to_toml(experiment)


def test_missing_runs_are_nan_and_can_be_completed_with_identical_results(
    grid: StudyStore, tmp_path: Path
) -> None:
    incomplete = run_sweep(GRID, tmp_path, runs=1)
    incomplete.path("point-0003", 0).unlink()
    data = open_sweep(incomplete.directory)
    assert data.energy.isnull().all(["run", "generation", "agent"]).values.tolist() == [
        [False] * 3,
        [True, False, False],
    ]
    run_sweep(GRID, tmp_path, runs=2)
    xr.testing.assert_identical(open_sweep(incomplete.directory), open_sweep(grid.directory))


def test_a_study_that_is_no_sweep_has_no_points(tmp_path: Path) -> None:
    study = make_small_study(tmp_path / "study", runs=1, workers=1)
    assert name_points(study) == {name: name for name in study.experiments}
    with pytest.raises(StudyError, match=r"is no sweep: it has no sweep\.toml"):
        open_sweep(study.directory)


def test_a_list_design_combines_the_values_of_all_fields_in_order(tmp_path: Path) -> None:
    text = (
        'design = "list"\n'
        + HEAD
        + "[fields]\nnetwork.hidden = [[10], [5, 5]]\n'network.biases' = [true, false]\n"
    )
    data = open_sweep(run_sweep(text, tmp_path, runs=1).directory)
    assert dict(data.energy.sizes) == {"point": 2, "run": 1, "generation": 2, "agent": 4}
    assert data["network.hidden"].values.tolist() == ["[10]", "[5, 5]"]
    assert data["network.biases"].values.tolist() == ["true", "false"]


def test_a_sweep_of_a_single_point_without_runs_can_be_opened(tmp_path: Path) -> None:
    data = open_sweep(
        run_sweep(HEAD + "[fields]\nevolution.elite = [1]\n", tmp_path, runs=0).directory
    )
    assert dict(data.energy.sizes) == {"evolution.elite": 1, "run": 0, "generation": 2, "agent": 4}


@pytest.mark.parametrize("design", ["sobol", "random"])
def test_a_sample_is_reproducible_and_respects_bounds_and_integer_fields(
    design: str, tmp_path: Path
) -> None:
    text = SOBOL.replace('"sobol"', f'"{design}"')
    points = expand_text(text, tmp_path)
    assert points == expand_text(text, tmp_path)
    assert points != expand_text("seed = 1\n" + text, tmp_path)
    assert len(points) == 20
    radii, counts, reaches = np.array(
        [
            (point.senses.visual_radius, point.world.food[0].count, point.contact.reach)
            for point in points
        ]
    ).T
    assert 1 <= radii.min() < 3
    assert 30 < radii.max() <= 100
    # On a log scale, about half of the radii are below 10.
    assert 6 <= np.sum(radii < 10) <= 14
    assert set(counts) == {3, 4, 5}
    assert 2 <= reaches.min() < 6
    assert 16 < reaches.max() <= 20
    assert {point.evolution.selection for point in points} == {"rank", "roulette"}


def test_sobol_points_are_evenly_distributed_in_every_field(tmp_path: Path) -> None:
    text = SOBOL.replace("samples = 20", "samples = 16")
    reaches = [point.contact.reach for point in expand_text(text, tmp_path)]
    assert np.histogram(reaches, bins=16, range=(2, 20))[0].tolist() == [1] * 16


def test_the_experiment_of_a_sweep_can_be_a_file_in_the_same_folder(tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text(to_toml(shorten_preset().replace(name="mine")))
    (point,) = expand_text(
        'experiment = "mine.toml"\n[fields]\n"learning.rate" = [0.25]\n', tmp_path
    )
    assert point == shorten_preset().replace(name="point-0000", learning={"rate": 0.25})


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("[fields]\nlearning.rate = [1]", "experiment: is missing"),
        ('experiment = "evo/Z"\n[fields]\nlearning.rate = [1]', "there is no map 'Z'"),
        (
            GRID.replace("100", "0", 1),
            "lifetime.steps = 0: input should be greater than or equal to 1",
        ),
        (
            "speed = 3\n" + GRID,
            "speed: there is no such key; "
            "there are: experiment, runs, seed, design, samples, set, fields",
        ),
        ("runs = 0\n" + GRID, "runs = 0: input should be greater than or equal to 1"),
        ("seed = 2147483648\n" + GRID, "seed = 2147483648: input should be less than 2147483648"),
        (
            'design = "cube"\n' + GRID,
            "design = 'cube': input should be 'grid', 'list', 'random' or 'sobol'",
        ),
        (HEAD + "[fields]", "fields: name at least one field to sweep"),
        (
            HEAD + "[fields]\nlearning.rat = [1]",
            "fields.learning.rat: there is no 'rat' here; there are: rule, rate",
        ),
        (
            HEAD + "[fields]\nlearning.rate = 1",
            "fields.learning.rate = 1: input should be a valid list",
        ),
        (
            HEAD + "[fields]\nlearning.rate = []",
            "fields.learning.rate = []: list should have at least 1 item",
        ),
        (
            HEAD + "[fields]\nlearning.rate = [1, 11]",
            "point-0001: learning.rate = 11: input should be less than or equal to 10",
        ),
        (HEAD + "[fields]\nlearning.rate = [1, 1.0]", "fields.learning.rate has a value twice"),
        (HEAD + "[fields]\nname = ['a', 'b']", "name: a sweep names its points itself"),
        (
            HEAD + "[fields]\nlifetime.steps = [1]",
            "lifetime.steps: is set here, but lifetime.steps is swept",
        ),
        (
            HEAD + "[fields]\nnetwork.hidden = [[1]]\n'network.hidden.0' = [2]",
            "network.hidden.0: is set here, but network",
        ),
        (
            HEAD + "[fields]\nmotor.noise = [2026-01-01]",
            "fields.motor.noise: a value must be a number",
        ),
        (HEAD + "[fields]\nworld.food = [[{ x = [1, 2] }]]", "world.food.0.y: is missing"),
        (
            HEAD + "motor.noise = 2026-01-01\n[fields]\nlearning = { rate = [2026-01-01] }",
            ".toml: set.motor.noise, fields.learning.rate: a value must be a number",
        ),
        (
            HEAD + "[fields]\nlearning.rate = { low = 0, high = 1 }",
            'a range needs design = "random" or "sobol"; a grid needs',
        ),
        (
            HEAD + "[fields]\nz = { low = 0, high = 1 }\na = { low = 0, high = 1 }\n"
            "learning.rate = [1]\nm = { low = 0, high = 1 }",
            'fields.z, fields.a, fields.m: a range needs design = "random" or "sobol"',
        ),
        ("samples = 3\n" + GRID, 'samples = 3: only design = "random" and "sobol" have samples'),
        (
            'design = "random"\n' + GRID,
            'samples: is missing; design = "random" needs the number of points',
        ),
        ('design = "list"\n' + GRID, "world.food.0.count has 2, evolution.mutation_rate has 3"),
        (
            HEAD + f"[fields]\nlearning.rate = {VALUES}\nrecord.genome_every = {VALUES}",
            "has 10,201 points",
        ),
        (
            SOBOL.replace("high = 100", "high = 0.5"),
            "fields.senses.visual_radius: low 1 must be less than high 0.5",
        ),
        (
            SOBOL.replace("low = 1,", "low = 0,"),
            "fields.senses.visual_radius: low 0 must be more than 0 on a log scale",
        ),
        (
            SOBOL.replace('"log"', '"cube"'),
            "fields.senses.visual_radius.scale = 'cube': input should be 'linear' or 'log'",
        ),
        (
            SOBOL.replace("scale", "shape"),
            "fields.senses.visual_radius.shape: there is no such key; there are: low, high, scale",
        ),
        (
            SOBOL.replace('["rank", "roulette"]', "{ low = 0, high = 1 }"),
            "roulette is not a number; give a list",
        ),
        (
            SOBOL.replace("low = 3, high = 5", "low = 3.2, high = 3.8"),
            "there is no integer from 3.2 to 3.8",
        ),
        ("runs = ", "is not TOML"),
    ],
)
def test_an_invalid_sweep_is_refused_with_the_file_and_the_key(
    text: str, sentence: str, tmp_path: Path
) -> None:
    with pytest.raises(ExperimentError) as error:
        expand_text(text, tmp_path)
    (line,) = str(error.value).splitlines()
    assert line.startswith(str(tmp_path / "sweep-file.toml"))
    assert sentence in line


def test_each_different_error_of_the_points_is_listed_once(tmp_path: Path) -> None:
    text = HEAD + "[fields]\nlearning.rate = [1, 11, 12]\nnetwork.biases = [true, false]\n"
    with pytest.raises(ExperimentError) as error:
        expand_text(text, tmp_path)
    assert [line.split(": ")[1] for line in str(error.value).splitlines()] == [
        "point-0002",
        "point-0004",
    ]


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (
            GRID.replace("[0, 50]", "[0, 10, 50]"),
            "holds another sweep: of 6 points, not 9; choose another --out",
        ),
        (GRID.replace("[0, 50]", "[0, 40]"), "world.food"),
        ("seed = 3\n" + GRID, "its seed is 0, not 3"),
    ],
)
def test_a_directory_with_a_different_sweep_is_refused_and_not_changed(
    text: str, sentence: str, grid: StudyStore, tmp_path: Path
) -> None:
    before = read_files(grid.directory)
    path = tmp_path / "other.toml"
    path.write_text(text)
    with pytest.raises(StudyError, match=sentence):
        sweep(path, out=grid.directory)
    assert read_files(grid.directory) == before
