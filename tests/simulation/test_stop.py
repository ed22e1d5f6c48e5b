"""A run that stops has the bits of the same run without a stop, cut after the last generation."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import xarray as xr

import baldwinlab as bl
from baldwinlab.api.checks.evolution import compare_stop
from baldwinlab.api.checks.fixture import PartGroup
from baldwinlab.experiment import BaseExperiment, ExperimentError, assign
from baldwinlab.simulation.history import History
from baldwinlab.simulation.records import make_record, make_run_dataset
from baldwinlab.simulation.simulate import simulate, simulate_histories
from tests.oracles.parts import use_oracles
from tests.studies.completion import require_continuable

GENERATIONS = 8
RUNS = range(4)


def make_experiment(name: str = "evo/A", **evolution: Any) -> BaseExperiment:
    settings: dict[str, Any] = {"evolution": {"generations": GENERATIONS} | evolution}
    if name == "evo/A":
        settings["lifetime"] = {"steps": 300}
    return bl.load(name).replace(**settings)


def make_targeted(experiment: BaseExperiment, target: float, **fields: Any) -> BaseExperiment:
    target_fitness = {"target": target} | fields
    stop = {"stop": "target-fitness", "target_fitness": target_fitness}
    return experiment.replace(evolution=stop)


def find_first(is_reached: Any) -> int:
    """Return the number of generations up to the first true entry, or all generations."""
    reached = np.flatnonzero(is_reached)
    return int(reached[0]) + 1 if reached.size else len(is_reached)


def require_cut(stopped: xr.Dataset, complete: xr.Dataset, n_generations: int) -> None:
    """Compare a stopped run with the first generations of a complete run."""
    assert stopped.sizes["generation"] == n_generations
    expected = complete.isel(generation=slice(n_generations))
    for name, values in expected.data_vars.items():
        np.testing.assert_array_equal(stopped[name].values, values.values)


@pytest.mark.parametrize("statistic", ["mean", "maximum"])
@pytest.mark.parametrize("name", ["evo/A", "hinton-nowlan-1987:guessing"])
def test_runs_of_a_batch_stop_when_their_fitness_reaches_the_target(
    name: str, statistic: str
) -> None:
    experiment = make_experiment(name)
    complete = [make_run_dataset(history) for history in simulate_histories(experiment, 3, RUNS)]
    reduce = {"mean": xr.DataArray.mean, "maximum": xr.DataArray.max}[statistic]
    statistics = [reduce(run.energy, "agent") for run in complete]
    # Half of the runs reach the target.
    target = float(np.median([values.max() for values in statistics]))
    expected = [find_first(values.values >= target) for values in statistics]
    assert len(set(expected)) > 1
    targeted = make_targeted(experiment, target, statistic=statistic)
    histories = simulate_histories(targeted, 3, RUNS)
    for history, run, n_generations in zip(histories, complete, expected, strict=True):
        require_cut(make_run_dataset(history), run, n_generations)


def test_a_stopped_run_names_the_stop_and_another_run_does_not() -> None:
    experiment = make_experiment()
    stopped = simulate(make_targeted(experiment, 0), seed=3)
    assert stopped.sizes["generation"] == 1
    assert stopped.attrs["stopped_by"] == "target-fitness"
    assert "stopped_by" not in simulate(make_targeted(experiment, 1000), seed=3).attrs
    assert "stopped_by" not in simulate(experiment, seed=3).attrs


@pytest.mark.parametrize("stop", ["target-fitness", "stagnation"])
def test_a_single_run_has_the_bits_of_the_same_run_in_a_batch(stop: str) -> None:
    experiment = make_targeted(make_experiment(), 3)
    if stop == "stagnation":
        # This stop has arrays of the run, which the record of a run that stopped contains.
        experiment = make_experiment(stop=stop, stagnation={"generations": 2})
    histories = simulate_histories(experiment, 3, RUNS)
    assert len({history.n_generations for history in histories}) > 1
    for history in histories:
        (single,) = simulate_histories(experiment, 3, [history.run])
        assert make_record(single).identical(make_record(history))
        assert simulate(experiment, seed=3, run=history.run).identical(make_run_dataset(history))


def test_a_callback_gets_all_histories_of_a_batch_after_each_generation() -> None:
    lengths: list[list[int]] = []
    simulate_histories(
        make_targeted(make_experiment(), 3),
        3,
        RUNS,
        after_generation=lambda histories: lengths.append([run.n_generations for run in histories]),
    )
    assert all(len(row) == len(RUNS) for row in lengths)
    assert max(lengths[-1]) == len(lengths)


def test_a_run_that_stops_in_its_last_generation_is_marked_as_stopped() -> None:
    experiment = make_experiment()
    complete = simulate(experiment, seed=3)
    (mean_of_first, *_) = complete.energy.mean("agent").values
    shortened = make_targeted(experiment, float(mean_of_first)).replace(
        evolution={"generations": 1}
    )
    (history,) = simulate_histories(shortened, 3, [0])
    assert isinstance(history, History)
    assert history.is_stopped
    assert history.is_complete


def test_a_schedule_changes_the_target() -> None:
    scheduled = make_targeted(make_experiment(), 1000).replace(
        schedule=[{"generation": 4, "evolution.target_fitness.target": 0.0}]
    )
    assert simulate(scheduled, seed=3).sizes["generation"] == 5


def test_the_target_can_be_assigned_with_the_choice_of_the_stop() -> None:
    settings = ["evolution.stop=target-fitness", "evolution.target_fitness.target=7"]
    assert assign(bl.load("evo/A"), settings).part("evolution.stop").target == 7


def test_an_unknown_stop_is_refused_with_the_available_names() -> None:
    with pytest.raises(ExperimentError, match=r"there is no such stop.*target-fitness"):
        bl.load("evo/A").replace(evolution={"stop": "target"})


def make_species(**evolution: Any) -> BaseExperiment:
    species = [{"name": "first", "size": 3}, {"name": "second", "size": 3}]
    settings = {"generations": 40, "compete": "across"} | evolution
    return bl.load("hinton-nowlan-1987:guessing").replace(
        population={"size": 6, "species": species}, evolution=settings
    )


def test_a_run_stops_when_all_agents_are_of_one_species() -> None:
    runs = range(6)
    stopped = simulate_histories(make_species(stop="fixation"), 2, runs)
    lengths = set()
    for history, complete in zip(stopped, simulate_histories(make_species(), 2, runs), strict=True):
        is_fixed = [len({*row}) == 1 for row in complete.recorded_values("species").tolist()]
        n_generations = find_first(is_fixed)
        require_cut(make_run_dataset(history), make_run_dataset(complete), n_generations)
        lengths.add(n_generations)
    assert len(lengths) > 1


@pytest.mark.parametrize(
    ("compete", "reason"),
    [("", r"population\.species = \[\]"), ("within", r'evolution\.compete = "within"')],
)
def test_a_stop_at_a_fixation_that_cannot_occur_is_refused(compete: str, reason: str) -> None:
    experiment = make_experiment(stop="fixation")
    if compete:
        experiment = make_species(stop="fixation", compete=compete)
    with pytest.raises(ExperimentError, match=rf"evolution\.stop: does nothing with {reason}"):
        simulate(experiment)


def test_all_species_share_the_stop() -> None:
    species = [
        {"name": "first", "size": 3, "evolution.stop": "fixation"},
        {"name": "second", "size": 3},
    ]
    with pytest.raises(ExperimentError, match=r"all species share evolution\.stop"):
        make_species().replace(population={"species": species})


def count_until_stagnation(values: list[float], generations: int) -> int:
    """Return the number of generations until no value is above the largest one, by a search."""
    for length in range(1, len(values) + 1):
        largest = max(values[:length])
        if length - 1 - values.index(largest) >= generations:
            return length
    return len(values)


@pytest.mark.parametrize("generations", [1, 2, 3])
def test_a_run_stops_when_its_fitness_no_longer_increases(generations: int) -> None:
    experiment = make_experiment()
    stagnation = {"stop": "stagnation", "stagnation": {"generations": generations}}
    stopped = simulate_histories(experiment.replace(evolution=stagnation), 3, RUNS)
    lengths = set()
    for history, complete in zip(stopped, simulate_histories(experiment, 3, RUNS), strict=True):
        means = make_run_dataset(complete).energy.mean("agent").values.tolist()
        n_generations = count_until_stagnation(means, generations)
        require_cut(make_run_dataset(history), make_run_dataset(complete), n_generations)
        lengths.add(n_generations)
    assert len(lengths) > 1


@pytest.mark.parametrize("stored", [1, 3, 5])
def test_a_run_with_a_stagnation_continues_from_a_record_to_the_same_bits(stored: int) -> None:
    experiment = make_experiment(stop="stagnation", stagnation={"generations": 3})
    require_continuable(experiment, stored, runs=RUNS)


STOPS: dict[str, dict[str, Any]] = {
    "target-fitness": {"target": 2.4, "statistic": "maximum"},
    "stagnation": {"generations": 4},
    "fixation": {},
}


@pytest.mark.parametrize("name", STOPS)
def test_a_built_in_stop_agrees_with_its_oracle(name: str) -> None:
    settings: dict[str, Any] = {"stop": name, name.replace("-", "_"): STOPS[name]}
    if not STOPS[name]:
        del settings[name]
    experiment = make_experiment("evo/A", **settings)
    part = type(experiment.part("evolution.stop"))
    with use_oracles():
        compare_stop(PartGroup((part,), experiment), experiment.part("evolution.stop"))
