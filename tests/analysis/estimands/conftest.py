"""Small studies of systems for which theory has an exact answer."""

from __future__ import annotations

from typing import NamedTuple

import pytest
import xarray as xr

import baldwinlab as bl
from baldwinlab.experiment import BaseExperiment

SLOPES = tuple(f"stepping/{shape}" for shape in ("convex", "exponential", "concave"))
# Conditions of each study, number of agents, and number of generations.
STUDIES = {
    "paenke-2007": (SLOPES, 300, 12),
    "hinton-nowlan-1987": (("guessing",), 1000, 12),
    "mayley-1996": (("costly-climbing/rugged",), 60, 20),
}
CONDITIONS = tuple(name for conditions, _, _ in STUDIES.values() for name in conditions)


class Stored(NamedTuple):
    """Stored data of a condition."""

    runs: xr.Dataset
    innate: xr.Dataset
    assimilation: xr.Dataset
    experiment: BaseExperiment


@pytest.fixture(scope="package")
def stored(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Stored]:
    """The runs and the assays `innate` and `assimilation` of `CONDITIONS`."""
    data = {}
    folder = tmp_path_factory.mktemp("estimands")
    for paper, (conditions, size, generations) in STUDIES.items():
        experiments = [
            bl.load(f"{paper}:{name}").replace(
                population={"size": size}, evolution={"generations": generations}
            )
            for name in conditions
        ]
        study = bl.run(experiments, runs=4, seed=1, out=folder / paper, workers=1)
        assays = [study.assay(assay, workers=1) for assay in ("innate", "assimilation")]
        for name in conditions:
            runs, innate, assimilation = (
                values.sel(condition=name) for values in (study.data(), *assays)
            )
            data[name] = Stored(runs, innate, assimilation, study.experiment(name))
    return data
