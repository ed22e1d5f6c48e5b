"""The exported page of a study of several species, in a browser without a server."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Browser, expect

import baldwinlab as bl
from baldwinlab.evolution import GenerationKey
from baldwinlab.lab.binary_frames import unpack
from baldwinlab.lab.life_query import Life, Span, StartData
from baldwinlab.lab.notebook_player import pack_trace
from baldwinlab.lab.recording import record_life
from baldwinlab.lab.stored_page import render_stored_page
from baldwinlab.studies.store import StudyStore
from tests.commands import Command
from tests.lab.conftest import open_offline_page
from tests.worlds import make_predation

N_RUNS = 2


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> bl.Study:
    experiment = make_predation(evolution={"generations": 2}).replace(name="hunt")
    return bl.run(experiment, runs=N_RUNS, out=tmp_path_factory.mktemp("page") / "hunt")


@pytest.mark.nightly
def test_the_page_shows_the_stored_fitness_of_each_species_and_plays_a_lifetime(
    browser: Browser, study: bl.Study, tmp_path: Path
) -> None:
    path = tmp_path / "hunt.html"
    path.write_bytes(render_stored_page(StudyStore(study.directory)))
    data = study.data().isel(condition=0)
    trace = study.replay(run=0, generation=1)
    with open_offline_page(browser, 800) as (page, requests):
        page.goto(path.as_uri())
        rows = page.get_by_role("row").all_inner_texts()[1:]
        for species, (name, row) in enumerate(zip(("predators", "prey"), rows, strict=True)):
            energy = data["energy"].where(data["species"] == species).mean("agent").mean("run")
            means = [f"{value:.4g}" for value in energy.values]
            n_agents = int((data["species"] == species).isel(run=0, generation=1).sum())
            assert row.split() == ["hunt", name, str(N_RUNS), *means, str(n_agents)]
        expect(page.get_by_text("A browser cannot simulate several species")).to_be_visible()
        expect(page.get_by_test_id("legend-species")).to_contain_text("predators")
        page.get_by_test_id("timeline").fill("40")
        eaten = int(trace["eaten"].values[:41].sum())
        expect(page.get_by_test_id("replay-canvas-count")).to_contain_text(f"{eaten} eaten")
    assert [request for request in requests if not request.startswith(("file:", "data:"))] == []


def test_a_replayed_lifetime_is_identical_to_the_recording_of_the_lab(study: bl.Study) -> None:
    trace = study.replay(run=1, generation=1)
    experiment = study.experiment("hunt")
    start = StartData(trace["weight_birth"].values, None, species=trace["species"].values)
    life = Life(experiment, GenerationKey(study.seed, 1, 1), lambda: start)
    recorded = unpack(record_life(life, Span(0, experiment.lifetime.steps), {}))
    packed = unpack(pack_trace(trace))
    assert packed[0]["species"] == recorded[0]["species"]
    assert packed[1].keys() == recorded[1].keys()
    for name, values in recorded[1].items():
        np.testing.assert_array_equal(packed[1][name], values, name)


def test_settings_of_new_runs_are_refused_for_a_page_of_stored_results(
    study: bl.Study, command: Command
) -> None:
    outcome = command("export", str(study.directory), "--seed", "1", "--out", "hunt.html")
    assert outcome.code != 0
    assert "--set and --seed do not apply" in outcome.err
    assert not Path("hunt.html").exists()
