"""Atlas of two small maps: cells equal stored assays, and an interrupted atlas continues."""

from __future__ import annotations

import json
import re
from pathlib import Path
from unittest.mock import patch

import numpy as np
import pytest
import xarray as xr

from baldwinlab.analysis.atlas.outcomes import compute_outcomes
from baldwinlab.analysis.estimands.questions import estimate
from baldwinlab.api.atlas import run as run_module
from baldwinlab.api.atlas.publish import (
    QUICK_REASON,
    publish_atlas,
    read_results,
    render_article,
)
from baldwinlab.api.atlas.run import CellTask, choose_generations, run_atlas
from baldwinlab.api.cells import CellsRequest
from baldwinlab.api.run_options import RunOptions
from baldwinlab.api.run_study import StudyRequest, run_missing, run_missing_assays
from baldwinlab.core.errors import ArgumentError
from baldwinlab.models.miniworld.backends.choice import CPU
from baldwinlab.papers import presets
from baldwinlab.papers.atlas_design import AtlasDesign, read_atlas
from baldwinlab.studies.assays.results import read_assays
from baldwinlab.studies.open import open_conditions
from baldwinlab.studies.records import StudyError
from tests.commands import Command

OPTIONS = RunOptions(workers=1)
CLIMBING = presets.load("mayley-1996:costly-climbing/rugged").replace(
    evolution={"generations": 15, "selection": "roulette"}, population={"size": 10}
)


@pytest.fixture(scope="module")
def design() -> AtlasDesign:
    """Return a design with two of the maps, in very few cells."""
    design = read_atlas()
    quick = {
        "correlation": {"nk_climbers.correlation": (0.0, 1.0), "nk_climbers.cost_per_bit": (0.0,)},
        "slope": {"slope_climbers.curvature": (1.0,), "slope_climbers.learning_step": (0.3,)},
    }
    maps = tuple(
        entry.model_copy(update={"quick": quick[entry.name]})
        for entry in design.maps
        if entry.name in quick
    )
    return design.model_copy(update={"maps": maps})


@pytest.fixture(scope="module")
def atlas(design: AtlasDesign, tmp_path_factory: pytest.TempPathFactory) -> CellsRequest:
    """Return a finished atlas."""
    request = CellsRequest(tmp_path_factory.mktemp("atlas") / "atlas", is_quick=True, runs=4)
    with patch.object(run_module, "read_atlas", lambda: design):
        run_atlas(request, OPTIONS)
    return request


def test_a_cell_has_the_outcomes_of_a_study_with_its_assays(tmp_path: Path) -> None:
    study = run_missing(StudyRequest([CLIMBING], tmp_path / "study", runs=3, seed=5), OPTIONS)
    run_missing_assays(study, ["innate", "assimilation", "fork"], OPTIONS)
    runs = open_conditions(study, [CLIMBING.name]).isel(condition=0)
    assays = {name: data[CLIMBING.name] for name, data in read_assays(study).items()}
    expected = {
        answer.question: np.asarray(answer.values) for answer in estimate(runs, assays, CLIMBING, 3)
    }
    cell = CellTask(CLIMBING, (0, 1, 2)).run(5, tmp_path, CPU, lambda _: None)
    outcomes = compute_outcomes(cell)
    # All 15 generations are measured, so the windows are equal.
    assert np.array_equal(outcomes["assimilation"], expected["assimilation"])
    difference = (cell["selection_on"] - cell["selection_off"]).mean("generation")
    assert np.allclose(difference, expected["selection-by-learning"])
    ratio = cell["selection_on"].sum("generation") / cell["selection_off"].sum("generation")
    assert np.allclose(outcomes["selection_ratio"], ratio)
    scale = cell["branch_innate_fitness"].sel(regime="off").mean("run").max()
    assert np.allclose(outcomes["fork_history"] / scale, expected["fork-history"])


def test_progress_adds_up_and_runs_are_independent(tmp_path: Path) -> None:
    both = CellTask(CLIMBING, (0, 1)).run(0, tmp_path, CPU, lambda _: None)
    with patch.object(run_module, "MAX_RECORDED_AGENTS", 1):
        separate = CellTask(CLIMBING, (0, 1)).run(0, tmp_path, CPU, lambda _: None)
    xr.testing.assert_identical(both, separate)
    # Progress adds up to the announced agent steps.
    task = CellTask(CLIMBING, (0,))
    reports: list[int] = []
    task.run(0, tmp_path, CPU, reports.append)
    assert sum(reports) == task.agent_steps


def test_at_most_22_generations_are_measured_with_the_first_and_the_last() -> None:
    for generations in (1, 2, 21, 22, 151, 801):
        measured = choose_generations(CLIMBING.replace(evolution={"generations": generations}))
        assert measured[0] == 0
        assert measured[-1] == generations - 1
        assert len(measured) <= 22


