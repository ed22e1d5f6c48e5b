"""Whatever is typed, written or sent: an answer, or one clear sentence; never a traceback, and nothing is lost."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Iterator
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path
from typing import Any

import httpx
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from baldwinlab.__main__ import main
from baldwinlab.experiment.fields import ExperimentError
from baldwinlab.experiment.toml import from_toml, to_toml
from baldwinlab.papers.presets import load
from tests.commands import Outcome
from tests.faults.amount import amount
from tests.faults.hostile import VALUES, WORDS
from tests.lab.client import CLIENT, LabServer
from tests.lab.conftest import run_server
from tests.small_studies import make_small_study

SCREEN = 3000  # characters: a message is at most so long
LIFE = ("--condition", "evo/A", "--run", "0", "--generation", "0")
COMMANDS = [  # each is refused for the words that are put in the places of X
    "show X",
    "show evo/A --set X",
    "show evo/A --set learning.rate=X",
    "show evo/A --set world.food.0.count=X",
    "show evo/A --set X=1",
    "show evo/A --part X",
    "run evo/A --runs X --out new",
    "run evo/A --seed X --out new",
    "run evo/A --workers X --out new",
    "run evo/A --backend X --out new",
    "run evo/A --executor X --out new",
    "run X --out new",
    "reproduce X --out new",
    "reproduce --runs X --out new",
    "reproduce --generations X --out new",
    "reproduce --steps X --out new",
    "reproduce --variant X --out new",
    "multiverse --last-generations X --out new",
    "multiverse X --out new",
    "sweep X",
    "assay X",
    "assay study --assays X",
    "report study --last-generations X",
    "report X",
    f"replay study {' '.join(LIFE)} --out X",
    "replay study --condition X --run 0 --generation 0 --out life.nc",
    "replay study --condition evo/A --run X --generation 0 --out life.nc",
    "replay study --condition evo/A --run 0 --generation X --out life.nc",
    "phylogeny study --condition evo/A --run X --out line.csv",
    "check X",
    "check study/study.toml --requirements X",
    "bench --backend X",
    "lab study --no-browser --port X",
    "X",
    "X study",
]


def call(arguments: list[str]) -> Outcome:
    """The command line, in the folder that we are in."""
    out, err, before = StringIO(), StringIO(), sys.argv
    sys.argv = ["baldwinlab", *arguments]
    try:
        with redirect_stdout(out), redirect_stderr(err):
            main()
        code = 0
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else int(bool(end.code))
    finally:
        sys.argv = before
    return Outcome(code, out.getvalue(), err.getvalue())


def contents(folder: Path) -> dict[str, bytes]:
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A folder that holds a study, and nothing else; we are in it."""
    made, before = tmp_path_factory.mktemp("inputs"), Path.cwd()
    make_small_study(made / "study", runs=1)
    os.chdir(made)
    yield made
    os.chdir(before)


ALL_KINDS = settings(
    deadline=None, suppress_health_check=list(HealthCheck), derandomize=True, database=None
)


@settings(ALL_KINDS, max_examples=amount(1000, 60))
@given(st.sampled_from(COMMANDS), WORDS)
def test_a_command_with_an_odd_word_says_what_is_allowed_and_touches_nothing(
    folder: Path, line: str, word: str
) -> None:
    before = contents(folder)
    told = call([each.replace("X", word) for each in line.split(" ")])
    assert "Traceback" not in told.out + told.err
    assert len(told.err) <= SCREEN
    if told.code:
        assert told.code in (1, 2)
        assert (told.err or told.out).strip()  # a check tells what does not hold as what it found
    else:
        assert line.startswith(("show", "X")), (line, word)
    assert contents(folder) == before


