"""Tests of recordings, which are bit-identical to replays."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import xarray as xr

from baldwinlab.evolution import GenerationKey
from baldwinlab.lab.sources import binary_frames, life_query, recording
from baldwinlab.lab.sources.life_query import Life, Span, StartData
from baldwinlab.models.miniworld.appearance import appearance_json
from baldwinlab.papers.presets import load
from baldwinlab.simulation.replay import replay
from baldwinlab.studies.store import StudyStore
from tests.evolution.single_runs import draw_genomes
from tests.lab.client import SMALL, LabServer, get_arrays, get_error
from tests.lab.conftest import run_server
from tests.small_studies import make_small_study, shorten_preset


def trace_of(server: LabServer, condition: str, run: int, generation: int) -> xr.Dataset:
    study = StudyStore(server.root / "small")
    return replay(
        study.experiment(condition),
        seed=study.seed,
        run=run,
        generation=generation,
        energy=study.read(condition, run).energy,
    )


def compute_item_positions(
    arrays: dict[str, npt.NDArray[Any]], first: int, last: int
) -> npt.NDArray[np.float32]:
    """Return the positions of items [step, (x, y), item], computed as in the page."""
    current = np.stack([arrays["item_x"], arrays["item_y"]])
    positions = []
    for step in range(first, last):
        for move in np.flatnonzero(arrays["move_step"] == step):
            item = arrays["move_item"][move]
            current[:, item] = arrays["move_x"][move], arrays["move_y"][move]
        positions.append(current.copy())
    return np.array(positions)


def check_recording(
    arrays: dict[str, npt.NDArray[Any]], trace: xr.Dataset, first: int, last: int
) -> None:
    """Check that the recording of a span of steps is the replay."""
    part = trace.isel(step=slice(first, last))
    assert np.array_equal(arrays["x"], part.x)
    assert np.array_equal(arrays["y"], part.y)
    assert np.array_equal(arrays["heading"] * np.float32(9), part.heading)
    assert np.array_equal(arrays["action"], part.action)
    assert np.array_equal(arrays["sensor"], (part.sensor.values * [1, 2, 4]).sum(axis=-1))
    assert np.array_equal(
        arrays["eaten_in_life"], trace.eaten.cumsum("step").isel(step=slice(first, last))
    )
    assert np.array_equal(
        compute_item_positions(arrays, first, last),
        np.stack([part.item_x, part.item_y], axis=1),
    )


@pytest.mark.parametrize("condition", ["evo/A", "evo+self-taught/A"])
@pytest.mark.parametrize("generation", [0, 2])
def test_a_recording_of_a_stored_run_is_its_replay(
    lab_server: LabServer, condition: str, generation: int
) -> None:
    trace = trace_of(lab_server, condition, 1, generation)
    query = {"study": "small", "condition": condition, "run": 1, "generation": generation}
    header, arrays = get_arrays(lab_server.address, "recording", **query)
    check_recording(arrays, trace, 0, 300)
    assert trace.eaten.sum() > 0
    assert arrays["move_step"].size == trace.eaten[:-1].sum()
    assert header["source"] == {name: str(value) for name, value in query.items()}
    expected = {"condition": condition, "run": 1, "generation": generation, "seed": 5}
    expected |= {"first": 0, "last": 300, "steps": 300, "agents": 20, "items": 50}
    assert expected.items() <= header.items()
    assert header["learns"] == (condition != "evo/A")
    assert header["layer_sizes"] == [3, 10, 3]
    assert header["world"]["food"][0]["x"] == [400, 560]
    assert header["appearance"] == json.loads(
        appearance_json(StudyStore(lab_server.root / "small").experiment(condition))
    )


def test_a_span_of_steps_is_the_span_of_the_replay(lab_server: LabServer) -> None:
    header, arrays = get_arrays(lab_server.address, "recording", **SMALL, first=120, last=170)
    assert (header["first"], header["last"], header["steps"]) == (120, 170, 300)
    check_recording(arrays, trace_of(lab_server, "evo+self-taught/A", 1, 2), 120, 170)


def test_a_preset_is_simulated_without_a_study(lab_server: LabServer) -> None:
    _, arrays = get_arrays(
        lab_server.address,
        "recording",
        preset="evo+self-taught/A",
        seed=3,
        run=1,
        generation=1,
        last=400,
    )
    check_recording(arrays, replay(load("evo+self-taught/A"), seed=3, run=1, generation=1), 0, 400)


def test_genomes_that_are_not_stored_are_recomputed(tmp_path: Path) -> None:
    sparse = shorten_preset().replace(record={"genome_every": 100})
    study = make_small_study(tmp_path / "small", [sparse], runs=1)
    with run_server(tmp_path) as server:
        _, arrays = get_arrays(
            server.address, "recording", study="small", condition=sparse.name, run=0, generation=1
        )
    check_recording(arrays, replay(sparse, seed=study.seed, generation=1), 0, 300)


def test_a_world_without_food_is_recorded() -> None:
    life = make_life(shorten_preset().replace(world={"food": []}))
    header, arrays = binary_frames.unpack(recording.record_life(life, Span(0, 10), {}))
    assert header["items"] == 0
    assert arrays["move_step"].size == 0
    assert not arrays["eaten_in_life"].any()


def test_real_valued_inputs_are_recorded_unchanged(in_plain_python: None) -> None:
    experiment = shorten_preset("evo/A").replace(
        senses={"kinds": ["food", "nearest", "smell"]}, lifetime={"steps": 50}
    )
    header, arrays = binary_frames.unpack(
        recording.record_life(make_life(experiment), Span(0, 50), {})
    )
    assert header["appearance"]["is_continuous"] == [False] * 3 + [True] * 4
    sensor = arrays["sensor"].reshape(50, 20, 7)
    trace = replay(experiment)
    assert np.array_equal(sensor, trace.sensor[:50])
    assert np.unique(sensor).size > 100
    bytes_per_agent = recording.BYTES_PER_AGENT_STEP + 28
    assert recording.estimate_bytes_per_step(experiment) == 20 * bytes_per_agent


def make_life(experiment: Any) -> Life:
    """Return the first generation of an experiment."""
    key = GenerationKey(0, 0, 0)
    return Life(experiment, key, lambda: StartData(draw_genomes(experiment, key), None))


def test_a_recording_of_several_worlds_is_the_replay_of_world_0() -> None:
    experiment = shorten_preset("evo/A").replace(
        population={"worlds": 4}, lifetime={"repeats": 2}, evolution={"generations": 1}
    )
    header, arrays = binary_frames.unpack(
        recording.record_life(make_life(experiment), Span(0, 300), {})
    )
    trace = replay(experiment)
    assert header["agents"] == trace.sizes["agent"] == 5
    check_recording(arrays, trace, 0, 300)


def test_a_large_world_is_recorded_in_spans_of_limited_size(
    lab_server: LabServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert life_query.read_span(
        {}, 5000, recording.estimate_bytes_per_step(shorten_preset())
    ) == Span(0, 5000)
    large = recording.estimate_bytes_per_step(shorten_preset().replace(population={"size": 1000}))
    spans = [life_query.read_span({}, 5000, large)]
    while spans[-1].stop < 5000:
        spans.append(life_query.read_span({"first": str(spans[-1].stop)}, 5000, large))
    assert max(last - first for first, last in spans) * large <= life_query.MAX_RESPONSE_BYTES
    assert len(spans) == 3
    assert life_query.read_span({}, 100_000_000, 20) == Span(0, life_query.MAX_RESPONSE_STEPS)
    assert life_query.read_span({}, 5000, 10**9) == Span(0, 1)
    monkeypatch.setattr(
        life_query, "MAX_RESPONSE_BYTES", 100 * recording.estimate_bytes_per_step(shorten_preset())
    )
    header, arrays = get_arrays(lab_server.address, "recording", **SMALL, first=7)
    assert (header["first"], header["last"], len(arrays["x"])) == (7, 107, 100)


def test_a_damaged_record_is_named(tmp_path: Path) -> None:
    study = make_small_study(tmp_path / "small", [shorten_preset()], runs=1)
    path = study.path("evo+self-taught/A", 0)
    content = bytearray(path.read_bytes())
    content[-5] ^= 1
    path.write_bytes(content)
    with run_server(tmp_path) as server:
        for endpoint, agent in (("recording", {}), ("agent", {"agent": 0})):
            message = get_error(server.address, endpoint, 400, **(SMALL | {"run": 0} | agent))
            assert message == f"{path} is damaged: its checksum does not fit its content"
        assert "is damaged" in get_error(server.address, "results", 400, study="small")


@pytest.mark.parametrize(
    "teacher_rule", ["best", pytest.param("nearest", marks=pytest.mark.nightly)]
)
def test_the_recorded_teachers_have_eaten(teacher_rule: str, in_plain_python: None) -> None:
    experiment = shorten_preset("evo/A").replace(
        learning={"rule": "imitation", "imitation": {"teacher": teacher_rule, "min_items": 1}}
    )
    key = GenerationKey(1, 0, 0)
    life = Life(experiment, key, lambda: StartData(draw_genomes(experiment, key), None))
    _, arrays = binary_frames.unpack(recording.record_life(life, Span(0, 300), {}))
    agents = np.arange(20)
    eaten = np.vstack([np.zeros(20), arrays["eaten_in_life"]])
    assert eaten[-1].any(), "no agent ate"
    for step, teacher in enumerate(arrays["teacher"]):
        learns = teacher != agents
        assert (eaten[step + 1][teacher[learns]] > 0).all(), "a teacher has eaten nothing"
        if teacher_rule == "best" and eaten[step].any():
            best = {eaten[step].argmax(), eaten[step + 1].argmax()}
            assert len(set(teacher)) == 1
            assert set(teacher) <= best
    assert (arrays["teacher"] != agents).any()


def test_a_recording_has_no_teachers_if_no_agent_learns_from_another(
    lab_server: LabServer,
) -> None:
    assert "teacher" not in get_arrays(lab_server.address, "recording", **SMALL)[1]
