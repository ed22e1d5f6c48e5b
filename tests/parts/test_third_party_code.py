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
from baldwinlab.experiment import registry
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


def run_command(
    folder: Path, *arguments: str, **environment: str
) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "baldwinlab", *arguments],
        cwd=folder,
        env=os.environ | environment,
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
    noise = "import os, sys; os.chdir('/'); print('text'); os.write(1, b'bytes\\n')\n"
    noise += "sys.stdout.close()\n"
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


@pytest.mark.parametrize("name", ["'\\x1b[2J'", "5", "'a/b'", "'rule\\n'"])
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
    message = "Rule of first.py and Rule of second.py both define the learning rule 'third-party-"
    assert message in outcome.err
    assert command("show", "evo/A", "--part", "first.py", "--part", "copy.py").code == 0


def test_a_file_with_two_parts_of_one_name_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "rule.py"
    file.write_text(RULE)
    original = load_file(file).Rule
    file.write_text(RULE + RULE.replace("class Rule", "class Copy"))
    with pytest.raises(PartError, match=r"Rule of .*rule\.py and Copy of .*rule\.py both define"):
        load_file(file)
    assert registry.find_class("learning rule", "third-party-rule") is original


def test_two_installed_plug_ins_with_parts_of_one_name_are_refused(tmp_path: Path) -> None:
    for name in ("first_plug_in", "second_plug_in"):
        (tmp_path / f"{name}.py").write_text(RULE)
        facts = tmp_path / f"{name}-1.dist-info"
        facts.mkdir()
        (facts / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1\n")
        (facts / "entry_points.txt").write_text(f"[baldwinlab.parts]\n{name} = {name}\n")
    paths = os.pathsep.join([str(tmp_path), *filter(None, sys.path)])
    outcome = run_command(tmp_path, "show", "evo/A", PYTHONPATH=paths)
    assert outcome.returncode == 2
    assert len(outcome.stderr.splitlines()) == 1
    for name in ("first_plug_in", "second_plug_in"):
        assert f"Rule of {name}.py" in outcome.stderr
    assert "both define the learning rule 'third-party-rule'" in outcome.stderr


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
    limit = sys.getrecursionlimit()
    with run_third_party_code("the part"):
        os.chdir("/")
        np.random.seed(7)  # noqa: NPY002
        np.seterr(all="raise")
        warnings.simplefilter("error")
        sys.setrecursionlimit(500)
        signal.signal(signal.SIGINT, signal.SIG_IGN)
    assert Path.cwd() == folder
    after = np.random.get_state(legacy=False)["state"]["key"]  # noqa: NPY002
    assert (after == before).all()
    assert np.geterr()["divide"] != "raise"
    assert sys.getrecursionlimit() == limit
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
            run_third_party_code("mine"),
        ):
            if not is_removed_before:
                folder.rmdir()
            raise ValueError("boom")
        monkeypatch.undo()


# The errors of code that is not compiled: a check of settings, and a derived value.
PYTHON_CODE = """
import sys
from baldwinlab.parts import Fitness


class ThirdPartyFitness(Fitness, name="third-party-fitness"):
    {code}

    @staticmethod
    def evaluate(part, lifetimes, fitness):
        for agent in range(fitness.size):
            fitness[agent] = lifetimes.energy[agent]
"""
SETTINGS = [
    *("population.size=2", "lifetime.steps=20", "evolution.generations=1"),
    "evolution.fitness=third-party-fitness",
]


@pytest.mark.parametrize(
    "code",
    [
        "def check(self, experiment): sys.exit(0)",
        "derived = {'value': lambda part, experiment: sys.exit(0)}",
        "derived = {'value': lambda part, experiment: {}['key']}",
    ],
)
def test_a_run_names_the_part_whose_python_code_fails(tmp_path: Path, code: str) -> None:
    (tmp_path / "part.py").write_text(PYTHON_CODE.format(code=code))
    options = ["--runs", "1", "--part", "part.py", "--out", "study", "--set", *SETTINGS]
    outcome = run_command(tmp_path, "run", "evo/A", *options)
    assert outcome.returncode == 2
    message = outcome.stderr.splitlines()[-1]
    assert message.startswith("baldwinlab: the fitness 'third-party-fitness' of part.py fails: ")
    assert message.endswith("(part.py:7)")
    assert "Traceback" not in outcome.stderr


def test_a_run_whose_part_exits_with_a_text_prints_one_sentence(tmp_path: Path) -> None:
    (tmp_path / "rule.py").write_text("import sys; sys.exit('text')" + RULE)
    outcome = run_command(tmp_path, "run", "evo/A", "--part", "rule.py", "--out", "study")
    assert outcome.returncode == 2
    assert outcome.stderr == "baldwinlab: rule.py cannot be loaded: SystemExit: text (rule.py:1)\n"


@pytest.mark.parametrize(
    ("file", "text", "reason"),
    [
        (
            "rule.py",
            f"print('text')\nraise KeyboardInterrupt{RULE}",
            "KeyboardInterrupt (rule.py:2)",
        ),
        (
            "part.py",
            PYTHON_CODE.format(code="print('text')").replace(
                "fitness[agent] = lifetimes.energy[agent]", "raise GeneratorExit"
            ),
            "evaluate, line 12: GeneratorExit",
        ),
        (
            "part.py",
            PYTHON_CODE.format(code="print('text')").replace(
                "lifetimes.energy[agent]", "7 // agent"
            ),
            "evaluate, line 12: ZeroDivisionError: integer",
        ),
        (
            "part.py",
            PYTHON_CODE.format(code="print('text')").replace(
                "lifetimes.energy[agent]", "lifetimes.species[agent] // lifetimes.species[agent]"
            ),
            "evaluate, line 12: RuntimeWarning: divide by zero",
        ),
    ],
)
def test_a_check_with_json_reports_any_error_of_a_part(
    tmp_path: Path, file: str, text: str, reason: str
) -> None:
    (tmp_path / file).write_text(text)
    outcome = run_command(tmp_path, "check", file, "--json")
    assert outcome.returncode == 1
    findings = json.loads(outcome.stdout)
    (failure,) = (finding for finding in findings if finding["holds"] is False)
    assert reason in failure["message"]
    assert "text" in outcome.stderr


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such signals")
def test_a_run_names_the_part_whose_compiled_code_ends_the_process(tmp_path: Path) -> None:
    code = PYTHON_CODE.format(code="").replace("fitness.size", "10**12")
    (tmp_path / "part.py").write_text(code)
    options = ["--runs", "1", "--part", "part.py", "--out", "study", "--set", *SETTINGS]
    outcome = run_command(tmp_path, "run", "evo/A", *options)
    assert outcome.returncode == -signal.SIGSEGV
    assert outcome.stderr.splitlines()[-1] == (
        "baldwinlab: compiled code accessed memory outside its arrays, in the fitness "
        "'third-party-fitness' of part.py; baldwinlab check FILE finds the line"
    )
    assert "Traceback" not in outcome.stderr
