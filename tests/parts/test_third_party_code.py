"""Test that code of a part neither ends, nor moves, nor prints on behalf of a command."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest

import baldwinlab as bl
from baldwinlab.core.errors import PartError
from baldwinlab.core.third_party_code import run_third_party_code
from baldwinlab.parts.loading import load_file
from tests.commands import Command

RULE = """
from baldwinlab.parts import SynapticRule


class Rule(SynapticRule, name="third-party-rule"):
    @staticmethod
    def compute_change(part, state, synapse, lane):
        return synapse.y
"""
FAILING_RULE = """
from baldwinlab.parts import LearningRule


class Rule(LearningRule, name="third-party-rule"):
    @staticmethod
    def learn(part, model, state, step, lane):
        if state.generation[0] == 1:
            raise ValueError("boom")
"""
SMALL = {
    "population": {"size": 2},
    "lifetime": {"steps": 20},
    "evolution": {"generations": 2},
}


def run_command(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "baldwinlab", *arguments],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.parametrize(
    ("statement", "reason"),
    [
        ("import sys; sys.exit(0)", "SystemExit: 0 (rule.py:1)"),
        ("raise SystemExit", "SystemExit (rule.py:1)"),
        ("raise KeyboardInterrupt", "KeyboardInterrupt (rule.py:1)"),
        ("raise GeneratorExit", "GeneratorExit (rule.py:1)"),
        ("1 / 0", "ZeroDivisionError: division by zero (rule.py:1)"),
        ("def", "SyntaxError: invalid syntax (rule.py, line 1)"),
    ],
)
def test_an_exception_of_a_part_is_reported_with_its_file_and_line(
    tmp_path: Path, statement: str, reason: str
) -> None:
    (tmp_path / "rule.py").write_text(statement + RULE)
    outcome = run_command(tmp_path, "show", "evo/A", "--part", "rule.py")
    assert outcome.returncode == 2
    assert outcome.stdout == ""
    assert outcome.stderr == f"baldwinlab: rule.py cannot be loaded: {reason}\n"


def test_the_output_of_a_part_goes_to_stderr_and_the_folder_stays(tmp_path: Path) -> None:
    noise = "import os; os.chdir('/'); print('text'); os.write(1, b'bytes\\n')\n"
    (tmp_path / "rule.py").write_text(noise + RULE)
    outcome = run_command(tmp_path, "show", "evo/A", "--json", "--part", "rule.py")
    assert json.loads(outcome.stdout)["name"] == "evo/A"
    assert sorted(outcome.stderr.split()) == ["bytes", "text"]
    settings = ["population.size=2", "lifetime.steps=20", "evolution.generations=1"]
    run_command(
        tmp_path, "run", "evo/A", "--runs", "1", "--part", "rule.py", "--out", "study",
        "--set", "learning.rule=third-party-rule", *settings,
    )  # fmt: skip
    assert (tmp_path / "study" / "study.toml").is_file()


@pytest.mark.parametrize("name", ["'\\x1b[2J'", "5", "'a/b'"])
def test_a_name_that_is_no_name_of_a_part_is_refused(command: Command, name: str) -> None:
    Path("rule.py").write_text(RULE.replace('"third-party-rule"', name), encoding="utf-8")
    outcome = command("show", "evo/A", "--part", "rule.py")
    assert outcome.code == 2
    assert f"the learning rule {name}: its name must be letters, digits" in outcome.err


def test_two_files_with_parts_of_one_name_are_refused(command: Command) -> None:
    Path("first.py").write_text(RULE, encoding="utf-8")
    Path("copy.py").write_text(RULE, encoding="utf-8")
    Path("second.py").write_text(RULE.replace(".y", ".x"), encoding="utf-8")
    outcome = command("show", "evo/A", "--part", "first.py", "--part", "second.py")
    assert outcome.code == 2
    assert "first.py and second.py both define the learning rule 'third-party-rule'" in outcome.err
    assert command("show", "evo/A", "--part", "first.py", "--part", "copy.py").code == 0


def test_a_changed_version_of_a_file_replaces_the_earlier_version(tmp_path: Path) -> None:
    file = tmp_path / "rule.py"
    file.write_text(RULE)
    first = load_file(file)
    file.write_text(RULE.replace("synapse.y", "synapse.x"))
    assert load_file(file).Rule is not first.Rule


def test_the_state_of_the_process_is_restored() -> None:
    folder = Path.cwd()
    before = np.random.get_state(legacy=False)["state"]["key"].copy()  # noqa: NPY002
    handler = signal.getsignal(signal.SIGINT)
    filters = [*warnings.filters]
    with run_third_party_code({}, "the part"):
        os.chdir("/")
        np.random.seed(7)  # noqa: NPY002
        np.seterr(all="raise")
        warnings.simplefilter("error")
        signal.signal(signal.SIGINT, signal.SIG_IGN)
    assert Path.cwd() == folder
    after = np.random.get_state(legacy=False)["state"]["key"]  # noqa: NPY002
    assert (after == before).all()
    assert np.geterr()["divide"] != "raise"
    assert warnings.filters == filters
    assert signal.getsignal(signal.SIGINT) is handler


def test_an_error_of_a_hook_names_the_part_the_file_and_the_line(tmp_path: Path) -> None:
    file = tmp_path / "rule.py"
    file.write_text(FAILING_RULE)
    load_file(file)
    experiment = bl.load("evo/A").replace(learning={"rule": "third-party-rule"}, **SMALL)
    with pytest.raises(PartError, match="rule 'third-party-rule' of") as error:
        bl.simulate(experiment)
    assert str(error.value).endswith("fails: ValueError: boom (rule.py:9)")


def test_a_changed_comment_compiles_nothing_and_keeps_lines_of_errors_right(
    tmp_path: Path,
) -> None:
    file = tmp_path / "rule.py"
    names = []
    texts = [RULE, RULE.replace("    return", "    # Hebb\n\n        return"), RULE + "# End.\n"]
    for text in texts:
        file.write_text(text)
        module = load_file(file)
        assert module.__dict__["__source__"] == text
        names.append(module.__name__)
    assert len(set(names)) == 1
    file.write_text(FAILING_RULE)
    name = load_file(file).__name__
    file.write_text("# Comment.\n" + FAILING_RULE)
    assert load_file(file).__name__ != name
    file.write_text(FAILING_RULE + "# Comment.\n")
    assert load_file(file).__name__ == name


def test_code_runs_in_a_removed_working_directory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for is_removed_before in (True, False):
        folder = tmp_path / "removed"
        folder.mkdir()
        monkeypatch.chdir(folder)
        if is_removed_before:
            folder.rmdir()
        with (
            pytest.raises(PartError, match="mine: ValueError: boom"),
            run_third_party_code({}, "mine"),
        ):
            if not is_removed_before:
                folder.rmdir()
            raise ValueError("boom")
        monkeypatch.undo()
