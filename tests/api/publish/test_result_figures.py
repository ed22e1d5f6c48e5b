"""Figures of the report as files, with their runs and the meaning of their bands."""

from __future__ import annotations

import csv

import pytest

from baldwinlab.api.publish.lab_results import compute_results
from baldwinlab.api.publish.result_figures import make_figure_file
from baldwinlab.studies.store import StudyStore
from tests.small_studies import make_small_study, shorten_preset

NAMES = ["evo/A", "evo+self-taught/A"]


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> StudyStore:
    presets = [shorten_preset(name) for name in NAMES]
    return make_small_study(tmp_path_factory.mktemp("figures") / "small", presets, runs=3)


def test_a_picture_states_its_study_its_runs_and_its_bands_and_has_the_same_bytes(
    study: StudyStore,
) -> None:
    file = make_figure_file(study, "fitness", "svg", NAMES)
    assert file.name == "small-fitness-3-runs.svg"
    text = file.content.decode()
    assert "small, 3 runs per condition. Items eaten by the best agent and the" in text
    assert "Bands are 95 % intervals of the" in text
    assert make_figure_file(study, "fitness", "svg", NAMES).content == file.content
    first, second = (make_figure_file(study, "fitness", "pdf", NAMES) for _ in range(2))
    assert first.content.startswith(b"%PDF") and first == second


def test_the_numbers_of_curves_and_boxes_are_those_of_the_page(study: StudyStore) -> None:
    file = make_figure_file(study, "fitness", "csv", NAMES[:1])
    rows = [*csv.DictReader(file.content.decode().splitlines())]
    assert {(row["condition"], row["runs"]) for row in rows} == {("evo/A", "3")}
    curve = compute_results(study)["curves"]["evo/A"]["mean"]
    for column, key in (("median", "center"), ("low", "low"), ("high", "high")):
        values = [row[column] for row in rows if row["measure"] == "mean"]
        # Three runs have no interval, which is an empty cell in CSV.
        assert [float(value) if value else None for value in values] == pytest.approx(curve[key])
    # The boxes have a value per run.
    file = make_figure_file(study, "final-fitness", "csv", NAMES)
    rows = [*csv.DictReader(file.content.decode().splitlines())]
    expected = sorted(row["mean"] for row in compute_results(study)["runs"]["rows"])
    assert sorted(float(row["mean"]) for row in rows) == pytest.approx(expected)


@pytest.mark.parametrize(
    ("figure", "file_format", "names", "message"),
    [
        ("responses", "svg", NAMES, "figure = 'responses' must be one of fitness, final-fitness"),
        ("maps", "svg", NAMES, "figure = 'maps' must be one of fitness, final-fitness"),
        ("fitness", "gif", NAMES, "format = 'gif' must be one of svg, pdf, png, csv"),
        ("fitness", "svg", [], "a figure has 1 to 60 conditions, not 0"),
    ],
)
def test_an_unknown_figure_is_refused(
    study: StudyStore, figure: str, file_format: str, names: list[str], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        make_figure_file(study, figure, file_format, names)
