"""Invalid commands, files and requests get an answer or a clear message, never a traceback."""

from __future__ import annotations

import json
import os
import re
import string
import sys
from collections.abc import Iterator
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path
from typing import Any

import httpx
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from baldwinlab.__main__ import main
from baldwinlab.experiment.fields import ExperimentError
from baldwinlab.experiment.toml import from_toml, to_toml
from baldwinlab.papers.presets import load
from tests.commands import Outcome
from tests.faults import amount
from tests.lab.client import CLIENT, LabServer
from tests.lab.conftest import run_server
from tests.small_studies import make_small_study

NUMBERS = [
    "-1",
    "-0.5",
    "0.5",
    "1e3",
    "0x10",
    "1_000",
    "nan",
    "inf",
    "\u0661",
    "\u00bd",
    "9" * 20,
    "-" + "9" * 400,
    "9" * 5000,
]
SYMBOLS = [
    "",
    " ",
    "true",
    "null",
    "[1]",
    "{}",
    "--",
    "-",
    "=",
    "a=b",
    "a" * 5000,
    "a\nb",
    "%s%n",
    "{0}",
    "\U0001f4a5",
    "\x1b[2J",
    "\x7f",
]
PATHS = [
    "..",
    "../..",
    "/dev/null",
    "/proc/self/mem",
    "~",
    "$HOME",
    "study/study.toml",
    "no/such/file.nc",
    "x.avi",
]
TEXTS = st.text(st.characters(exclude_categories=["Cs"], exclude_characters="\0"), max_size=30)
_ODD_WORDS = st.sampled_from(NUMBERS) | st.sampled_from(SYMBOLS) | st.sampled_from(PATHS)
WORDS = _ODD_WORDS | TEXTS
# Hypothesis also draws constants of the tested code, such as "report". Every number, name and path
# that a command accepts consists of these characters.
INVALID_WORDS = _ODD_WORDS | TEXTS.filter(lambda text: not re.fullmatch(r"[\w./:@+-]+", text, re.A))

_keys = st.text(string.ascii_letters + "_.", max_size=12)
VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | WORDS,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(_keys, inner, max_size=3),
    max_leaves=6,
)


# The maximum number of characters of a message.
MAX_MESSAGE_LENGTH = 3000
LIFETIME = ("--condition", "evo/A", "--run", "0", "--generation", "0")
# Any word replaces X. A valid one does no harm.
SHOW_COMMANDS = [
    "show X",
    "show evo/A --set X",
    "show evo/A --set learning.rate=X",
    "show evo/A --set world.food.0.count=X",
    "show evo/A --set X=1",
    "show evo/A --part X",
]
# An invalid word replaces X. With a valid one, a command could run for hours.
COMMANDS = [
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
    "report study --claims X",
    f"replay study {' '.join(LIFETIME)} --out X",
    "replay study --condition X --run 0 --generation 0 --out life.nc",
    "replay study --condition evo/A --run X --generation 0 --out life.nc",
    "replay study --condition evo/A --run 0 --generation X --out life.nc",
    "phylogeny study --condition evo/A --run X --out line.csv",
    "check X",
    "check study/study.toml --requirements X",
    "lab study --no-browser --port X",
    "X",
    "X study",
]


def run_command(arguments: list[str]) -> Outcome:
    """Run the command line in the current directory."""
    out = StringIO()
    err = StringIO()
    before = sys.argv
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
    """Return the current directory, which contains only a study."""
    directory = tmp_path_factory.mktemp("inputs")
    before = Path.cwd()
    make_small_study(directory / "study", runs=1)
    os.chdir(directory)
    yield directory
    os.chdir(before)


