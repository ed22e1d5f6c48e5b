"""Records of parts, results of lifetimes in fitness and selection, and arrays of a run."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import baldwinlab as bl
from baldwinlab.core.errors import RefusedError
from baldwinlab.engine.rng import Stream, draw
from baldwinlab.evolution import GenerationKey, needs_simulation
from baldwinlab.experiment import Experiment, ExperimentError, registry
from baldwinlab.lab.pages.export import render_live_page
from baldwinlab.parts import Fitness, per_agent, per_run
from baldwinlab.parts.loading import load_file, parts_in
from baldwinlab.simulation.records import make_record
from baldwinlab.simulation.replay import recompute_genomes
from baldwinlab.simulation.simulate import simulate_batch, simulate_histories
from baldwinlab.studies.creation import create_study
from tests.evolution.single_runs import apply_inheritance, draw_genomes
from tests.small_studies import make_small_study, read_records
from tests.studies.completion import complete_runs, require_continuable, stop_after_generations
from tests.worlds import make_small_experiment

PARTS = """
import numpy as np
from baldwinlab.parts import (
    Fitness, Inheritance, LearningRule, Selection, draw, get, per_agent, per_run, put
)


class Clock(Fitness, name="clock"):
    records = {
        "age_in_steps": per_agent("int32", unit="steps", help="steps since birth"),
        "sum_of_x": per_agent("float32", unit="units of length"),
    }
    arrays = {"mean_x": per_run(2)}

    @staticmethod
    def end_step(part, model, state, world, step):
        for agent in range(model.agents):
            lane = world * model.agents + agent
            part.age_in_steps[0, lane] += 1
            part.sum_of_x[0, lane] += get(state.positions, 0, lane)

    @staticmethod
    def evaluate(part, lifetimes, fitness):
        for agent in range(fitness.size):
            x = lifetimes.records.sum_of_x[agent]
            fitness[agent] = max(0.0, x - part.mean_x[0] / 2)
            part.mean_x[0] = 0.9 * part.mean_x[0] + 0.1 * x
        part.mean_x[1] += 1


class Draws(Selection, name="draws"):
    arrays = {"generations": per_run(dtype="int32")}

    @staticmethod
    def select(part, generation):
        parents = generation.parents
        part.generations[0] += 1
        for child in range(parents.shape[0]):
            for parent in range(2):
                number = 2 * child + parent
                luck = draw(generation.stream, number)
                parents[child, parent] = int(luck * generation.fitness.size)
            if part.generations[0] % 2 == 0:
                parents[child, 0] = child


class Numbered(Inheritance, name="numbered"):
    arrays = {"births": per_run()}

    @staticmethod
    def inherit(part, innate_genome, learned, inherited_genome):
        part.births[0] += 1
        for weight in range(learned.size):
            inherited_genome[0, weight] = part.births[0]
"""
UNKNOWN_RECORD = """
from baldwinlab.parts import Fitness


class Reads(Fitness, name="reads-missing"):
    @staticmethod
    def evaluate(part, lifetimes, fitness):
        for agent in range(fitness.size):
            fitness[agent] = lifetimes.records.missing[agent]
"""
SAME_RECORD = """
from baldwinlab.parts import Fitness, WorldFeature, per_agent


class First(WorldFeature, name="first-record"):
    records = {"number": per_agent()}


class Second(WorldFeature, name="second-record"):
    records = {"number": per_agent()}
