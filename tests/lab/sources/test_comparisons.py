"""Tests of comparisons from the page: results, limits and control."""

from __future__ import annotations

import shlex
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest

import baldwinlab as bl
from baldwinlab.api.run import sweep as run_sweep
from baldwinlab.lab import Lab, MissingError
from baldwinlab.lab.sources import comparison_plan
from baldwinlab.lab.sources.comparison_plan import make_comparison_plan
from baldwinlab.lab.sources.comparisons import Comparisons
from baldwinlab.lab.sources.live import Live
from baldwinlab.lab.sources.studies import summarize
from baldwinlab.papers.presets import load
from baldwinlab.studies.records import StudyError
from baldwinlab.studies.store import StudyStore
from tests.commands import Command
from tests.lab.client import CLIENT, get_json, wait_until
from tests.lab.conftest import run_server
from tests.small_studies import read_records, shorten_preset

HUGE = (
    shorten_preset()
    .replace(lifetime={"steps": 100_000}, evolution={"generations": 10_000})
    .to_dict()
)
LEARNERS = [
    f"{name}/A" for name in ("evo", "self-taught", "evo+self-taught", "evo+drift", "evo+hebb")
]
RATES = {"learning.rate": [0.01, 0.1]}


def make_request(fields: Any = None, **changes: Any) -> dict[str, Any]:
    """Return a request as the page sends it: a preset, and an experiment with changes."""
    request = {
        "preset": "evo+self-taught/A",
        "experiment": shorten_preset().to_dict(),
        "runs": 2,
        "seed": 5,
    }
    return request | {"fields": RATES if fields is None else fields} | changes


@pytest.fixture
def comparisons() -> Iterator[Comparisons]:
    live_comparisons = Comparisons()
    yield live_comparisons
    live_comparisons.close()


def test_a_sweep_is_identical_to_that_of_the_command_line_with_its_file(
    comparisons: Comparisons, tmp_path: Path
) -> None:
    plan = make_comparison_plan(make_request())
    assert tomllib.loads(plan.toml)["set"] == {
        "evolution.generations": 3,
        "lifetime.steps": 300,
        "world.start.x": 400.0,
    }
    live = comparisons.start(plan, tmp_path, "live/rates")
    wait_until(lambda: live.has_ended)
    summary = live.summarize()
    assert summary.items() >= {"state": "done", "stored": 4, "runs": 4, "share": 1}.items()
    (tmp_path / "rates.toml").write_text(plan.toml)
    expected = run_sweep(tmp_path / "rates.toml", out=tmp_path / "command", workers=1)
    assert read_records(tmp_path / "live/rates") == read_records(expected.directory)
    assert StudyStore(tmp_path / "live/rates").experiments["point-0001"].learning.rate == 0.1
    assert (tmp_path / "live/rates/sweep.toml").read_text() == plan.toml
    # The lists of the World tab show the values instead of the names of points.
    conditions = summarize(Lab(tmp_path, Live()), "live/rates")["conditions"]
    titles = [condition["title"] for condition in conditions]
    assert titles == ["learning.rate = 0.01", "learning.rate = 0.1"]


def test_the_changes_of_the_form_apply_to_all_presets_as_those_of_the_command_line(
    comparisons: Comparisons, tmp_path: Path, command: Command
) -> None:
    """One list of items has another number of regions, and the rate is unused by evo/A."""
    food = [{"x": [300, 340], "y": [100, 480], "count": 3}]
    form = shorten_preset().replace(world={"food": food}, learning={"rate": 0.5})
    names = ["evo/A", "evo+self-taught/A"]
    plan = make_comparison_plan(make_request(experiment=form.to_dict(), presets=names))
    live = comparisons.start(plan, tmp_path, "changed")
    wait_until(lambda: live.has_ended)
    assert live.state == "done"
    stored = StudyStore(tmp_path / "changed").experiments
    assert [experiment.world for experiment in stored.values()] == [form.world, form.world]
    program, *arguments = shlex.split(plan.command)
    assert program == "baldwinlab"
    start = arguments.index("--set") + 1
    assert arguments[start:] == list(plan.changes)
    assert command(*arguments, "--out", str(tmp_path / "command")).code == 0
    assert read_records(tmp_path / "changed") == read_records(tmp_path / "command")


@pytest.mark.parametrize(
    ("presets", "message"),
    [
        (["evo/A", "no-teacher"], "the changes of the form do not apply to no-teacher: world"),
        (["evo/A", "evo/B"], "no ticked preset uses this change of the form: learning.rate"),
    ],
)
def test_a_change_of_the_form_that_no_condition_can_use_is_refused(
    presets: list[str], message: str
) -> None:
    form = load("evo+self-taught/A").replace(learning={"rate": 0.5})
    if "no-teacher" in presets:
        form = form.replace(world={"start": {"x": 400}})
    request = make_request(experiment=form.to_dict(), presets=presets)
    with pytest.raises(ValueError, match=message):
        make_comparison_plan(request)