@settings(max_examples=amount(1000, 60))
@given(
    st.tuples(st.sampled_from(SHOW_COMMANDS), WORDS)
    | st.tuples(st.sampled_from(COMMANDS), INVALID_WORDS)
)
def test_a_command_with_an_invalid_word_prints_an_error_and_changes_no_file(
    folder: Path, command: tuple[str, str]
) -> None:
    line, word = command
    before = contents(folder)
    outcome = run_command([argument.replace("X", word) for argument in line.split(" ")])
    assert "Traceback" not in outcome.out + outcome.err
    assert len(outcome.err) <= MAX_MESSAGE_LENGTH
    if outcome.code:
        assert outcome.code in (1, 2)
        # The command `check` prints failed requirements to standard output.
        assert (outcome.err or outcome.out).strip()
    else:
        assert line.startswith(("show", "X")), (line, word)
    assert contents(folder) == before


@st.composite
def experiments(draw: st.DrawFn) -> str:
    """Return the text of an experiment with one or two random changes."""
    tree: Any = json.loads(json.dumps(load("evo+self-taught/A").to_dict()))
    for _ in range(draw(st.integers(1, 2))):
        table = tree
        while True:
            key = draw(
                st.sampled_from(sorted(table) if isinstance(table, dict) else range(len(table)))
            )
            child = table[key]
            if not isinstance(child, dict | list) or not child or draw(st.integers(0, 4)) == 0:
                break
            table = child
        match draw(st.sampled_from(["value", "value", "removed", "renamed"])):
            case "value":
                table[key] = draw(VALUES)
            case "removed":
                del table[key]
            case "renamed" if isinstance(table, dict):
                table[draw(WORDS)] = table.pop(key)
    return format_toml(tree)


def format_toml(tree: dict[str, Any]) -> str:
    """Return a tree as TOML with inline tables."""
    return "".join(
        f"{json.dumps(key)} = {format_value(value)}\n"
        for key, value in tree.items()
        if value is not None
    )


def format_value(value: Any) -> str:
    match value:
        case dict():
            pairs = [
                f"{json.dumps(key)} = {format_value(element)}"
                for key, element in value.items()
                if element is not None
            ]
            return f"{{{', '.join(pairs)}}}"
        case list():
            elements = [format_value(element) for element in value if element is not None]
            return f"[{', '.join(elements)}]"
        case float():
            return repr(value)
        case None:
            return '""'
        case _:
            return json.dumps(value)


@settings(max_examples=amount(600, 60))
@given(experiments() | st.text(max_size=200))
def test_an_experiment_is_read_and_written_unchanged_or_refused_in_a_few_lines(text: str) -> None:
    try:
        experiment = from_toml(text, "mine.toml")
    except ExperimentError as error:
        assert str(error).startswith("mine.toml")
        assert len(str(error)) <= MAX_MESSAGE_LENGTH
    else:
        assert from_toml(to_toml(experiment), "again") == experiment


REQUESTS = {
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


@settings(max_examples=amount(300, 40))
@given(
    st.sampled_from([(name, key) for name, query in REQUESTS.items() for key in (*query, "other")]),
    WORDS,
)
def test_the_lab_answers_an_invalid_query_with_a_message(
    folder: Path, server: LabServer, request: tuple[str, str], word: str
) -> None:
    name, key = request
    before = contents(folder)
    response = CLIENT.get(f"{server.address}/api/{name}", params={**REQUESTS[name], key: word})
    require_valid_response(response)
    assert contents(folder) == before


@settings(max_examples=amount(300, 40))
@given(
    st.sampled_from(["validate", "schema", "appearance", "live", "live/x/keep"]),
    VALUES | st.text().map(str.encode) | experiments(),
)
def test_the_lab_answers_an_invalid_body_with_a_message(
    folder: Path, server: LabServer, name: str, body: Any
) -> None:
    before = contents(folder)
    content = body if isinstance(body, bytes) else json.dumps(body).encode("utf-8", "surrogatepass")
    response = CLIENT.post(f"{server.address}/api/{name}", content=content)
    require_valid_response(response)
    assert contents(folder) == before


def require_valid_response(response: httpx.Response) -> None:
    """Require a result, or an error with a short message."""
    assert response.status_code < 500
    if response.status_code >= 400:
        assert "Traceback" not in response.text
        assert len(response.text) <= MAX_MESSAGE_LENGTH
