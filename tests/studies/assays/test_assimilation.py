"""The assay `assimilation` measures what genomes of three histories learn."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import baldwinlab as bl
from baldwinlab.evolution import GenerationKey
from baldwinlab.experiment import Experiment
from baldwinlab.simulation.reevaluation import reevaluate
from baldwinlab.studies.assays.assimilation import WINDOW, choose_generations
from baldwinlab.studies.assays.catalog import get_assay
from tests.evolution.single_runs import draw_genomes, make_generation
from tests.worlds import make_small_experiment

NEEDLE = bl.load("hinton-nowlan-1987:guessing").replace(
    population={"size": 300}, evolution={"generations": 6}
)


def test_the_distances_are_those_of_runs_with_learning_without_and_without_selection(
    tmp_path: Path,
) -> None:
    study = bl.run([NEEDLE], runs=3, seed=2, out=tmp_path / "study", workers=1)
    distance = study.assay("assimilation", workers=1)["distance"].squeeze(drop=True)
    # The share of ? is a property of the genomes, so runs with and without learning record it.
    for run in range(3):
        for history, experiment in (("learner", NEEDLE), ("control", NEEDLE.without_learning())):
            unset = bl.simulate(experiment, seed=2, run=run)["unset"].mean("agent")
            measured = distance.sel(run=run, history=history)
            np.testing.assert_allclose(measured, unset, rtol=1e-6)
        neutral = distance.sel(run=run, history="neutral")
        np.testing.assert_allclose(neutral, evolve_without_selection(run), rtol=1e-6)
    assert not np.allclose(distance.sel(history="learner"), distance.sel(history="neutral"))


def evolve_without_selection(run: int) -> list[float]:
    """Return the mean share of ? in each generation of a run with random parents."""
    genomes = draw_genomes(NEEDLE, GenerationKey(2, run, 0))
    shares = []
    for generation in range(6):
        outcomes = reevaluate(NEEDLE, 2, [run], generation, genomes[None])
        shares.append(float(outcomes.records["unset"].mean()))
        key = GenerationKey(2, run, generation + 1)
        genomes, _ = make_generation(NEEDLE.neutral_control(), key, genomes, np.zeros(300))
    return shares


def test_control_genomes_learn_although_they_evolved_without_learning(tmp_path: Path) -> None:
    learner = make_small_experiment("evo+self-taught", evolution={"generations": 4})
    study = bl.run([learner], runs=2, seed=1, out=tmp_path / "study", workers=1)
    distance = study.assay("assimilation", workers=1)["distance"].squeeze(drop=True)
    # The founders are the same, and the weights of all genomes change in life.
    assert (distance.isel(generation=0) > 0).all()
    first = distance.isel(generation=0)
    np.testing.assert_array_equal(first.sel(history="control"), first.sel(history="learner"))
    # The distance of all weights is that of the layers in the assay `innate`.
    layers = study.assay("innate", workers=1)["distance"].squeeze(drop=True)
    total = ((layers.astype(np.float64) ** 2).sum("layer") ** 0.5).mean("agent")
    np.testing.assert_allclose(distance.sel(history="learner"), total, rtol=1e-6)


def test_the_first_and_the_last_generations_do_not_overlap() -> None:
    for n_generations, expected in (
        (1, [0]),
        (3, [0, 2]),
        (100, [*range(WINDOW), *range(90, 100)]),
    ):
        experiment = NEEDLE.replace(evolution={"generations": n_generations})
        assert choose_generations(experiment) == expected


@pytest.mark.parametrize(
    ("experiment", "reason"),
    [
        (make_small_experiment("evo"), "needs a condition that learns"),
        (make_small_experiment("self-taught"), "which needs inherited genomes"),
        (
            make_small_experiment("evo+self-taught", evolution={"lamarckian_share": 0.5}),
            "children inherit learned weights",
        ),
    ],
)
def test_the_assay_does_not_apply_if_nothing_can_become_innate(
    experiment: Experiment, reason: str
) -> None:
    assert reason in get_assay("assimilation").find_obstacle(experiment)
