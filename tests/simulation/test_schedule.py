"""Settings that change at a generation hold from that generation on."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import baldwinlab as bl
from baldwinlab.evolution import GenerationKey
from baldwinlab.simulation.records import make_run_dataset
from baldwinlab.simulation.reevaluation import reevaluate, restore_genomes
from baldwinlab.simulation.replay import replay
from baldwinlab.simulation.simulate import simulate, simulate_histories
from tests.evolution.single_runs import make_generation
from tests.studies.completion import require_continuable

LEARNING = bl.load("evo+self-taught/A").replace(
    evolution={"generations": 6}, lifetime={"steps": 150}, world={"start": {"x": 380}}
)
SCHEDULE = [{"generation": 3, "learning.rule": "none"}]


def with_schedule(*changes: dict[str, Any]) -> Any:
    return LEARNING.replace(schedule=list(changes or SCHEDULE))


def test_generations_before_a_change_have_the_bits_of_the_unchanged_experiment() -> None:
    changed = simulate(with_schedule(), seed=2)
    unchanged = simulate(LEARNING, seed=2)
    before = {"generation": slice(3)}
    for name in ("energy", "genome", "parents", "food_eaten"):
        assert changed[name].isel(before).equals(unchanged[name].isel(before))
    # Parents live and are selected under the old settings, so the genomes are equal at birth.
    assert changed["genome"].isel(generation=3).equals(unchanged["genome"].isel(generation=3))
    assert not changed["energy"].isel(generation=3).equals(unchanged["energy"].isel(generation=3))


def test_agents_live_with_the_settings_of_their_generation() -> None:
    scheduled = with_schedule()
    run = simulate(scheduled, seed=2)
    for generation in (2, 3, 5):
        expected = LEARNING if generation < 3 else LEARNING.without_learning()
        genomes = run["genome"].values[generation][None]
        energy = reevaluate(expected, 2, [0], generation, genomes).energy[0]
        np.testing.assert_array_equal(run["energy"].values[generation], energy)


def test_selection_changes_between_the_parents_and_the_children_of_a_generation() -> None:
    run = simulate(with_schedule({"generation": 3, "evolution.selection": "truncation"}), seed=2)
    for generation in (2, 3):
        selection = "roulette" if generation < 3 else "truncation"
        children, _ = make_generation(
            LEARNING.replace(evolution={"selection": selection}),
            GenerationKey(2, 0, generation + 1),
            run["genome"].values[generation],
            run["energy"].values[generation],
        )
        np.testing.assert_array_equal(run["genome"].values[generation + 1], children)


def test_a_scheduled_run_is_replayed_bred_again_and_continued_with_the_same_bits() -> None:
    scheduled = with_schedule().replace(record={"genome_every": 5})
    (history,) = simulate_histories(scheduled, 2, [0])
    run = make_run_dataset(history)
    trace = replay(scheduled, seed=2, generation=4, energy=run["energy"])
    np.testing.assert_array_equal(trace["eaten"].sum("step").values, run["food_eaten"].values[4])
    genome = restore_genomes(scheduled, run, 4)
    np.testing.assert_array_equal(genome[:, :1], trace["weight_birth"].values)
    require_continuable(scheduled, 4, seed=2)


def test_a_lamarckian_start_is_continued_by_darwinian_inheritance() -> None:
    scheduled = LEARNING.replace(
        evolution={"lamarckian_share": 1},
        schedule=[{"generation": 2, "evolution.lamarckian_share": 0}],
    )
    run = simulate(scheduled, seed=2)
    lamarckian = simulate(LEARNING.replace(evolution={"lamarckian_share": 1}), seed=2)
    assert run["genome"].isel(generation=2).equals(lamarckian["genome"].isel(generation=2))
    assert not run["genome"].isel(generation=3).equals(lamarckian["genome"].isel(generation=3))


@pytest.mark.parametrize(
    ("schedule", "length"),
    [
        ([{"generation": 0, "learning.rate": 0.5}], 1),
        ([{"generation": 9, "learning.rate": 0.5}], 1),
        ([{"generation": 3, "learning.rate": 0.5}, {"generation": 3, "motor.noise": 0.1}], 2),
        ([{"generation": 3, "learning.rate": 0.5}, {"generation": 5, "motor.noise": 0.1}], 3),
    ],
)
def test_segments_cover_all_generations(schedule: list[dict[str, Any]], length: int) -> None:
    segments = with_schedule(*schedule).segments()
    assert len(segments) == length
    covered = [generation for generations, _ in segments for generation in generations]
    assert covered == list(range(6))
    assert not any(segment.schedule for _, segment in segments)