"""


@pytest.fixture(scope="module", autouse=True)
def parts(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    loaded: list[Any] = []
    for name, text in {"p": PARTS, "unknown": UNKNOWN_RECORD, "same": SAME_RECORD}.items():
        path = tmp_path_factory.mktemp("parts") / f"{name}.py"
        path.write_text(text)
        loaded += parts_in(load_file(path))
    yield
    for part in loaded:
        registry.remove(part.kind, part.name)


def make_experiment(**changes: Any) -> Experiment:
    return make_small_experiment(
        "evo",
        **{"evolution": {"fitness": "clock", "selection": "draws", "generations": 5}} | changes,
    )


def test_a_record_has_the_number_that_the_part_wrote_for_each_agent() -> None:
    experiment = make_experiment()
    (data,) = simulate_batch(experiment, 1, [0])
    assert (data.age_in_steps == experiment.steps).all()
    assert data.age_in_steps.dtype == np.int32
    assert data.sum_of_x.attrs == {
        "units": "units of length",
        "long_name": "record sum_of_x",
    }
    assert data.energy[0, 0] == data.sum_of_x[0, 0]


def test_records_do_not_change_the_lifetimes() -> None:
    plain = make_small_experiment("evo")
    (expected,) = simulate_batch(plain, 1, [0])
    (data,) = simulate_batch(make_experiment(), 1, [0])
    assert np.array_equal(data.food_eaten[0], expected.food_eaten[0])


@pytest.mark.nightly
def test_the_records_of_a_newborn_in_mid_life_begin_at_0() -> None:
    experiment = bl.load("evo/births-and-deaths").replace(
        evolution={"fitness": "clock", "generations": 1}, lifetime={"steps": 300}
    )
    (data,) = simulate_batch(experiment, 1, [0])
    is_newborn = data.born[0] > 0
    assert is_newborn.any()
    assert (data.age_in_steps[0] < 300)[is_newborn].all()
    assert (data.age_in_steps[0] == 300)[~is_newborn].all()


@pytest.mark.parametrize("stored", [1, 3, 5])
def test_a_continued_run_has_the_bits_of_an_uninterrupted_one(stored: int) -> None:
    experiment = make_experiment()
    require_continuable(experiment, stored)
    # The array before the last generation has counted the earlier ones.
    (complete,) = simulate_histories(experiment, 3, [0])
    assert make_record(complete)["run_array.0.fitness.clock.mean_x"].values[1] == 4


def test_a_stopped_study_continues_from_its_checkpoints_to_the_same_bits(tmp_path: Path) -> None:
    experiment = make_experiment()
    study = create_study(tmp_path / "stopped", [experiment], seed=5)
    stop_after_generations(study, runs=2, count=3)
    assert list(study.directory.rglob("*.checkpoint"))
    complete_runs(study, 2)
    complete = make_small_study(tmp_path / "complete", [experiment], runs=2)
    assert read_records(study.directory) == read_records(complete.directory)
    data = bl.open_study(study.directory).data()
    assert "sum_of_x" in data
    assert not [name for name in data.variables if str(name).startswith("run_array")]


def test_genomes_of_a_selection_that_reads_lifetimes_are_simulated_again() -> None:
    experiment = make_experiment()
    assert needs_simulation(experiment)
    assert not needs_simulation(make_small_experiment("evo"))
    (data,) = simulate_batch(experiment, 1, [0])
    genomes = recompute_genomes(experiment, GenerationKey(1, 0, 4), data.energy)
    assert np.array_equal(genomes, data.genome[4])


def test_draws_of_a_stream_are_uniform_and_differ() -> None:
    stream = Stream(seed=1, run=0, generation=2, purpose=3)
    with np.errstate(over="ignore"):
        numbers = np.array([draw(stream, number) for number in range(2000)])
        assert draw(stream, 7) == numbers[7]
    assert len(np.unique(numbers)) == 2000
    assert 0 < numbers.min() < numbers.max() < 1
    assert abs(numbers.mean() - 0.5) < 4 / np.sqrt(12 * 2000)


def test_a_record_that_no_part_declares_is_refused() -> None:
    with pytest.raises(ExperimentError) as refused:
        make_small_experiment("evo", evolution={"fitness": "reads-missing"})
    assert str(refused.value) == (
        "evolution.fitness = 'reads-missing' reads the record 'missing', which no part of the "
        "experiment declares; declared records: none"
    )


def test_two_parts_with_a_record_of_the_same_name_are_refused() -> None:
    with pytest.raises(ExperimentError, match="has a variable 'number', too; rename the record"):
        make_small_experiment("evo", world={"features": ["first-record", "second-record"]})


def test_a_part_with_records_is_refused_by_a_model_without_a_world() -> None:
    with pytest.raises(ExperimentError, match="'clock' has records, which only the model"):
        bl.load("hinton-nowlan-1987:guessing").replace(evolution={"fitness": "clock"})


def test_a_page_refuses_records() -> None:
    with pytest.raises(RefusedError, match="its parts have records or arrays of the run"):
        render_live_page([make_experiment(evolution={"fitness": "clock"})])


@pytest.mark.parametrize("array", [per_agent(2), per_agent(dtype="float64"), per_run()])
def test_a_record_that_is_not_a_number_of_an_agent_is_refused(array: Any) -> None:
    with pytest.raises(TypeError, match="'distance' must be one number of an agent"):
        type("Part", (Fitness,), {"records": {"distance": array}}, name="invalid-record")


def test_the_arguments_of_earlier_versions_are_refused() -> None:
    def evaluate(part: Any, energy: Any, cost: Any, fitness: Any) -> None:
        """Do nothing."""

    with pytest.raises(TypeError, match=r"evaluate\(part, lifetimes, fitness\)"):
        type("Part", (Fitness,), {"evaluate": staticmethod(evaluate)}, name="old-arguments")


def test_an_inheritance_changes_arrays_of_the_run() -> None:
    experiment = make_small_experiment("evo+self-taught", evolution={"inheritance": "numbered"})
    genome = draw_genomes(experiment, GenerationKey(seed=0, run=0, generation=0))
    n_agents = len(genome)
    run_arrays: dict[str, Any] = {}
    for first in (1, n_agents + 1):
        inherited = apply_inheritance(experiment, genome, genome[:, 0].copy(), run_arrays)
        assert inherited[:, 0, 0].tolist() == list(range(first, first + n_agents))
