"""Assays measure agents with several worlds and lifetimes as their study has simulated them."""

from __future__ import annotations

import numpy as np
import pytest

from baldwinlab.studies.assays.assay import FROZEN, ON, Sample
from baldwinlab.studies.assays.catalog import get_assay
from tests.small_studies import make_small_study, shorten_preset

N_AGENTS = 6
N_RUNS = 2


@pytest.fixture(scope="module")
def sample(tmp_path_factory: pytest.TempPathFactory) -> Sample:
    experiment = shorten_preset().replace(
        population={"size": N_AGENTS, "worlds": 3}, lifetime={"repeats": 2}
    )
    study = make_small_study(tmp_path_factory.mktemp("several") / "study", [experiment], N_RUNS)
    return Sample(
        directory=study.directory,
        seed=study.seed,
        experiment=experiment,
        runs=tuple(range(N_RUNS)),
        records=[study.record(experiment.name, run) for run in range(N_RUNS)],
        other_maps=(),
        report_progress=lambda amount: None,
    )


def test_assays_have_the_stored_fitness_and_the_first_lifetime_in_windows(sample: Sample) -> None:
    innate = get_assay("innate").measure(sample)
    learned = innate["energy"][:, -1, ON]
    # `simulate_as_evolved` raises an error for another fitness than the stored one.
    assert np.array_equal(learned, sample.energy(2))
    assert np.isfinite(innate["energy"][:, :, FROZEN]).all()
    # Reaction norms have the stored fitness in the unchanged setting.
    energy = get_assay("reaction").measure(sample)["energy"]
    assert np.array_equal(energy[:, 0], sample.energy(2))
    # Windows within the lifetime are those of the first lifetime.
    within_life = get_assay("within-life").measure(sample)
    n_newborns = 4
    assert within_life["eaten_in_window"].shape == (N_RUNS, n_newborns, 2, N_AGENTS)
    assert within_life["first_meal"].shape == (N_RUNS, n_newborns, N_AGENTS)
