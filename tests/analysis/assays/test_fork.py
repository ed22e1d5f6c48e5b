"""Effects in the fork assay have known values for artificial branches."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from baldwinlab.analysis.assays.analysis import evaluate_assays
from baldwinlab.analysis.assays.fork import MEASURES, TABLE, compute_effects
from baldwinlab.analysis.assays.section import make_section, tabulate_effects
from baldwinlab.core.variables import make_dataset
from baldwinlab.experiment.toml import to_toml
from baldwinlab.papers.presets import factors, load
from baldwinlab.studies.assays.catalog import get_assay
from baldwinlab.studies.assays.fork import HISTORIES, REGIMES
from tests.analysis.assays import artificial_assays

LEARNER = "evo+self-taught/A"
# Means of the branches (history, regime): history +3, regime -2, interaction +2.
BRANCHES = np.array([[13.0, 14.0], [8.0, 11.0]])
EFFECTS = {"history": 3.0, "regime": -2.0, "interaction": 2.0}


def make_fork(runs: int) -> xr.Dataset:
    """Return a fork from generations 0, without effects, and 5, with known effects."""
    agents = np.array([-1.0, 0.0, 1.0])
    means = np.stack([np.full((2, 2), 9.0), BRANCHES])[..., None] + agents
    # All branches of a run have the same deviation, so that it has no influence on effects.
    values = means + np.arange(runs).reshape(-1, 1, 1, 1, 1)
    attributes = {"experiment": to_toml(load(LEARNER)), "seed": 1}
    attributes |= factors()[LEARNER]._asdict()
    data = make_dataset(get_assay("fork").variables, dict.fromkeys(MEASURES, values), attributes)
    return data.assign_coords(
        run=np.arange(runs),
        generation=[0, 5],
        history=list(HISTORIES),
        regime=list(REGIMES),
    )


def test_effects_of_each_run_are_differences_of_branches() -> None:
    effects = compute_effects(make_fork(runs=3))
    for effect, expected in EFFECTS.items():
        values = effects[f"fork: {effect}, innate fitness"]
        assert values.dims == ("run", "generation")
        assert np.allclose(values.sel(generation=0), 0)
        assert np.allclose(values.sel(generation=5), expected)


@pytest.mark.parametrize("assay", ["fork", "fork-mode"])
def test_a_report_has_a_row_for_each_start_and_measure(tmp_path: Path, assay: str) -> None:
    assays = {assay: {LEARNER: make_fork(runs=6)}}
    rows = tabulate_effects(evaluate_assays(assays), TABLE)
    assert len(rows) == 2 * len(MEASURES)
    last = rows[-1]
    assert last["condition"] == LEARNER
    assert last["start"] == ("mode of generation 5" if assay == "fork-mode" else "generation 5")
    assert [number.median for number in last["numbers"]] == pytest.approx([*EFFECTS.values()])
    text = re.sub(r"<[^>]*>", " ", make_section(assays, tmp_path).body)
    assert "Further evolution with learning on and off" in text
    assert "nan" not in text


def test_a_report_without_a_fork_has_no_table(tmp_path: Path) -> None:
    innate = {"innate": {LEARNER: artificial_assays.innate(LEARNER, on=lambda progress: 1.0)}}
    assert "Further evolution" not in make_section(innate, tmp_path).body
