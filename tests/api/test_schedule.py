"""Each simulation of a lifetime outside a run uses the settings of its generation."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import baldwinlab as bl
from baldwinlab.api.compete import _simulate_lives
from baldwinlab.api.freezer import read_genome_file
from baldwinlab.core.errors import RefusedError
from baldwinlab.evolution import GenerationKey
from baldwinlab.experiment.toml import to_toml
from baldwinlab.lab.sources import binary_frames
from baldwinlab.lab.sources.behavior import _simulate
from baldwinlab.lab.sources.frames import WorldCursor
from baldwinlab.lab.sources.inspector import inspect_agent
from baldwinlab.lab.sources.life_query import Life, Span, StartData
from baldwinlab.lab.sources.recording import record_life
from baldwinlab.simulation.reevaluation import make_batch, reevaluate
from baldwinlab.simulation.replay import replay_genomes
from baldwinlab.studies.assays.catalog import get_assay, load_assays
from baldwinlab.studies.assays.reaction import list_settings
from baldwinlab.studies.assays.unseen_maps import draw_maps
from tests.evolution.single_runs import draw_genomes
from tests.worlds import make_small_experiment

CHANGED = 2
LATER = 3
STEPS = 40
BASE = make_small_experiment(
    "evo+self-taught", lifetime={"steps": STEPS}, evolution={"generations": 4}
)
FARTHER = {"senses.visual_radius": 5.0, "learning.rate": 0.5}
SCHEDULED = BASE.replace(schedule=[{"generation": CHANGED, **FARTHER}])
KEY = GenerationKey(4, 0, LATER)
GENOMES = draw_genomes(BASE, KEY)
Simulation = Callable[[Any], Any]


def evaluate(experiment: Any) -> Any:
    results = bl.make_problem(experiment, seed=4, workers=1).evaluate(GENOMES, LATER)
    return np.column_stack(results)


def step_environment(experiment: Any) -> Any:
    env = bl.parallel_env(experiment)
    observations, _ = env.reset(seed=4)
    for _ in range(LATER):
        observations, _ = env.reset()
    values = [np.stack(list(observations.values()))]
    for step in range(STEPS):
        observations, rewards, *_ = env.step(dict.fromkeys(env.agents, step % 3))
        values += [np.stack(list(observations.values())), np.array(list(rewards.values()))]
    return np.concatenate(values, axis=None)


def step_vector(experiment: Any) -> Any:
    env = bl.vector_env(experiment, worlds=2)
    env.reset(seed=4)
    for _ in range(LATER):
        env.reset()
    return np.concatenate([env.step(np.full(env.num_envs, step % 3))[0] for step in range(STEPS)])


def replay_lifetime(experiment: Any) -> Any:
    return replay_genomes(experiment, GENOMES, seed=4, generation=LATER)["eaten"].values


def reevaluate_generation(experiment: Any) -> Any:
    return reevaluate(experiment, 4, [0], LATER, GENOMES[None]).energy


def simulate_batch(experiment: Any) -> Any:
    batch = make_batch(experiment, 4, [0], LATER, GENOMES[None])
    batch.simulate(0, STEPS)
    return batch.eaten_in_life()


def make_life(experiment: Any) -> Life:
    # The inspector reads the parents of the next generation.
    parents = xr.DataArray(np.zeros((LATER + 2, *GENOMES.shape[:1], 2), np.int32))
    return Life(experiment, KEY, lambda: StartData(GENOMES, None, parents))


def inspect_in_lab(experiment: Any) -> Any:
    return np.frombuffer(inspect_agent(make_life(experiment), Span(0, STEPS), 0), np.uint8)


def record_in_lab(experiment: Any) -> Any:
    return np.frombuffer(record_life(make_life(experiment), Span(0, STEPS), {}), np.uint8)


def draw_frames_in_lab(experiment: Any) -> Any:
    snapshots, _ = WorldCursor(make_life(experiment)).read([STEPS], 1e9)
    return np.stack([snapshots[STEPS].eaten, snapshots[STEPS].x])


def measure_behavior_in_lab(experiment: Any) -> Any:
    return np.stack(_simulate(make_life(experiment)))


SIMULATIONS: dict[str, Simulation] = {
    "make_problem": evaluate,
    "parallel_env": step_environment,
    "vector_env": step_vector,
    "replay": replay_lifetime,
    "reevaluate": reevaluate_generation,
    "make_batch": simulate_batch,
    "agent inspector": inspect_in_lab,
    "recording": record_in_lab,
    "frames": draw_frames_in_lab,
    "behavior space": measure_behavior_in_lab,
}


@pytest.mark.parametrize("name", SIMULATIONS)
def test_a_lifetime_has_the_settings_of_its_generation(name: str) -> None:
    simulation = SIMULATIONS[name]
    scheduled, expected, unchanged = map(simulation, (SCHEDULED, SCHEDULED.at(LATER), BASE))
    np.testing.assert_array_equal(scheduled, expected)
    assert not np.array_equal(scheduled, unchanged)


def test_a_schedule_of_the_fitness_changes_the_objective() -> None:
    scheduled = BASE.replace(schedule=[{"generation": CHANGED, "evolution.fitness": "distance"}])
    problem = bl.make_problem(scheduled, seed=4)
    distances = bl.simulate(scheduled, seed=4)
    genomes = distances["genome"].values
    for generation in (CHANGED - 1, CHANGED):
        fitness = problem.evaluate(genomes[generation], generation).fitness
        np.testing.assert_array_equal(fitness, distances["energy"].values[generation])


def test_an_environment_whose_inputs_change_later_is_refused() -> None:
    changed = BASE.replace(schedule=[{"generation": 2, "senses.kinds": ["neighbours"]}])
    with pytest.raises(RefusedError, match=r"at generation 2, .* use experiment.at\(2\)"):
        bl.parallel_env(changed)
    env = bl.parallel_env(changed.at(2))
    assert env.observation_space("agent_0").shape == (3,)


def test_a_fitness_that_depends_on_earlier_generations_is_refused() -> None:
    novelty = BASE.replace(schedule=[{"generation": CHANGED, "evolution.fitness": "novelty"}])
    message = "evolution.fitness = 'novelty' .* depends on the earlier generations of a run"
    for simulation in (evaluate, reevaluate_generation):
        with pytest.raises(RefusedError, match=message):
            simulation(novelty)
    obstacles = {name: get_assay(name).find_obstacle(novelty) for name in load_assays()}
    applicable = {name for name, obstacle in obstacles.items() if not obstacle}
    assert applicable == {"descent", "within-life"}
    innate_only = BASE.replace(evolution={"fitness": "novelty"}).without_learning()
    assert not get_assay("innate").find_obstacle(innate_only)


def test_the_rank_by_such_a_fitness_is_that_of_the_record() -> None:
    novelty = BASE.replace(evolution={"fitness": "novelty"})
    run = bl.simulate(novelty, seed=4)
    start = StartData(run["genome"].values[LATER], run["energy"], run["parents"])
    key = GenerationKey(4, 0, LATER)
    best = int(run["energy"].values[LATER].argmax())
    for fitness, rank in ((run["energy"], 1), (run["energy"][:LATER], None)):
        stored = start._replace(fitness=fitness)
        life = Life(novelty, key, partial(lambda data: data, stored))
        header, _ = binary_frames.unpack(inspect_agent(life, Span(0, STEPS), best))
        assert header["rank"] == rank


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> bl.Study:
    experiment = BASE.replace(
        name="scheduled",
        schedule=[
            {"generation": 1, "world.start.x": 50.0, **FARTHER},
            {"generation": CHANGED, "learning.rule": "none"},
        ],
    )
    return bl.run(experiment, runs=1, out=tmp_path_factory.mktemp("scheduled") / "study", seed=4)


@pytest.mark.parametrize(
    "assay",
    [name for name in load_assays() if name not in ("opponents", "unseen-maps", "fork-mode")],
)
def test_an_assay_of_a_study_whose_agents_stop_learning_gives_the_stored_results(
    study: bl.Study, assay: str
) -> None:
    """An assay raises StudyError if a generation, simulated again, has other results."""
    assert study.assay(assay, "scheduled").sizes["run"] == 1


def test_changed_settings_of_an_assay_start_from_those_of_the_last_generation(
    study: bl.Study,
) -> None:
    experiment = study.experiment("scheduled")
    original, *changed = list_settings(experiment, ())
    assert original.experiment == experiment.at(LATER)
    radii = {setting.value for setting in changed if setting.field == "senses.visual_radius"}
    assert radii == {"1.25", "2.5", "10"}
    assert draw_maps(experiment) == draw_maps(experiment.at(LATER))
    food = [{"x": [5, 15], "y": [5, 15], "count": 3}]
    moved = BASE.replace(schedule=[{"generation": 1, "world.food": food}])
    assert draw_maps(moved) == draw_maps(moved.at(LATER)) != draw_maps(BASE)


def test_a_network_and_a_competition_have_the_settings_of_the_generation_of_their_agents(
    study: bl.Study, tmp_path: Path
) -> None:
    assert study.network(0, 1, 0, module="reinforcement").weights.size
    with pytest.raises(RefusedError, match="module = 'reinforcement' is not a network"):
        study.network(0, LATER, 0, module="reinforcement")
    frozen = tmp_path / "frozen.nc"
    bl.freeze(f"{study.directory}:scheduled@{LATER}", out=frozen)
    experiment = study.experiment("scheduled")
    genomes = read_genome_file(frozen).genome[0]
    lives = bl.compete(frozen, frozen, lives=2).lives
    np.testing.assert_array_equal(
        lives, _simulate_lives(experiment.at(LATER), genomes, genomes, 2, 0)
    )
    first_lives = _simulate_lives(experiment.at(0), genomes, genomes, 2, 0)
    assert (lives != first_lives).any()
    file = tmp_path / "scheduled.toml"
    file.write_text(to_toml(experiment))
    with pytest.raises(RefusedError, match="a competition belongs to no generation"):
        bl.compete(frozen, frozen, experiment=str(file), lives=2)
    settings: dict[str, Any] = {"schedule": []}
    repeated = bl.compete(frozen, frozen, experiment=str(file), set=settings, lives=2)
    np.testing.assert_array_equal(repeated.lives, first_lives)
