"""What is written down of lives is the same, whoever asks for what at which moments."""

from __future__ import annotations

import numpy as np
import pytest

from baldwinlab.evolution import GenerationKey, draw_genomes
from baldwinlab.models.miniworld.backends.cpu import CpuBatch
from baldwinlab.simulation.recorder import FirstTime, ItemMoves, Series, record_batch
from baldwinlab.simulation.reevaluation import make_batch
from baldwinlab.simulation.replay import replay
from tests.small_studies import shorten_preset

STEPS = 300


def newborns(runs: int = 1) -> CpuBatch:
    experiment = shorten_preset()
    return make_batch(
        experiment,
        1,
        range(runs),
        0,
        np.stack([draw_genomes(experiment, GenerationKey(1, run, 0)) for run in range(runs)]),
    )


def test_a_variable_is_noted_at_the_moments_and_of_the_agents_that_are_asked_for() -> None:
    trace = replay(shorten_preset(), seed=1)
    some, one = (
        Series("x", [0, 7, 299], slice(2, 5)),
        Series("eaten_in_life", range(1, STEPS + 1), 4, np.uint16),
    )
    record_batch(newborns(), [some, one])
    assert np.array_equal(some.values, trace.x.values[[0, 7, 299], 2:5])
    assert np.array_equal(one.values, trace.eaten.values[:, 4].cumsum())
    assert one.values.dtype == np.uint16


def test_a_batch_that_has_lived_is_followed_from_there() -> None:
    whole, part, batch = (
        Series("y", range(STEPS), slice(20)),
        Series("y", range(100, 120), slice(20)),
        newborns(),
    )
    record_batch(newborns(), [whole])
    batch.simulate(0, 50)
    record_batch(batch, [part], steps_done=50)
    assert np.array_equal(part.values, whole.values[100:120])


def test_moves_lead_from_where_items_lay_to_where_they_lie() -> None:
    trace, moves = replay(shorten_preset(), seed=1), ItemMoves(range(40, STEPS))
    record_batch(newborns(), [moves])
    found = moves.columns()
    places = moves.items.copy()
    assert np.array_equal(places[:, 0], trace.item_x.values[40])
    places[found["item"]] = np.stack(
        [found["x"], found["y"]], axis=1
    )  # of an item that moved twice, the later place
    assert np.array_equal(places[:, 0], trace.item_x.values[-1])
    assert (found["step"] > 40).all()
    assert (np.diff(found["step"].astype(int)) >= 0).all()


@pytest.mark.parametrize("moments", [[0, STEPS], [0, 90, 100, 290, STEPS], range(STEPS + 1)])
def test_what_came_about_first_is_found_down_to_the_step_and_the_life_goes_on_as_without(
    moments: list[int],
) -> None:
    batch = newborns(runs=2)
    fed, eaten = (
        FirstTime(lambda batch: np.any(batch.eaten_in_life(), axis=-1), moments),
        Series("eaten_in_life", moments, slice(40)),
    )
    record_batch(batch, [fed, eaten])
    for run in range(2):
        ate = replay(shorten_preset(), seed=1, run=run).eaten.values > 0
        first = np.where(ate.any(axis=0), ate.argmax(axis=0) + 1, np.nan)
        assert np.array_equal(fed.values[run], first, equal_nan=True)
    undisturbed = newborns(runs=2)
    undisturbed.simulate(0, STEPS)
    assert np.array_equal(undisturbed.eaten_in_life(), batch.eaten_in_life())
    assert np.array_equal(undisturbed.weights(), batch.weights())
