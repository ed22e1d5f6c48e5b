"""Recorders record the same values for any choice of variables, steps and agents."""

from __future__ import annotations

import numpy as np
import pytest

from baldwinlab.evolution import GenerationKey
from baldwinlab.models.miniworld.backends.cpu import CpuBatch
from baldwinlab.simulation.recorder import FirstTime, ItemMoves, Series, record_batch
from baldwinlab.simulation.reevaluation import make_batch
from baldwinlab.simulation.replay import replay
from tests.evolution.single_runs import draw_genomes
from tests.small_studies import shorten_preset

STEPS = 300


def make_newborn_batch(runs: int = 1) -> CpuBatch:
    experiment = shorten_preset()
    return make_batch(
        experiment,
        1,
        range(runs),
        0,
        np.stack([draw_genomes(experiment, GenerationKey(1, run, 0)) for run in range(runs)]),
    )


def test_a_series_records_a_variable_at_the_given_steps_for_the_given_agents() -> None:
    trace = replay(shorten_preset(), seed=1)
    x = Series("x", [0, 7, 299], slice(2, 5))
    eaten = Series("eaten_in_life", range(1, STEPS + 1), 4, np.uint16)
    record_batch(make_newborn_batch(), [x, eaten])
    assert np.array_equal(x.values, trace.x.values[[0, 7, 299], 2:5])
    assert np.array_equal(eaten.values, trace.eaten.values[:, 4].cumsum())
    assert eaten.values.dtype == np.uint16


def test_item_moves_give_the_final_positions_of_the_items() -> None:
    trace = replay(shorten_preset(), seed=1)
    moves = ItemMoves(range(40, STEPS))
    record_batch(make_newborn_batch(), [moves])
    columns = moves.columns()
    positions = moves.items.copy()
    assert np.array_equal(positions[:, 0], trace.item_x.values[40])
    # The last assignment counts if an item moves twice.
    positions[columns["item"]] = np.stack([columns["x"], columns["y"]], axis=1)
    assert np.array_equal(positions[:, 0], trace.item_x.values[-1])
    assert (columns["step"] > 40).all()
    assert (np.diff(columns["step"].astype(int)) >= 0).all()


@pytest.mark.parametrize("steps", [[0, STEPS], [0, 90, 100, 290, STEPS], range(STEPS + 1)])
def test_the_first_time_of_an_event_is_exact_and_recording_does_not_change_the_lifetime(
    steps: list[int],
) -> None:
    batch = make_newborn_batch(runs=2)
    fed = FirstTime(lambda batch: np.any(batch.eaten_in_life(), axis=-1), steps)
    eaten = Series("eaten_in_life", steps, slice(40))
    record_batch(batch, [fed, eaten])
    for run in range(2):
        ate = replay(shorten_preset(), seed=1, run=run).eaten.values > 0
        first = np.where(ate.any(axis=0), ate.argmax(axis=0) + 1, np.nan)
        assert np.array_equal(fed.values[run], first, equal_nan=True)
    unrecorded = make_newborn_batch(runs=2)
    unrecorded.simulate(0, STEPS)
    assert np.array_equal(unrecorded.eaten_in_life(), batch.eaten_in_life())
    assert np.array_equal(unrecorded.weights(), batch.weights())
