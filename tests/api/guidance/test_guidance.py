"""The study what-guides in miniature: its cells, a repeated start, the page and the article."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest
import xarray as xr

from baldwinlab.analysis.guidance.figures import draw_effects
from baldwinlab.analysis.results.verdicts import VERDICTS
from baldwinlab.api.cells import CellsRequest, read_digests, split_runs
from baldwinlab.api.guidance import run as run_module
from baldwinlab.api.guidance.publish import publish_guidance, read_results, render_article
from baldwinlab.api.guidance.run import (
    AGENTS_PER_BATCH,
    GuidanceTask,
    run_guidance,
)
from baldwinlab.api.guidance.simulation import (
    count_agent_steps,
    list_arms,
    measure_runs,
)
from baldwinlab.api.run_options import RunOptions
from baldwinlab.core.errors import ArgumentError, RefusedError
from baldwinlab.models.nk_climbers import landscape
from baldwinlab.papers.guidance_design import (
    GuidanceDesign,
    GuidanceGroup,
    list_cells,
    read_guidance,
)
from baldwinlab.simulation.records import make_record
from baldwinlab.simulation.simulate import simulate_histories
from baldwinlab.studies.assays import Sample
from baldwinlab.studies.assays.fork import POPULATION, Fork
from tests.commands import Command

OPTIONS = RunOptions(workers=1)
SMALL = {"population.size": 6, "evolution.generations": 4}


def shrink(group: GuidanceGroup) -> GuidanceGroup:
    """Return a group of few agents and generations, with two values of each field."""
    settings: dict[str, Any] = {**group.settings, **SMALL}
    if group.preset.startswith("le-2019"):
        settings["lifetime.steps"] = 20
    fields = {name: values[:2] for name, values in group.fields.items()}
    if "population.size" in fields:
        del settings["population.size"]
        fields["population.size"] = (100,) if group.name == "nk" else (1000,)
    if "nk_climbers.trials" in fields:
        fields["nk_climbers.trials"] = (30,)
    fields |= {"nk_climbers.k": (0, 2, 5)} if "nk_climbers.k" in fields else {}
    return group.model_copy(
        update={"settings": settings, "fields": fields, "horizons": (0, 20, 100), "quick_runs": 2}
    )


@pytest.fixture(scope="module")
def design() -> GuidanceDesign:
    """Return a design with five of the groups, in very few cells."""
    names = ("nk", "nk-large", "chain", "whitley-deceptive", "le-a")
    design = read_guidance()
    groups = [shrink(group) for group in design.groups if group.name in names]
    predictions = tuple(
        prediction.model_copy(update={"bounds": {**prediction.bounds, "horizon": 100}})
        for prediction in design.predictions
    )
    return design.model_copy(update={"groups": tuple(groups), "predictions": predictions})


@pytest.fixture(scope="module", autouse=True)
def _use_design(design: GuidanceDesign) -> Iterator[None]:
    with patch.object(run_module, "read_guidance", lambda: design):
        yield


@pytest.fixture(scope="module")
def quick(tmp_path_factory: pytest.TempPathFactory) -> CellsRequest:
    """Return a finished study of the quick form."""
    request = CellsRequest(tmp_path_factory.mktemp("guides") / "quick", is_quick=True, runs=2)
    run_guidance(request, OPTIONS)
    publish_guidance(request)
    return request


@pytest.fixture(scope="module")
def full(tmp_path_factory: pytest.TempPathFactory) -> CellsRequest:
    """Return a finished study of all cells, with too few runs for verdicts."""
    request = CellsRequest(tmp_path_factory.mktemp("guides") / "full", runs=2)
    run_guidance(request, OPTIONS)
    publish_guidance(request)
    return request


def test_the_history_effect_is_that_of_the_fork_assay(
    design: GuidanceDesign, tmp_path: Path
) -> None:
    (group,) = [group for group in design.groups if group.name == "nk"]
    *_, cell = list_cells(group)
    runs = (1000, 1001)
    measured = measure_runs(cell, 5, runs, lambda _: None)
    samples = []
    for experiment in (cell.learner, cell.learner.without_learning()):
        histories = simulate_histories(experiment, 5, runs)
        records = [make_record(history) for history in histories]
        samples.append(Sample(tmp_path, 5, experiment, runs, records, (), lambda _: None))
    learners, controls = samples
    fork = Fork(POPULATION, 20).measure(replace(learners, control=controls))["innate_fitness"]
    # [run, history]: the branches with learning off.
    expected = fork[:, 0, :, 1].mean(axis=-1)
    at_20 = measured["innate"].sel(start="population", horizon=20)
    assert np.array_equal(at_20.sel(arm="learning"), expected[:, 0])
    assert np.array_equal(at_20.sel(arm="control"), expected[:, 1])


def test_the_mode_of_clones_is_one_string(design: GuidanceDesign) -> None:
    (group,) = [group for group in design.groups if group.name == "nk"]
    *_, cell = list_cells(group)
    measured = measure_runs(cell, 5, (1000,), lambda _: None)
    start = measured["innate"].sel(start="mode", horizon=0, run=1000)
    table = landscape(5, 1000, 16, 5)
    # All agents have the same genotype, so that the mean is the fitness of one string.
    assert all(np.isclose(table, value).any() for value in start.values)


@pytest.mark.parametrize("name", ["nk", "chain", "le-a"])
def test_a_cell_reports_all_its_agent_steps(design: GuidanceDesign, name: str) -> None:
    (group,) = [group for group in design.groups if group.name == name]
    *_, cell = list_cells(group)
    reports: list[int] = []
    measure_runs(cell, 0, (0, 1), reports.append)
    assert sum(reports) == 2 * count_agent_steps(cell)


def test_the_work_of_a_cell_has_the_reproduction(design: GuidanceDesign) -> None:
    """Without learning, a lifetime has one step, and most of the time is that of reproduction."""
    (group,) = [group for group in design.groups if group.name == "nk"]
    cell = next(list_cells(group.change_fields({"nk_climbers.trials": (1,)}, runs=2)))
    n_generations = 7 * 4 + 7 + 16 * 101  # Of the arms and of the branches.
    n_genes = 16
    assert count_agent_steps(cell) > n_generations * cell.learner.population.size * n_genes


def test_batches_have_about_the_same_number_of_agents(design: GuidanceDesign) -> None:
    cells = [cell for group in design.groups for cell in list_cells(group)]
    sizes = {
        size: [len(runs) for runs in split_runs(range(50), size, AGENTS_PER_BATCH)]
        for size in (cell.learner.population.size for cell in cells)
    }
    assert sizes[6] == [50]
    assert sizes[100] == [40, 10]
    assert sizes[1000] == [4] * 12 + [2]


@pytest.mark.parametrize("name", ["nk", "chain", "whitley-deceptive", "le-a"])
def test_the_values_of_a_run_do_not_depend_on_its_batch(design: GuidanceDesign, name: str) -> None:
    (group,) = [group for group in design.groups if group.name == name]
    *_, cell = list_cells(group)
    batch = measure_runs(cell, 5, (3, 4, 5), lambda _: None)
    single = measure_runs(cell, 5, (4,), lambda _: None)
    assert batch.sel(run=[4]).identical(single)


def test_a_cell_has_its_arms(design: GuidanceDesign) -> None:
    (group,) = [group for group in design.groups if group.name == "nk"]
    cell = next(list_cells(group))
    names = [arm.name for arm in list_arms(cell)]
    plastic = ["learning", "drift", "yoked"]
    costly = [f"costly-{name}" for name in plastic]
    assert names == ["control", "equal-evaluations", *plastic, *costly]
    evaluations = next(arm for arm in list_arms(cell) if arm.name == "equal-evaluations")
    assert evaluations.last_generation == 3 * 31


def test_a_finished_study_simulates_nothing(quick: CellsRequest) -> None:
    with patch.object(GuidanceTask, "run", side_effect=AssertionError):
        run_guidance(quick, OPTIONS)


def test_a_changed_cell_is_simulated_again(quick: CellsRequest) -> None:
    path = quick.directory / "cells" / "le-a.nc"
    content = path.read_bytes()
    path.unlink()
    simulated: list[str] = []
    run_cell = GuidanceTask.run

    def count(task: GuidanceTask, *arguments: Any) -> xr.Dataset:
        simulated.append(task.name)
        return run_cell(task, *arguments)

    with patch.object(GuidanceTask, "run", count):
        run_guidance(quick, OPTIONS)
    assert simulated == ["le-a"]
    assert path.read_bytes() == content


def test_another_design_is_refused(quick: CellsRequest) -> None:
    with (
        patch.object(run_module, "digest_guidance", lambda: {"design.toml": "changed"}),
        pytest.raises(RefusedError, match="the design has changed since this study began"),
    ):
        run_guidance(quick, OPTIONS)


def test_a_single_run_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ArgumentError, match="must be at least 2"):
        run_guidance(CellsRequest(tmp_path / "guides", runs=1), OPTIONS)
    assert not (tmp_path / "guides").exists()


def test_the_quick_form_has_no_verdict(quick: CellsRequest) -> None:
    page = (quick.directory / "what-guides.html").read_text("utf-8")
    article = (quick.directory / "article.md").read_text("utf-8")
    for text in (page, article):
        assert "too few runs for verdicts, and shows none" in text
        assert not re.search(r"\bP[1-6]\b", text)
    text = re.sub("<style>.*?</style>", "", page, flags=re.DOTALL)
    assert 'class="verdict' not in text
    assert all(f" {verdict}" not in article for verdict in VERDICTS)
    assert not (quick.directory / "claims.json").exists()


def test_the_command_writes_no_verdict_in_the_quick_form(
    quick: CellsRequest, command: Command
) -> None:
    words = ["--quick", "--runs", "2", "--out", str(quick.directory), "--json"]
    done = command("reproduce", "what-guides", *words)
    assert done.code == 0
    assert json.loads(done.out) == {}


def test_the_full_form_has_each_prediction_its_hash_and_each_cell(
    full: CellsRequest, design: GuidanceDesign
) -> None:
    page = (full.directory / "what-guides.html").read_text("utf-8")
    assert all(f"{prediction.id}.</strong>" in page for prediction in design.predictions)
    assert page.count('class="verdict undecided"') == len(design.predictions)
    assert read_digests(full.directory)["design.toml"] in page
    for group in design.groups:
        assert all(cell.name in page for cell in list_cells(group))
    for name in ("effects", "chain", "models"):
        assert (full.directory / "figures" / f"{name}.svg").exists()


def test_the_article_and_the_table_have_the_numbers_of_the_cells(full: CellsRequest) -> None:
    results = read_results(full)
    article = render_article(results)
    cells = results.groups["whitley-deceptive"]
    effects = cells["effect"].sel(arm="learning", start="population", horizon=20)
    assert f"{float(effects.mean()):.3g}" in article
    rows = (full.directory / "what-guides.csv").read_text("utf-8").splitlines()
    arms = 7 * 2 * 3  # Arms, starts and horizons of the cell.
    assert sum(row.startswith("nk,nk-k-0") for row in rows) == arms
    predicted = [row for row in rows if row.startswith("chain,") and not row.endswith(",")]
    assert len(predicted) == 3 * 3


def test_the_figure_has_a_point_per_value_of_each_axis(full: CellsRequest) -> None:
    results = read_results(full)
    figure = draw_effects([results.groups["nk"], results.groups["nk-large"]])
    labels = [[text.get_text() for text in axes.get_xticklabels()] for axes in figure.axes]
    assert labels == [["0", "2", "5"], ["30"], ["100", "1000"], ["0", "20", "100"]]
