"""Assays read back from their files, and what they come to in each run.

The evaluations in the package belong to assays, and read the names that the assays store.
"""

from __future__ import annotations

import os
import re
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

from baldwinlab.analysis.assays import fork as fork_evaluation
from baldwinlab.analysis.assays.criteria import load_criteria
from baldwinlab.analysis.assays.evaluation import (
    RANDOM_NEWBORNS,
    compute_quantities,
    load_evaluations,
    read_factors,
    weight_distances,
)
from baldwinlab.analysis.assays.reaction_panels import UNCHANGED_SETTING
from baldwinlab.core.netcdf import from_bytes, to_bytes
from baldwinlab.experiment import Experiment
from baldwinlab.experiment.conditions import Factors
from baldwinlab.studies.assays import fork, reaction
from baldwinlab.studies.assays import within_life as within_life_assay
from baldwinlab.studies.assays.catalog import load_assays
from baldwinlab.studies.assays.results import (
    assay_path,
    encode_assay,
    find_missing_assays,
    open_assay,
    read_assays,
)
from baldwinlab.studies.records import StudyError
from baldwinlab.studies.store import StudyStore
from tests.analysis.assays.artificial_assays import (
    RUNS,
    STEPS,
    Assayed,
    constant,
    innate,
    make_all_assays,
    rising,
    spread,
    within_life,
)
from tests.small_studies import make_small_study, shorten_preset
from tests.studies.assays.studies import make_small_study_with_assays
from tests.studies.completion import complete_assays

A = "evo+self-taught/A"


def stored(folder: Path, assay: str = "innate", data: xr.Dataset | None = None) -> Path:
    path = folder / "assays" / assay / f"{A}.nc"
    path.parent.mkdir(parents=True)
    if data is None:
        data = innate(A, off=constant(1), on=constant(2), runs=2)
    path.write_bytes(encode_assay(data))
    return path


def test_stored_assays_are_read_by_assay_and_condition(tmp_path: Path) -> None:
    assert read_assays(Assayed(tmp_path)) == {}
    assays = make_all_assays(runs=2)
    for assay, conditions in assays.items():
        for condition, data in conditions.items():
            path = tmp_path / "assays" / assay / f"{condition}.nc"
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(encode_assay(data))
    result = read_assays(Assayed(tmp_path))
    assert {assay: set(conditions) for assay, conditions in result.items()} == {
        assay: set(conditions) for assay, conditions in assays.items()
    }
    assert result["innate"][A]["life"].values.tolist() == ["off", "on", "frozen", "drift"]
    assert read_factors(result["innate"][A]) == Factors(learner=A)
    assert (
        read_factors(
            read_assays(Assayed(tmp_path, {A: Factors("evo+self-taught", "A")}))["innate"][A]
        ).map
        == "A"
    )
    assert compute_quantities(result, A, 10).keys() == compute_quantities(assays, A, 10).keys()


def test_a_damaged_file_is_named(tmp_path: Path) -> None:
    path = stored(tmp_path)
    content = path.read_bytes()
    for size in (0, 3, 200):
        path.write_bytes(content[:size])
        message = r"A\.nc is damaged: .*; `baldwinlab assay .* --assays innate` measures it again"
        with pytest.raises(ValueError, match=message):
            read_assays(Assayed(tmp_path))
    os.truncate(path, 20 * 10**9)
    message = r"A\.nc cannot be read: it has 20,000,000,000 bytes, and an assay may"
    with pytest.raises(ValueError, match=message):
        read_assays(Assayed(tmp_path))


@pytest.mark.parametrize(
    "foreign",
    ["other variables", "no coordinates", "text for numbers", "no experiment", "experiment 5"],
)
def test_a_netcdf_file_that_is_no_assay_is_named_despite_a_valid_checksum(
    tmp_path: Path, foreign: str
) -> None:
    data = innate(A, off=constant(1), on=constant(2), runs=2)
    invalid = {
        "other variables": xr.Dataset({"rain": ("day", np.zeros(3))}, attrs=data.attrs),
        "no coordinates": data.drop_vars(list(data.coords)),
        "text for numbers": data.assign(energy=data.energy.astype("S1")),
        "no experiment": data.drop_attrs(deep=False),
        "experiment 5": data.assign_attrs(experiment=5),
    }[foreign]
    stored(tmp_path).write_bytes(encode_assay(invalid))
    with pytest.raises(
        ValueError,
        match=r"A\.nc does not have the content of the assay 'innate'; `baldwinlab assay",
    ):
        read_assays(Assayed(tmp_path))