def test_a_finished_atlas_simulates_nothing_and_a_damaged_cell_again(
    atlas: CellsRequest, design: AtlasDesign, capsys: pytest.CaptureFixture[str]
) -> None:
    path = next(iter(sorted((atlas.directory / "correlation" / "cells").glob("*.nc"))))
    content = path.read_bytes()
    path.write_bytes(content[:-40] + bytes(40))
    simulated: list[str] = []
    run_cell = CellTask.run

    def count(task: CellTask, *arguments: object) -> xr.Dataset:
        simulated.append(task.experiment.name)
        return run_cell(task, *arguments)  # type: ignore[arg-type]

    with (
        patch.object(run_module, "read_atlas", lambda: design),
        patch.object(CellTask, "run", count),
    ):
        run_atlas(atlas, OPTIONS)
        run_atlas(atlas, OPTIONS)
    assert simulated == [path.stem]
    assert "the cell is simulated again" in capsys.readouterr().err
    assert path.read_bytes() == content


def test_another_seed_is_refused(atlas: CellsRequest, design: AtlasDesign) -> None:
    request = CellsRequest(atlas.directory, seed=1, is_quick=True)
    with (
        patch.object(run_module, "read_atlas", lambda: design),
        pytest.raises(StudyError, match="another study"),
    ):
        run_atlas(request, OPTIONS)


def test_too_few_runs_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ArgumentError, match="more than the 2 exploratory runs"):
        run_atlas(CellsRequest(tmp_path / "atlas", runs=2, is_quick=True), OPTIONS)
    assert not (tmp_path / "atlas").exists()


@pytest.fixture(scope="module")
def page(atlas: CellsRequest, design: AtlasDesign) -> str:
    """Return the page of the finished atlas."""
    with patch("baldwinlab.api.atlas.publish.read_atlas", lambda: design):
        publish_atlas(atlas)
    return (atlas.directory / "atlas.html").read_text("utf-8")


def test_the_page_has_each_claim_each_cell_its_digest_and_no_script(
    page: str, design: AtlasDesign, atlas: CellsRequest
) -> None:
    assert all(f"{claim.id}.</strong>" in page for claim in design.claims)
    assert page.count('class="cell" id="correlation-') == 2
    # A table links to cells. Figures link to their own shapes.
    cells = set(re.findall('class="cell" id="(slope-[^"]+)"', page))
    assert len(cells) == 2
    assert set(re.findall('href="#(slope-[0-9]+)"', page)) == cells
    assert "<script" not in page
    digests = json.loads((atlas.directory / "frozen.json").read_text("utf-8"))
    assert digests["claims.toml"] in page
    assert digests["registered.toml"] in page
    outcomes = xr.load_dataset(atlas.directory / "correlation.nc")
    assert outcomes["run"].values.tolist() == [2, 3]
    rows = (atlas.directory / "atlas.csv").read_text("utf-8").splitlines()
    assert sum("correlation,point-0000" in row for row in rows) == 9


def test_the_command_writes_the_article_and_the_outcomes_of_each_map(
    atlas: CellsRequest, design: AtlasDesign, command: Command
) -> None:
    words = ["--quick", "--runs", "4", "--out", str(atlas.directory), "--json"]
    with (
        patch.object(run_module, "read_atlas", lambda: design),
        patch("baldwinlab.api.atlas.publish.read_atlas", lambda: design),
    ):
        done = command("reproduce", "atlas", *words)
        results = read_results(atlas)
    assert done.code == 0
    claims = json.loads(done.out)["claims"]
    assert {claim["id"] for claim in claims} == {claim.id for claim in design.claims}
    # The quick form has no verdict, and the page begins with this statement.
    assert {claim["verdict"] for claim in claims} == {"not evaluated"}
    page = (atlas.directory / "atlas.html").read_text("utf-8")
    assert page.index(QUICK_REASON) < page.index('id="laws"')
    assert (atlas.directory / "article.md").read_text("utf-8").startswith("# ")
    assert [result.atlas_map.name for result in results.maps] == ["correlation", "slope"]
    for result in results.maps:
        stored = xr.load_dataset(atlas.directory / f"{result.atlas_map.name}.nc")
        xr.testing.assert_equal(result.outcomes, stored)


def test_two_articles_have_equal_bytes_and_their_pictures(
    atlas: CellsRequest, design: AtlasDesign, page: str
) -> None:
    with patch("baldwinlab.api.atlas.publish.read_atlas", lambda: design):
        article, second = (render_article(read_results(atlas)) for _ in range(2))
    assert article == second
    assert len(article.encode()) > 3000
    pictures = re.findall(r"!\[[^]]+\]\((.+?)\)", article)
    assert len(pictures) == 1 + len(design.maps)
    assert all((atlas.directory / picture).exists() for picture in pictures)
