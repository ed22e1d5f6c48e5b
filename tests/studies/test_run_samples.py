"""Reports and assays of a large study use a random sample of its runs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from baldwinlab.api.report import evaluate_claims
from baldwinlab.api.study import Study
from baldwinlab.experiment import Experiment
from baldwinlab.studies.assays.results import find_missing_assays, open_assay
from baldwinlab.studies.open import (
    MAX_SAMPLED_RUNS,
    MIN_SAMPLED_RUNS,
    count_sampled_runs,
    describe_sample,
    open_runs,
    open_sample,
    sample_runs,
)
from baldwinlab.studies.store import StudyStore
from tests.small_studies import make_small_study, shorten_preset
from tests.studies.completion import complete_assays

# Other tests draw these figures.
pytestmark = pytest.mark.usefixtures("placeholder_figures_of_module")

RUNS = 60
SAMPLED = 12
NAMES = ["evo/A", "evo+self-taught/A"]


def shorten(name: str) -> Experiment:
    return shorten_preset(name).replace(evolution={"generations": 2}, lifetime={"steps": 20})


@pytest.fixture(scope="module")
def directory(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("large") / "study"
    return make_small_study(folder, list(map(shorten, NAMES)), RUNS, workers=1).directory


@pytest.fixture
def study(directory: Path, monkeypatch: pytest.MonkeyPatch) -> StudyStore:
    monkeypatch.setattr("baldwinlab.studies.open.MAX_SAMPLED_RUNS", SAMPLED)
    return StudyStore(directory)


def test_all_runs_of_a_small_study_are_used(directory: Path) -> None:
    study = StudyStore(directory)
    assert sample_runs(study, NAMES[0]) == list(range(RUNS))
    assert describe_sample(study) == ""
    xr.testing.assert_identical(open_sample(study, NAMES).load(), open_runs(directory).load())


def test_a_sample_has_the_same_runs_in_all_conditions(study: StudyStore) -> None:
    runs = sample_runs(study, NAMES[0])
    assert len({*runs}) == SAMPLED
    assert runs == sorted(runs)
    assert {*runs} < {*range(RUNS)}
    assert sample_runs(study, NAMES[1]) == runs
    assert sample_runs(StudyStore(study.directory), NAMES[0]) == runs


def test_every_run_is_sampled_with_the_same_probability(study: StudyStore) -> None:
    counts = np.zeros(RUNS)
    n_seeds = 2000
    for seed in range(n_seeds):
        study.seed = seed
        counts[sample_runs(study, NAMES[0])] += 1
    share = SAMPLED / RUNS
    # Six standard deviations of a binomial number.
    tolerance = 6 * np.sqrt(n_seeds * share * (1 - share))
    assert np.abs(counts - n_seeds * share).max() < tolerance


def test_a_sample_has_the_values_of_its_runs(study: StudyStore) -> None:
    n_files = 0

    def count_file(number: int) -> None:
        nonlocal n_files
        n_files += number

    sample = open_sample(study, NAMES, count_file).load()
    assert n_files == sum(len(study.files(name)) for name in NAMES)
    expected = open_runs(study.directory).sel(run=sample_runs(study, NAMES[0])).load()
    xr.testing.assert_identical(sample, expected)


def test_the_memory_of_a_sample_is_limited(directory: Path) -> None:
    study = StudyStore(directory)
    assert count_sampled_runs(study) == MAX_SAMPLED_RUNS
    for generations, expected in ((20_000, 335), (1_000_000, MIN_SAMPLED_RUNS)):
        study.experiments = {
            name: shorten(name).replace(evolution={"generations": generations}) for name in NAMES
        }
        # Two conditions with 20 agents, and 4 bytes per value.
        assert count_sampled_runs(study) == max(2**30 // (2 * 20 * generations * 4), expected)


def test_an_assay_measures_the_sampled_runs(study: StudyStore) -> None:
    complete_assays(study, ["innate"])
    for name in NAMES:
        data = open_assay(study.directory, "innate", name)
        assert data["run"].values.tolist() == sample_runs(study, name)
    assert not any(find_missing_assays(study, ["innate"]).values())


def test_the_report_and_the_claims_state_the_size_of_the_sample(
    study: StudyStore, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    sentence = "a random sample of 12 of the 60 stored runs of a condition"
    page = Study(study).report(out=tmp_path / "page.html")
    assert sentence in page.read_text(encoding="utf-8")
    assert "reading" in capsys.readouterr().out
    file = tmp_path / "claims.toml"
    comparison = f'{{ a = "{NAMES[0]}", b = "{NAMES[1]}", measure = "mean", rule = "greater" }}'
    file.write_text(
        f'[[claims]]\nid = "C1"\ntitle = "More"\nclaim = "More."\ncomparisons = [{comparison}]\n',
        "utf-8",
    )
    evaluate_claims(study, file)
    printed = " ".join(capsys.readouterr().out.split())
    assert "The statistics use a random sample of 12 of the 60 stored runs" in printed