def test_a_window_longer_than_the_run_has_all_generations(tmp_path: Path) -> None:
    stored(tmp_path)
    result = compute_quantities(read_assays(Assayed(tmp_path)), A, 10**18 - 1)
    np.testing.assert_allclose(result["off", "last"], result["off", "throughout"])


def test_an_assay_of_another_kind_or_size_is_named(tmp_path: Path) -> None:
    stored(tmp_path, "within-life")
    with pytest.raises(
        ValueError, match=r"A\.nc does not have the content of the assay 'within-life'"
    ):
        read_assays(Assayed(tmp_path))


def test_a_window_averages_over_generations_separately_for_each_run() -> None:
    result = compute_quantities(
        {"innate": {A: innate(A, off=rising(0, 39), on=constant(78), runs=3)}}, A, last=4
    )
    factors = spread(3)
    np.testing.assert_allclose(result["off", "first"].values, 1.5 * factors)
    np.testing.assert_allclose(result["off", "last"].values, 37.5 * factors)
    np.testing.assert_allclose(result["gain", "last"].values, 40.5 * factors)
    np.testing.assert_allclose(result["innate share", "last"].values, 37.5 / 78)
    assert result["drift", "last"].isnull().all() and result["frozen share", "last"].isnull().all()
    # A share of nothing is undefined.
    result = compute_quantities({"innate": {A: innate(A, off=constant(0), on=constant(0))}}, A, 10)
    assert result["innate share", "last"].isnull().all()
    assert (result["gain", "last"] == 0).all()
    # A window has at least one generation.
    with pytest.raises(ValueError, match="at least 1"):
        compute_quantities(make_all_assays(), A, 0)


def test_learning_is_compared_with_drift_in_the_generations_with_drift() -> None:
    data = innate(A, off=constant(1), on=rising(0, 39), drift=constant(5), runs=2)
    data["energy"].loc[{"life": "drift", "generation": range(1, 39)}] = np.nan
    result = compute_quantities({"innate": {A: data}}, A, 10)
    np.testing.assert_allclose(result["on, with drift control", "last"].values, 39 * spread(2))
    np.testing.assert_allclose(result["on", "last"].values, 34.5 * spread(2))


def test_the_distance_is_the_euclidean_norm_of_the_layers() -> None:
    data = innate(A, on=constant(1), runs=1)
    data["distance"][{"layer": 0}], data["distance"][{"layer": 1}] = 3, 4
    result = weight_distances(data)
    assert (result["distance"] == 5).all() and (result["distance, hidden to actions"] == 4).all()


def test_an_agent_that_never_ate_counts_with_the_complete_lifetime() -> None:
    data = within_life(A, 0, 5, runs=1)
    data["first_meal"][{"newborns": -1}] = [[100, 200, np.nan, np.nan]]
    result = compute_quantities({"within-life": {A: data}}, A, 10)
    assert float(result["first meal", "evolved"][0]) == (100 + 200 + 2 * STEPS) / 4
    assert float(result["ever ate", "evolved"][0]) == 0.5
    assert float(result["first meal", "random genome"][0]) == STEPS
    assert float(result["eaten in life", "evolved"][0]) == 6 * 50


def test_settings_are_relative_to_the_setting_of_evolution() -> None:
    result = compute_quantities(make_all_assays(), A, 10)
    assert ("setting", "as evolved") in result and ("setting, relative", "as evolved") not in result
    np.testing.assert_allclose(result["setting, relative", "map = A"].values, 7 / 8)
    assert result["setting", "learning.rate = 0.1"].shape == (RUNS,)


def test_an_assay_with_a_flipped_bit_or_of_another_condition_is_named(tmp_path: Path) -> None:
    study = make_small_study_with_assays(tmp_path, names=["innate"])
    first, second, *_ = sorted((study.directory / "assays" / "innate").rglob("*.nc"))
    condition = first.relative_to(study.directory / "assays" / "innate").with_suffix("").as_posix()
    sound = first.read_bytes()
    rng = np.random.default_rng(0)
    for position in [0, len(sound) - 1, *rng.integers(0, len(sound), 60)]:
        damaged = bytearray(sound)
        damaged[position] ^= 1 << rng.integers(8)
        first.write_bytes(bytes(damaged))
        with pytest.raises(ValueError, match=str(first)):
            read_assays(study)
    assert find_missing_assays(study, ["innate"])[condition] == ["innate"]
    first.write_bytes(sound)
    second.write_bytes(sound)
    with pytest.raises(ValueError, match=re.escape(f"{second} is of the condition")):
        read_assays(study)


