"""A sweep from the page: what is asked for is the one that the command line does, one at a time, and bounded."""

from __future__ import annotations

import time
import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest

from baldwinlab.api.sweep import sweep as sweep_of_command
from baldwinlab.lab import live_sweep
from baldwinlab.lab.live_sweep import Sweeps
from baldwinlab.lab.sweep_plan import make_plan
from baldwinlab.studies.records import StudyError
from baldwinlab.studies.store import StudyStore
from tests.lab.client import CLIENT, get_json
from tests.lab.conftest import run_server
from tests.small_studies import read_records, shorten_preset

HUGE = (
    shorten_preset()
    .replace(lifetime={"steps": 100_000}, evolution={"generations": 10_000})
    .to_dict()
)
RATES = {"learning.rate": [0.01, 0.1]}


def order(fields: Any = None, **more: Any) -> dict[str, Any]:
    """As the page asks: the preset, and the form of it with some changes."""
    asked = {
        "preset": "evo+self-taught/A",
        "experiment": shorten_preset().to_dict(),
        "runs": 2,
        "seed": 5,
    }
    return asked | {"fields": RATES if fields is None else fields} | more


@pytest.fixture
def sweeps() -> Iterator[Sweeps]:
    made = Sweeps()
    yield made
    made.close()


def wait_until(what: Callable[[], bool]) -> None:
    until = time.monotonic() + 60
    while not what():
        assert time.monotonic() < until, "it did not come about"
        time.sleep(0.01)


def test_a_sweep_is_the_study_that_its_own_file_makes_on_the_command_line(
    sweeps: Sweeps, tmp_path: Path
) -> None:
    plan = make_plan(order())
    assert tomllib.loads(plan.toml)["set"] == {
        "evolution.generations": 3,
        "lifetime.steps": 300,
        "world.start.x": 400.0,
    }
    live = sweeps.start(plan, tmp_path, "live/rates")
    wait_until(lambda: live.ended)
    found = live.summary()
    assert (found["state"], found["stored"], found["runs"], found["share"]) == ("done", 4, 4, 1)
    (tmp_path / "rates.toml").write_text(plan.toml)
    command = sweep_of_command(tmp_path / "rates.toml", out=tmp_path / "command", workers=1)
    assert read_records(tmp_path / "live/rates") == read_records(command.directory)
    assert StudyStore(tmp_path / "live/rates").experiments["point-0001"].learning.rate == 0.1
    assert (tmp_path / "live/rates/sweep.toml").read_text() == plan.toml


def test_one_lives_at_a_time_and_one_that_is_stopped_keeps_what_is_stored(
    sweeps: Sweeps, tmp_path: Path
) -> None:
    long = shorten_preset().replace(evolution={"generations": 5000}).to_dict()
    live = sweeps.start(make_plan(order(experiment=long)), tmp_path, "long")
    wait_until(lambda: live.steps_done > 0)
    left = live.summary()["seconds_left"]
    assert left is not None and left > 0
    with pytest.raises(ValueError, match="the sweep long is active; stop it first"):
        sweeps.start(make_plan(order()), tmp_path, "other")
    live.stop()
    wait_until(lambda: live.ended)
    assert (live.state, live.summary()["stored"]) == ("stopped", 0)
    with pytest.raises(StudyError, match="long exists already"):
        sweeps.start(make_plan(order()), tmp_path, "long")


def test_a_sweep_that_fails_says_why(
    sweeps: Sweeps, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*arguments: Any) -> None:
        raise OSError("the disk is full")

    monkeypatch.setattr(live_sweep, "run_study", fail)
    live = sweeps.start(make_plan(order()), tmp_path, "it")
    wait_until(lambda: live.ended)
    assert (live.state, live.message) == ("failed", "the sweep failed: the disk is full")


@pytest.mark.parametrize(
    ("asked", "sentence"),
    [
        (order(fields={}), "fields: name at least one field to sweep"),
        (order(fields={"learning.speed": [1]}), "there is no 'speed' here"),
        (order(fields={"learning.rate": [11]}), "learning.rate = 11"),
        (order(fields={"learning.rate": [1, 1]}), "fields.learning.rate has a value twice"),
        (order(fields=[1]), "fields must contain each swept field with its values"),
        (
            order(fields={"learning.rate": [n / 1000 for n in range(501)]}),
            "1,000 runs over all points, and this one would have 1,002",
        ),
        (
            order(experiment=HUGE),
            "a sweep from the page can have at most 1,000,000,000,000 runs x generations x agents x steps x weights",
        ),
    ],
)
def test_what_cannot_be_or_is_too_large_is_refused_in_a_sentence(
    asked: dict[str, Any], sentence: str
) -> None:
    with pytest.raises(ValueError, match=sentence):
        make_plan(asked)


def test_a_field_that_was_changed_and_is_swept_is_said_once_and_what_a_file_cannot_say_is_refused() -> (
    None
):
    changed = shorten_preset().replace(learning={"rate": 0.5})
    assert (
        "learning.rate"
        not in tomllib.loads(make_plan(order(experiment=changed.to_dict())).toml)["set"]
    )
    tree = shorten_preset().to_dict()
    tree["world"]["food"] = tree["world"]["food"] * 2
    with pytest.raises(
        ValueError, match=r"world\.food has a change that the file of a sweep cannot contain"
    ):
        make_plan(order(experiment=tree))


def test_the_page_is_told_how_large_a_sweep_is_and_about_how_long_it_takes(tmp_path: Path) -> None:
    with run_server(tmp_path) as server:

        def ask(path: str, asked: dict[str, Any]) -> httpx.Response:
            return CLIENT.post(f"{server.address}/api/{path}", json=asked)

        found = ask("sweep/plan", order()).json()
        assert (found["points"], found["runs"]) == (2, 4)
        assert found["seconds"] > 0 and found["disk"] > 0
        assert ask("sweep/plan", order(fields={})).json() == {
            "problem": "sweep.toml: fields: name at least one field to sweep"
        }
        refused = ask("sweep", order(name="../out"))
        assert (
            refused.status_code == 400
            and "'../out' is not a valid name of a study" in refused.json()["error"]
        )
        assert get_json(server.address, "sweep") == {"sweep": None}
