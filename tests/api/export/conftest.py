"""A study of two models, one of which lacks a run; no test changes it."""

from __future__ import annotations

import pytest

import baldwinlab as bl
from baldwinlab import Study
from tests.small_studies import shorten_preset


@pytest.fixture(scope="session")
def mixed(tmp_path_factory: pytest.TempPathFactory) -> Study:
    """Foragers, and strings of alleles with other variables and numbers of agents and generations."""
    guessing = bl.load("hinton-nowlan-1987:guessing").replace(
        population={"size": 8}, evolution={"generations": 4}
    )
    experiments = [shorten_preset("evo/A"), guessing]
    study = bl.run(experiments, runs=2, seed=5, out=tmp_path_factory.mktemp("mixed") / "study")
    (study.directory / "runs" / "guessing" / "0000.nc").unlink()  # as if it were partly run
    return study