def innate_of(folder: Path, experiment: Experiment, seed: int = 5, runs: int = 2) -> Path:
    """Return the file of the assay `innate` of a study of one condition."""
    study = make_small_study(folder, [experiment], runs, seed)
    complete_assays(study, ["innate"])
    return assay_path(folder, "innate", experiment.name)


@pytest.mark.parametrize(
    ("changes", "why"),
    [
        ({"seed": 6}, "is of a study with seed 6, and this study has seed 5"),
        (
            {"lifetime": {"steps": 299}},
            "was measured on another experiment than that of evo+self-taught/A in this study",
        ),
        ({"runs": 3}, "is of run 2, and runs/evo+self-taught/A/0002.nc is not stored"),
    ],
    ids=["another seed", "another experiment", "other runs"],
)
def test_an_assay_of_another_study_is_refused_and_measured_again(
    tmp_path: Path, changes: dict[str, Any], why: str
) -> None:
    path = innate_of(tmp_path / "study", shorten_preset())
    content = path.read_bytes()
    numbers = {name: changes.pop(name) for name in ("seed", "runs") if name in changes}
    shutil.copy(innate_of(tmp_path / "other", shorten_preset().replace(**changes), **numbers), path)
    study = StudyStore(tmp_path / "study")
    remedy = f"`baldwinlab assay {study.directory} --assays innate` measures it again"
    for refused in (
        lambda: read_assays(study),
        lambda: open_assay(study.directory, "innate", A),
    ):
        with pytest.raises((ValueError, StudyError), match=re.escape(f"{path} {why}; {remedy}")):
            refused()
    missing = find_missing_assays(study, ["innate"])
    assert missing == {A: ["innate"]}
    complete_assays(study, ["innate"])
    assert path.read_bytes() == content


def test_an_assay_of_fewer_runs_than_are_stored_is_read(tmp_path: Path) -> None:
    innate_of(tmp_path, shorten_preset(), runs=1)
    study = make_small_study(tmp_path, [shorten_preset()], runs=2)
    assert read_assays(study)["innate"][A]["run"].values.tolist() == [0]


def test_an_assay_without_provenance_or_of_an_absent_condition_is_refused(tmp_path: Path) -> None:
    path = innate_of(tmp_path, shorten_preset())
    study = StudyStore(tmp_path)
    content = path.read_bytes()
    data = from_bytes(content)
    without_seed, without_experiment = data.copy(), data.copy()
    del without_seed.attrs["seed"], without_experiment.attrs["experiment"]
    for invalid in (without_seed, without_experiment, data.drop_vars("run")):
        path.write_bytes(to_bytes(invalid))
        with pytest.raises(ValueError, match=re.escape(str(path))):
            read_assays(study)
    path.write_bytes(content)
    foreign = assay_path(tmp_path, "innate", "evo/C")
    foreign.parent.mkdir(parents=True, exist_ok=True)
    shutil.copy(path, foreign)
    message = r"C\.nc is of the condition 'evo/C', which is not in the study; remove it"
    with pytest.raises(ValueError, match=message):
        read_assays(study)


def test_an_assay_of_another_format_is_refused(tmp_path: Path) -> None:
    path = stored(tmp_path)
    data = innate(A, off=constant(1), on=constant(2), runs=2)
    for other in (None, 1, 3):
        path.write_bytes(to_bytes(data.assign_attrs({} if other is None else {"format": other})))
        message = f"has format {other}, and this version reads only format 2; `baldwinlab assay"
        with pytest.raises(ValueError, match=message):
            read_assays(Assayed(tmp_path))


def test_each_evaluation_and_each_criterion_is_of_an_assay() -> None:
    assert load_evaluations().keys() <= load_assays().keys()
    assert {criterion.assay for criterion in load_criteria()} <= load_assays().keys()


def test_figures_tables_and_names_are_of_measures_of_their_assay() -> None:
    assays = make_all_assays()
    for assay, evaluation in load_evaluations().items():
        if not evaluation.compute_quantities or assay not in assays:
            continue
        stored = {assay: assays[assay]}
        measures = {measure for measure, _ in compute_quantities(stored, A, 10)}
        shown = [name for figure in evaluation.figures for name in figure.measures]
        shown += evaluation.measure_names
        if evaluation.table:
            shown += [name for names in evaluation.table.measures.values() for name in names]
        assert set(shown) <= measures, assay


def test_evaluations_read_the_names_that_the_assays_store() -> None:
    assert (fork_evaluation.HISTORIES, fork_evaluation.REGIMES) == (fork.HISTORIES, fork.REGIMES)
    assert UNCHANGED_SETTING == reaction.UNCHANGED_SETTING
    assert RANDOM_NEWBORNS == within_life_assay.RANDOM_NEWBORNS
