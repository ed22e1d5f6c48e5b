"""Printed commands work as printed, in the folder where the user stands.

The folder of the study has a space in its name.
"""

from __future__ import annotations

import html
import re
import shlex
from collections.abc import Callable
from pathlib import Path

import pytest

from baldwinlab.studies.assays.results import open_assay
from baldwinlab.studies.records import StudyError
from tests.commands import Command

FOLDER = "my studies"
STUDY = f"{FOLDER}/first study"
RUN = (
    *("run", "evo/A", "evo+self-taught/A", "--runs", "2", "--out", STUDY),
    *("--set", "evolution.generations=3", "lifetime.steps=300"),
)
CLAIM = """
[[claims]]
id = "1"
title = "Unseen maps"
claim = "Learners find more food on new maps."
rule = "greater"
comparisons = [{ a = "evo+self-taught/A", b = "evo/A", measure = "unseen-maps" }]
"""
RULE = """
from baldwinlab.parts import LearningRule

class Copying(LearningRule, name="copying"):
    share: float = 0.1
"""


def find_commands(text: str) -> list[str]:
    """Return the commands of a text: in backticks, after a colon, or alone in a line."""
    return re.findall(r"(?:^|`|: |\()(baldwinlab [a-z].*?)(?=`|\)|\.?$)", text, re.MULTILINE)


def list_after_a_run(_: Command, output: str) -> list[str]:
    """The command that writes the report, and the one that adds runs."""
    return find_commands(output)


def list_in_a_report(command: Command, _: str) -> list[str]:
    """The commands that write movies and measure assays, in the directory of the study."""
    assert command("report", STUDY).code == 0
    page = Path(STUDY, "report.html").read_text("utf-8")
    boxes = re.findall(r"<pre[^>]*>(.*?)</pre>", page, re.DOTALL)
    lines = "\n".join(map(html.unescape, boxes)).splitlines()
    # One command of each kind. The lab would not end.
    commands = [line for line in reversed(lines) if line.startswith("baldwinlab ")]
    by_name = {line.split()[1]: line for line in commands}
    assert by_name.pop("lab") == "baldwinlab lab ."
    return list(by_name.values())


def list_in_a_claim(command: Command, _: str) -> list[str]:
    """The command that measures what a claim needs, in the directory of the study."""
    Path("claims.toml").write_text(CLAIM, "utf-8")
    done = command("report", STUDY, "--claims", "claims.toml")
    # A terminal breaks long lines.
    return find_commands(" ".join((done.out + done.err).split()))


def list_of_a_missing_assay(_command: Command, _: str) -> list[str]:
    with pytest.raises(StudyError) as refusal:
        open_assay(STUDY, "innate", "evo+self-taught/A")
    return find_commands(str(refusal.value))


@pytest.mark.parametrize(
    ("folder", "list_commands", "names"),
    [
        (".", list_after_a_run, ["run", "report"]),
        # A movie takes a minute.
        pytest.param(STUDY, list_in_a_report, ["replay"], marks=pytest.mark.nightly),
        (STUDY, list_in_a_claim, ["assay"]),
        (".", list_of_a_missing_assay, ["assay"]),
    ],
)
def test_a_printed_command_works_as_printed(
    command: Command,
    monkeypatch: pytest.MonkeyPatch,
    folder: str,
    list_commands: Callable[[Command, str], list[str]],
    names: list[str],
) -> None:
    done = command(*RUN)
    commands = list_commands(command, done.out + done.err)
    monkeypatch.chdir(folder)
    for line in commands:
        repeated = command(*shlex.split(line)[1:])
        assert repeated.code == 0, (line, repeated.err)
    assert {line.split()[1] for line in commands} == set(names), commands


def test_a_failed_check_prints_the_command_that_repeats_it(command: Command) -> None:
    path = Path("my rule.py")
    path.write_text(RULE, "utf-8")
    failed = command("check", str(path), "--requirements", "fields")
    (line,) = {line for line in find_commands(failed.out + failed.err) if "check" in line}
    repeated = command(*shlex.split(line)[1:])
    assert (repeated.code, repeated.out) == (failed.code, failed.out)