def test_presets_are_a_study_as_that_of_the_command_line(
    comparisons: Comparisons, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(comparison_plan, "load_preset", shorten_preset)
    names = ["evo/A", "evo+self-taught/A"]
    plan = make_comparison_plan({"presets": names, "runs": 5, "seed": 5})
    assert plan.command == "baldwinlab run evo/A evo+self-taught/A --runs 5 --seed 5"
    live = comparisons.start(plan, tmp_path, "live/pair")
    wait_until(lambda: live.has_ended)
    assert (live.state, live.summarize()["subject"]) == ("done", "2 presets")
    changes = {"evolution.generations": 3, "lifetime.steps": 300, "world.start.x": 400}
    expected = bl.run(names, runs=5, seed=5, out=tmp_path / "command", set=changes, workers=1)
    assert read_records(tmp_path / "live/pair") == read_records(expected.directory)
    stored = (tmp_path / "live/pair/study.toml").read_text()
    assert stored == (expected.directory / "study.toml").read_text()
    results = bl.open_study(tmp_path / "live/pair").compare()
    assert results["condition_b"].tolist() == ["evo/A", "evo/A"]


@pytest.mark.parametrize(
    ("names", "runs", "note"),
    [
        (["evo/A", "evo/B"], 5, ""),
        (["evo/A", "evo/B"], 4, ""),
        (["evo/A", "evo+drift/A"], 4, "No verdict is possible. With 4 runs and 2 tests, "),
        # With 8 tests, the smallest corrected p of 5 and 5 runs is 8 x 2 / 252.
        (LEARNERS, 5, "No verdict is possible. With 5 runs and 8 tests, "),
    ],
)
def test_too_few_runs_are_noted_before_the_start(names: list[str], runs: int, note: str) -> None:
    plan = make_comparison_plan({"presets": names, "runs": runs, "seed": 0})
    assert plan.describe_too_few_runs().startswith(note)
    assert bool(plan.describe_too_few_runs()) == bool(note)


def test_an_unknown_preset_is_rejected() -> None:
    with pytest.raises(MissingError, match="there is no preset 'evo/nowhere'"):
        make_comparison_plan({"presets": ["evo/A", "evo/nowhere"], "runs": 5, "seed": 0})


def test_at_most_one_comparison_is_active_and_a_stopped_one_preserves_its_folder(
    comparisons: Comparisons, tmp_path: Path
) -> None:
    long = shorten_preset().replace(evolution={"generations": 5000}).to_dict()
    live = comparisons.start(make_comparison_plan(make_request(experiment=long)), tmp_path, "long")
    wait_until(lambda: live.agent_steps_done > 0)
    assert (live.summarize()["seconds_left"] or 0) > 0
    with pytest.raises(ValueError, match="the comparison long is active; stop it first"):
        comparisons.start(make_comparison_plan(make_request()), tmp_path, "other")
    live.stop()
    wait_until(lambda: live.has_ended)
    assert (live.state, live.summarize()["stored"]) == ("stopped", 0)
    with pytest.raises(StudyError, match="long exists already"):
        comparisons.start(make_comparison_plan(make_request()), tmp_path, "long")


def test_a_failed_comparison_has_an_error_message(
    comparisons: Comparisons, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*arguments: Any, **options: Any) -> None:
        raise OSError("the disk is full")

    monkeypatch.setattr("baldwinlab.lab.sources.comparisons.run_study", fail)
    live = comparisons.start(make_comparison_plan(make_request()), tmp_path, "it")
    wait_until(lambda: live.has_ended)
    assert (live.state, live.message) == ("failed", "the comparison failed: the disk is full")


@pytest.mark.parametrize(
    ("request_body", "message"),
    [
        *(
            (
                {"presets": names, "runs": 5, "seed": 0},
                "presets must be a list of two or more different names",
            )
            for names in (["evo/A"], ["evo/A", "evo/A"], "evo/A", [1, 2])
        ),
        (make_request(fields={}), "fields: name at least one field to sweep"),
        (make_request(fields={"learning.speed": [1]}), "there is no 'speed' here"),
        (make_request(fields={"learning.rate": [11]}), "learning.rate = 11"),
        (make_request(fields={"learning.rate": [1, 1]}), "fields.learning.rate has a value twice"),
        (make_request(fields=[1]), "fields must contain each compared field with its values"),
        (
            make_request(fields={"learning.rate": [n / 1000 for n in range(501)]}),
            "1,000 runs of all conditions, and this one would have 1,002",
        ),
        (
            make_request(experiment=HUGE),
            "a comparison from the page can have at most 1,000,000,000,000"
            " runs x generations x agents x steps x weights",
        ),
    ],
)
def test_an_invalid_comparison_is_rejected_with_a_message(
    request_body: dict[str, Any], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        make_comparison_plan(request_body)


def test_the_file_of_a_sweep_does_not_set_a_swept_field() -> None:
    changed = shorten_preset().replace(learning={"rate": 0.5})
    plan = make_comparison_plan(make_request(experiment=changed.to_dict()))
    assert "learning.rate" not in tomllib.loads(plan.toml)["set"]


def test_a_change_that_the_file_of_a_sweep_cannot_contain_is_rejected() -> None:
    settings = shorten_preset().to_dict()
    settings["world"]["food"] = settings["world"]["food"] * 2
    message = r"world\.food has a change that the file of a sweep cannot contain"
    with pytest.raises(ValueError, match=message):
        make_comparison_plan(make_request(experiment=settings))


def test_the_plan_of_a_comparison_has_its_size_and_its_duration(tmp_path: Path) -> None:
    with run_server(tmp_path) as server:

        def post(path: str, body: dict[str, Any]) -> httpx.Response:
            return CLIENT.post(f"{server.address}/api/{path}", json=body)

        plan = post("comparison/plan", make_request()).json()
        assert (plan["conditions"], plan["runs"]) == (2, 4)
        assert plan["seconds"] > 0
        assert plan["disk"] > 0
        assert post("comparison/plan", make_request(fields={})).json() == {
            "problem": "sweep.toml: fields: name at least one field to sweep"
        }
        refused = post("comparison", make_request(name="../out"))
        assert refused.status_code == 400
        assert "'../out' is not a valid name of a study" in refused.json()["error"]
        assert get_json(server.address, "comparison") == {"comparison": None}
