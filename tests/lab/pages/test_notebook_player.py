"""Tests of the player of a trace in a notebook."""

from __future__ import annotations

import re
from html import unescape
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from playwright.sync_api import Browser, expect

import baldwinlab as bl
from baldwinlab.evolution import GenerationKey
from baldwinlab.experiment import Experiment
from baldwinlab.lab.pages import notebook_player
from baldwinlab.lab.sources.binary_frames import unpack
from baldwinlab.lab.sources.life_query import Life, Span, StartData
from baldwinlab.lab.sources.recording import record_life
from baldwinlab.simulation.replay import recompute_genomes, replay
from tests.lab.client import open_offline_page
from tests.small_studies import shorten_preset
from tests.worlds import make_predation


@pytest.fixture(scope="module")
def trace() -> xr.Dataset:
    return replay(shorten_preset(), seed=5, run=1, generation=0)


def record_in_lab(experiment: Experiment) -> dict[str, np.ndarray]:
    """Return the recording of the lab, which simulates the lifetime again."""
    key = GenerationKey(5, 1, 0)
    life = Life(
        experiment,
        key,
        lambda: StartData(recompute_genomes(experiment, key, None), None),
    )
    return unpack(record_life(life, Span(0, experiment.lifetime.steps), {}))[1]


@pytest.mark.parametrize("kinds", [["food"], ["food", "nearest"]])
@pytest.mark.usefixtures("in_plain_python")
def test_the_player_is_bit_identical_to_the_recording_of_the_lab(kinds: list[str]) -> None:
    experiment = shorten_preset("evo/A").replace(
        senses={"kinds": kinds}, lifetime={"steps": 40}, world={"start": {"x": 480}}
    )
    actual = unpack(notebook_player.pack_trace(replay(experiment, seed=5, run=1, generation=0)))[1]
    expected = record_in_lab(experiment)
    assert expected.keys() == actual.keys()
    assert expected["eaten_in_life"][-1].sum() > 0
    for name, values in expected.items():
        assert np.array_equal(actual[name], values), name


def test_the_player_of_species_is_bit_identical_to_the_recording_of_the_lab(tmp_path: Path) -> None:
    experiment = make_predation(evolution={"generations": 2}).replace(name="hunt")
    study = bl.run(experiment, runs=2, out=tmp_path / "hunt")
    trace = study.replay(run=1, generation=1)
    start = StartData(trace["weight_birth"].values, None, species=trace["species"].values)
    life = Life(experiment, GenerationKey(study.seed, 1, 1), lambda: start)
    recorded = unpack(record_life(life, Span(0, experiment.lifetime.steps), {}))
    packed = unpack(notebook_player.pack_trace(trace))
    assert packed[0]["species"] == recorded[0]["species"]
    assert packed[1].keys() == recorded[1].keys()
    for name, values in recorded[1].items():
        np.testing.assert_array_equal(packed[1][name], values, name)


def test_selected_steps_of_a_trace_play_and_other_datasets_have_the_xarray_page(
    trace: xr.Dataset,
) -> None:
    part = trace.isel(step=slice(10, 30))
    header, arrays = unpack(notebook_player.pack_trace(part))
    assert (header["first"], header["last"], header["steps"]) == (0, 20, 20)
    assert (arrays["x"] == trace.x.values[10:30]).all()
    assert "<iframe" in notebook_player.format_html(part)
    for dataset in (
        trace.drop_vars("x"),
        trace.isel(agent=0),
        trace.isel(step=slice(0)),
        trace.drop_attrs(),
        xr.Dataset(),
    ):
        assert not notebook_player.is_playable(dataset)
        assert "<iframe" not in notebook_player.format_html(dataset)
        assert "xr-wrap" in notebook_player.format_html(dataset)


def test_only_the_first_steps_of_a_long_lifetime_play(
    trace: xr.Dataset, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(notebook_player, "MAX_AGENT_STEPS", 20 * 7)
    header, arrays = unpack(notebook_player.pack_trace(trace))
    assert (header["last"], header["steps"], len(arrays["x"])) == (7, trace.sizes["step"], 7)


def test_the_player_of_5000_steps_is_small_and_references_no_external_file(
    trace: xr.Dataset,
) -> None:
    page = notebook_player.format_html(
        replay(shorten_preset().replace(lifetime={"steps": 5000}), seed=5)
    )
    assert len(page) < 400_000
    frame = unescape(re.findall(r'srcdoc="([^"]*)"', page)[0])
    assert "default-src 'none'" in frame
    assert not re.findall(r"""(?:src|href)=["'](?!data:)""", frame)


def test_the_attributes_of_a_trace_are_escaped(trace: xr.Dataset) -> None:
    page = notebook_player.format_html(trace.assign_attrs(condition="</iframe><b>\"'", run="<i>"))
    assert "<b>" not in page
    assert "<i>" not in page


def test_the_frame_of_the_player_sends_no_request_and_cannot_read_the_notebook(
    browser: Browser, trace: xr.Dataset, tmp_path: Path
) -> None:
    path = tmp_path / "notebook.html"
    path.write_text(
        f"<!doctype html><meta charset='utf-8'><body>{notebook_player.format_html(trace)}"
    )
    with open_offline_page(browser, 800) as (page, requests):
        page.goto(path.as_uri())
        frame = page.frame_locator("iframe")
        frame.get_by_test_id("timeline").fill("17")
        expect(frame.get_by_test_id("replay-step")).to_have_text("17 / 299")
        eaten = int(trace.eaten.values[:18].sum())
        expect(frame.get_by_test_id("replay-canvas-count")).to_contain_text(f"{eaten} eaten")
        frame.get_by_role("button", name="Play").click()
        expect(frame.get_by_role("button", name="Pause")).to_be_visible()
        title = page.frames[1].evaluate(
            "(() => { try { return parent.document.title } catch { return 'closed' } })()"
        )
        assert title == "closed"
    assert [url for url in requests if not url.startswith(("data:", "file:", "about:"))] == []
