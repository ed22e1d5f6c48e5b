"""Tests of frames: counts and visible agents are those of a replay."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import xarray as xr

from baldwinlab.lab.sources import binary_frames
from baldwinlab.lab.sources.frames import (
    FrameQuery,
    Window,
    WorldCursor,
    make_frames,
    read_frame_query,
)
from baldwinlab.simulation.replay import replay
from tests.lab.client import SMALL, LabServer, get_arrays
from tests.lab.conftest import run_server
from tests.lab.crowds import CROWD_SIZE, make_crowd, make_life
from tests.small_studies import make_small_study
from tests.worlds import make_predation

# A window whose squares have sides of 12 and 8 map units.
WINDOW = Window(left=60, top=40, right=540, bottom=280, columns=40, rows=30, max_shapes=100)
SMALL_WINDOW = WINDOW._replace(left=390, top=150, right=420, bottom=180, max_shapes=2000)


def count_naively(x: npt.NDArray[Any], y: npt.NDArray[Any], window: Window) -> list[int]:
    """Return the number of positions in each square, with a loop over all positions."""
    width = (window.right - window.left) / window.columns
    height = (window.bottom - window.top) / window.rows
    counts = [0] * (window.columns * window.rows)
    for position_x, position_y in zip(x.tolist(), y.tolist(), strict=True):
        column = int((position_x - window.left) // width)
        row = int((position_y - window.top) // height)
        if 0 <= column < window.columns and 0 <= row < window.rows:
            counts[row * window.columns + column] += 1
    return counts


@pytest.fixture(scope="module")
def trace() -> xr.Dataset:
    return replay(make_crowd(), seed=5)


def read_frames(
    cursor: WorldCursor, first: int, interval: int, count: int, window: Window
) -> tuple[dict[str, Any], dict[str, npt.NDArray[Any]]]:
    life = make_life(make_crowd())
    query = FrameQuery(first, interval, count, window)
    return binary_frames.unpack(make_frames(life, cursor, query, {}))


@pytest.fixture
def cursor(monkeypatch: pytest.MonkeyPatch) -> WorldCursor:
    """Return a cursor whose responses have all requested frames."""
    monkeypatch.setattr("baldwinlab.lab.sources.frames.RESPONSE_SECONDS", 60.0)
    return WorldCursor(make_life(make_crowd()))


def test_many_agents_and_items_are_counted_by_square(
    cursor: WorldCursor, trace: xr.Dataset
) -> None:
    header, arrays = read_frames(cursor, 3, 7, 3, WINDOW)
    assert header["frames"] == [3, 10, 17]
    for number, step in enumerate(header["frames"]):
        world = trace.isel(step=step)
        agents = count_naively(world.x.values, world.y.values, WINDOW)
        items = count_naively(world.item_x.values, world.item_y.values, WINDOW)
        assert arrays["agent_counts"][number].tolist() == agents
        assert arrays["item_counts"][number, 0].tolist() == items
        eaten = trace.eaten.isel(step=slice(0, step)).sum("step")
        assert arrays["eaten"][number] == eaten.sum() > 0
        assert arrays["eaters"][number] == (eaten > 0).sum()
    # Five thousand agents and six thousand items of a frame need less than three thousand bytes.
    assert arrays["agent_counts"].nbytes + arrays["item_counts"].nbytes == 3 * 2 * 1200


def test_few_visible_agents_and_items_are_listed(cursor: WorldCursor, trace: xr.Dataset) -> None:
    header, arrays = read_frames(cursor, 20, 1, 2, SMALL_WINDOW)
    agent_start = item_start = 0
    for number, step in enumerate(header["frames"]):
        world = trace.isel(step=step)
        is_visible = SMALL_WINDOW.contains(world.x.values, world.y.values)
        agents = slice(agent_start, agent_start + int(arrays["agent_number"][number]))
        assert arrays["agent"][agents].tolist() == np.flatnonzero(is_visible).tolist()
        assert np.array_equal(arrays["x"][agents], world.x.values[is_visible])
        assert np.array_equal(arrays["y"][agents], world.y.values[is_visible])
        degrees = arrays["heading"][agents] * np.float32(9)
        assert np.array_equal(degrees, world.heading.values[is_visible])
        eaten = trace.eaten.isel(step=slice(0, step)).sum("step").values
        assert np.array_equal(arrays["agent_eaten"][agents], eaten[is_visible])
        is_seen = SMALL_WINDOW.contains(world.item_x.values, world.item_y.values)
        items = slice(item_start, item_start + int(arrays["item_number"][number, 0]))
        assert np.array_equal(arrays["item_x"][items], world.item_x.values[is_seen])
        assert np.array_equal(arrays["item_y"][items], world.item_y.values[is_seen])
        agent_start, item_start = agents.stop, items.stop
    assert agent_start > 20
    assert item_start > 20
    assert arrays["agent"].size == agent_start


def test_earlier_and_later_steps_give_the_same_frames(cursor: WorldCursor) -> None:
    late = read_frames(cursor, 40, 1, 1, WINDOW)[1]["agent_counts"]
    early = read_frames(cursor, 5, 1, 1, WINDOW)[1]["agent_counts"]
    assert not np.array_equal(early, late)
    assert np.array_equal(read_frames(cursor, 40, 1, 1, WINDOW)[1]["agent_counts"], late)


def test_a_response_ends_after_a_limited_time_and_the_next_one_continues(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("baldwinlab.lab.sources.frames.RESPONSE_SECONDS", 0.0)
    monkeypatch.setattr("baldwinlab.lab.sources.frames.PIECE_AGENT_STEPS", 10 * CROWD_SIZE)
    cursor = WorldCursor(make_life(make_crowd()))
    responses = [read_frames(cursor, 25, 1, 8, WINDOW)[0] for _ in range(3)]
    assert [header["frames"] for header in responses] == [[], [], [25]]
    assert [header["simulated"] for header in responses] == [10, 20, 25]


def test_the_oldest_snapshots_are_dropped(
    cursor: WorldCursor, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("baldwinlab.lab.sources.frames.MAX_SNAPSHOT_BYTES", 1)
    assert read_frames(cursor, 0, 1, 3, WINDOW)[0]["simulated"] == 2
    # Step 2 is stored, and step 1 is simulated from the beginning.
    assert read_frames(cursor, 2, 1, 1, WINDOW)[0]["simulated"] == 2
    assert read_frames(cursor, 1, 1, 1, WINDOW)[0]["simulated"] == 1


def test_a_request_without_frames_describes_the_world(lab_server: LabServer) -> None:
    # No other test requests frames of this lifetime, whose steps the server keeps.
    lifetime = SMALL | {"run": 0, "generation": 1}
    header, arrays = get_arrays(lab_server.address, "frames", **lifetime)
    assert header["frames"] == []
    assert (header["steps"], header["agents"], header["simulated"]) == (300, 20, 0)
    assert header["appearance"]["item_kinds"][0]["name"] == "food"
    assert arrays["eaten"].size == 0


def test_the_server_sends_frames_of_a_stored_run(lab_server: LabServer) -> None:
    query = {"first": 290, "interval": 5, "count": 4, "max_shapes": 1000}
    frames: list[int] = []
    while not frames:
        header, arrays = get_arrays(lab_server.address, "frames", **SMALL, **query)
        frames = header["frames"]
    # The lifetime has 300 steps.
    assert {290, 295}.issuperset(frames)
    recorded = get_arrays(lab_server.address, "recording", **SMALL)[1]
    assert np.array_equal(arrays["x"][:20], recorded["x"][290])
    assert arrays["eaten"][0] == recorded["eaten_in_life"][289].sum() > 0


def test_the_frames_of_several_species_name_the_species_of_each_agent(tmp_path: Path) -> None:
    # Tests of the page of a study compile the same predators and prey.
    experiment = make_predation(evolution={"generations": 1}).replace(name="hunt")
    make_small_study(tmp_path / "pair", [experiment], runs=1)
    query = {"study": "pair", "condition": "hunt", "run": 0, "generation": 0}
    with run_server(tmp_path) as server:
        header, arrays = get_arrays(
            server.address, "frames", **query, first=0, count=1, max_shapes=1000
        )
        recorded = get_arrays(server.address, "recording", **query)[1]
    assert [species["name"] for species in header["species"]] == ["predators", "prey"]
    assert np.array_equal(arrays["species"], recorded["species"])
    assert np.array_equal(arrays["x"], recorded["x"][0])
    assert np.array_equal(arrays["y"], recorded["y"][0])


def test_the_default_window_is_the_complete_map() -> None:
    window = read_frame_query({}, make_crowd()).window
    assert window == Window(0, 0, 640, 640, columns=1, rows=1, max_shapes=1)
