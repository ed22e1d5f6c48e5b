"""A study with two models and a missing run. Tests do not change it."""

from __future__ import annotations

import pytest

import baldwinlab as bl
from baldwinlab import Study
from tests.small_studies import shorten_preset


@pytest.fixture(scope="session")
def mixed(tmp_path_factory: pytest.TempPathFactory) -> Study:
    """Run foragers and bit strings, which differ in variables, agents and generations."""
    guessing = bl.load("hinton-nowlan-1987:guessing").replace(
        population={"size": 8}, evolution={"generations": 4}
    )
    experiments = [shorten_preset("evo/A"), guessing]
    study = bl.run(experiments, runs=2, seed=5, out=tmp_path_factory.mktemp("mixed") / "study")
    (study.directory / "runs" / "guessing" / "0000.nc").unlink()
    return study