@st.composite
def experiments(draw: st.DrawFn) -> str:
    """The text of an experiment in which one thing is another, once or twice."""
    tree: Any = json.loads(json.dumps(load("evo+self-taught/A").to_dict()))
    for _ in range(draw(st.integers(1, 2))):
        place = tree
        while True:
            key = draw(
                st.sampled_from(sorted(place) if isinstance(place, dict) else range(len(place)))
            )
            below = place[key]
            if not isinstance(below, dict | list) or not below or draw(st.integers(0, 4)) == 0:
                break
            place = below
        match draw(st.sampled_from(["value", "value", "removed", "renamed"])):
            case "value":
                place[key] = draw(VALUES)
            case "removed":
                del place[key]
            case "renamed" if isinstance(place, dict):
                place[draw(WORDS)] = place.pop(key)
    return toml(tree)


def toml(tree: dict[str, Any]) -> str:
    """A tree as TOML with tables in one line."""
    return "".join(
        f"{json.dumps(key)} = {inline(value)}\n" for key, value in tree.items() if value is not None
    )


def inline(value: Any) -> str:
    match value:
        case dict():
            inner = ", ".join(
                f"{json.dumps(key)} = {inline(each)}"
                for key, each in value.items()
                if each is not None
            )
            return f"{{{inner}}}"
        case list():
            return f"[{', '.join(inline(each) for each in value if each is not None)}]"
        case float():
            return repr(value)
        case None:
            return '""'
        case _:
            return json.dumps(value)


@settings(ALL_KINDS, max_examples=amount(600, 60))
@given(experiments() | st.text(max_size=200))
def test_an_experiment_is_read_as_it_will_be_written_or_refused_in_a_few_lines(text: str) -> None:
    try:
        found = from_toml(text, "mine.toml")
    except ExperimentError as error:
        assert str(error).startswith("mine.toml")
        assert len(str(error)) <= SCREEN
    else:
        assert from_toml(to_toml(found), "again") == found


QUESTIONS = {
    "studies": {},
    "experiment": {"study": "study", "condition": "evo/A"},
    "results": {"study": "study"},
    "presets": {},
    "preset": {"name": "evo/A"},
    "recording": {"study": "study", "condition": "evo/A", "run": "0", "generation": "0"},
    "agent": {"study": "study", "condition": "evo/A", "run": "0", "generation": "0", "agent": "0"},
    "share": {"study": "study", "condition": "evo/A", "run": "0", "generation": "0"},
    "movie": {"study": "study", "condition": "evo/A", "run": "0", "generation": "0"},
    "report": {"study": "study"},
}


@pytest.fixture(scope="module")
def server(folder: Path) -> Iterator[LabServer]:
    with run_server(folder) as running:
        yield running


@settings(ALL_KINDS, max_examples=amount(300, 40))
@given(
    st.sampled_from(
        [(name, key) for name, query in QUESTIONS.items() for key in (*query, "other")]
    ),
    WORDS,
)
def test_the_lab_answers_an_odd_question_in_a_sentence(
    folder: Path, server: LabServer, which: tuple[str, str], word: str
) -> None:
    (name, key), before = which, contents(folder)
    answer = CLIENT.get(f"{server.address}/api/{name}", params={**QUESTIONS[name], key: word})
    require_sense(answer)
    assert contents(folder) == before


@settings(ALL_KINDS, max_examples=amount(300, 40))
@given(
    st.sampled_from(["validate", "schema", "appearance", "live", "live/x/keep"]),
    VALUES | st.text().map(str.encode) | experiments(),
)
def test_the_lab_takes_an_odd_order_with_a_sentence(
    folder: Path, server: LabServer, name: str, body: Any
) -> None:
    before = contents(folder)
    content = body if isinstance(body, bytes) else json.dumps(body).encode("utf-8", "surrogatepass")
    answer = CLIENT.post(f"{server.address}/api/{name}", content=content)
    require_sense(answer)
    assert contents(folder) == before


def require_sense(answer: httpx.Response) -> None:
    """An answer, or a refusal whose sentence a page can show."""
    assert answer.status_code < 500
    if answer.status_code >= 400:
        assert "Traceback" not in answer.text
        assert len(answer.text) <= SCREEN
