"""Changes of innate traits: an identity, plain loops, and the section of the report."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from scipy import stats

import baldwinlab as bl
from baldwinlab.analysis.estimands.quantitative_genetics import PARTS
from baldwinlab.analysis.estimands.trait_changes import (
    CORRELATION,
    CSV_FILE,
    QUANTITIES,
    RESIDUAL,
    TraitChanges,
    average_changes,
    find_obstacle,
    make_section,
    measure_changes,
)
from baldwinlab.experiment.conditions import Factors
from tests.analysis.estimands.conftest import CONDITIONS, Stored

CONVEX = "stepping/convex"


def changes_of(data: Stored, genotypes: xr.DataArray | None = None) -> TraitChanges:
    return measure_changes(data.runs, data.innate, data.experiment, genotypes)


@pytest.mark.parametrize("condition", CONDITIONS)
def test_the_parts_add_up_to_the_change(stored: dict[str, Stored], condition: str) -> None:
    changes = changes_of(stored[condition])
    averages = average_changes(changes)
    assert abs(averages[RESIDUAL]).max() < 1e-9
    total = sum(averages[part] for part in PARTS)
    np.testing.assert_allclose(total, averages["change"], rtol=0, atol=1e-9)
    assert set(averages) == set(QUANTITIES)


def test_the_observed_response_is_the_change_as_x_is_inherited_completely(
    stored: dict[str, Stored],
) -> None:
    values = changes_of(stored[CONVEX]).values
    np.testing.assert_allclose(values["response"], values["change"], rtol=0, atol=1e-12)
    # X is inherited completely so that its response is predicted.
    # A child has the x of one of its parents, plus a mutation.
    averages = average_changes(changes_of(stored[CONVEX]))
    np.testing.assert_allclose(averages["heritability"], 1, atol=0.1)
    predicted, observed = (averages[name].mean() for name in ("predicted response", "response"))
    assert float(predicted) == pytest.approx(float(observed), rel=0.1)
    # Without genotypes the correlation is undefined.
    assert changes_of(stored[CONVEX]).values[CORRELATION].isnull().all()


def test_the_correlation_is_that_of_all_pairs_of_agents(stored: dict[str, Stored]) -> None:
    data = stored[CONVEX]
    last = data.runs["innate_x"].isel(generation=-1)
    genotypes = last.rename("genotype").expand_dims("gene", axis=-1)
    correlation = changes_of(data, genotypes).values[CORRELATION]
    fitness = data.innate["energy"].sel(life="on").isel(generation=-1)
    for run in range(4):
        x, w = last.isel(run=run).values, fitness.isel(run=run).values
        pairs = [(abs(x[i] - x[j]), abs(w[i] - w[j])) for i in range(x.size) for j in range(i)]
        expected = stats.pearsonr(*zip(*pairs, strict=True)).statistic
        assert float(correlation[run]) == pytest.approx(expected, abs=1e-5)


def test_a_thinned_assay_has_all_changes_of_a_recorded_trait_but_none_of_innate_fitness(
    stored: dict[str, Stored],
) -> None:
    data = stored[CONVEX]
    thinned = data._replace(innate=data.innate.isel(generation=[0, 5, 11]))
    changes = changes_of(thinned).values
    # The change from generation 11 is unknown, because it is the last one.
    is_known = changes["change"].notnull().all("run")
    assert changes["generation"].values[is_known.values].tolist() == [0, 5]
    complete = changes_of(data).values.sel(generation=[0, 5])
    np.testing.assert_allclose(changes["change"].sel(generation=[0, 5]), complete["change"])
    data = stored["costly-climbing/rugged"]
    thinned = data._replace(innate=data.innate.isel(generation=[0, 5, 19]))
    assert changes_of(thinned).values.sizes["generation"] == 0


@pytest.mark.parametrize(
    ("settings", "reason"),
    [
        ({}, ""),
        ({"stop": "stagnation"}, "A run can end before its last generation."),
        ({"selection": "lexicase"}, "The expected number of offspring under the selection"),
    ],
)
def test_conditions_without_known_offspring_have_a_reason(
    settings: dict[str, str], reason: str
) -> None:
    experiment = bl.load("evo+self-taught/A").replace(evolution=settings)
    assert find_obstacle(experiment).startswith(reason)
    assert bool(find_obstacle(experiment)) == bool(reason)


def test_the_section_has_two_figures_a_table_and_a_csv_file(
    stored: dict[str, Stored], tmp_path: Path
) -> None:
    changes = {CONVEX: changes_of(stored[CONVEX])}
    factors = Factors("stepping", "", "")._asdict()
    innate = {name: stored[name].innate.assign_attrs(factors) for name in changes}
    section = make_section(changes, innate, {"other": "A run can end."}, tmp_path)
    assert section.body.count("<figure") == 2
    assert "<strong>other</strong> is not measured. A run can end." in section.body
    with (tmp_path / CSV_FILE).open() as file:
        rows = list(csv.DictReader(file))
    assert [row["quantity"] for row in rows] == list(QUANTITIES)
    added = next(row for row in rows if row["quantity"] == "added by learning")
    assert f"{float(added['median']):.3g} [" in section.body
    assert 0 < float(added["low"]) < float(added["median"]) < float(added["high"])
    for name in ("price-partition", "breeders-equation"):
        assert (tmp_path / "figures" / f"{name}.csv").exists()
