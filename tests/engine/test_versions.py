"""Test that an untested version of Numba is refused with one sentence."""

from __future__ import annotations

import re
import tomllib
from importlib.metadata import version
from pathlib import Path

import pytest

from baldwinlab._version import __version__
from baldwinlab.core.errors import RefusedError
from baldwinlab.engine import TESTED, require_tested_version
from tests.engine.processes import ROOT, run_python

PROJECT = ROOT / "pyproject.toml"


@pytest.mark.parametrize("installed", ["0.62.0", "0.62.1", "0.65.0rc1", "0.68.1", "0.68.1+local.3"])
def test_a_tested_version_is_accepted(installed: str) -> None:
    require_tested_version("numba", installed)


@pytest.mark.parametrize(
    "installed",
    ["0.61.2", "0.69.0", "0.69.0dev0", "0.70", "1.0.0", "1", "0+unknown", "unknown"],
)
def test_an_untested_version_is_refused_with_the_command_that_installs_a_tested_one(
    installed: str,
) -> None:
    with pytest.raises(RefusedError) as refusal:
        require_tested_version("numba", installed)
    assert str(refusal.value) == (
        f"numba {installed} has not been tested with baldwinlab {__version__}, which works with "
        "numba 0.62 to 0.68: pip install 'numba>=0.62,<0.69'"
    )


@pytest.mark.parametrize("package", TESTED)
def test_the_project_declares_the_tested_versions(package: str) -> None:
    project = tomllib.loads(PROJECT.read_text("utf-8"))["project"]
    declared = [*project["dependencies"], *project["optional-dependencies"]["cuda"]]
    pattern = re.compile(rf"{package}(\[[^\]]*\])?(?P<versions>[<>=].*)")
    matches = [pattern.fullmatch(line.replace(" ", "")) for line in declared]
    # The extra can narrow the bounds of a dependency.
    assert [match["versions"] for match in matches if match][-1] == TESTED[package].requirement


START_WITH_VERSION = """
import sys, {package}
{package}.__version__ = "9.0.1"
sys.argv = ["baldwinlab", *sys.argv[1:]]
from baldwinlab.__main__ import main
main()
"""


COMMANDS = [["run", "evo/A"], ["reproduce"], ["lab"]]


@pytest.mark.parametrize(
    ("package", "words"),
    [*(("numba", words) for words in COMMANDS), ("llvmlite", ["run", "evo/A"])],
)
def test_a_command_prints_one_sentence(package: str, words: list[str], tmp_path: Path) -> None:
    code = START_WITH_VERSION.format(package=package)
    environment = {"PYTHONPATH": str(ROOT)}
    done = run_python(code, *words, environment=environment, folder=tmp_path, check=False)
    assert done.returncode == 2
    assert done.stdout == ""
    sentence = " ".join(done.stderr.split())
    reason = f"{package} 9.0.1 has not been tested with baldwinlab {__version__}"
    assert sentence.startswith(f"baldwinlab: {reason}")
    assert sentence.endswith(f"pip install '{package}{TESTED[package].requirement}'")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("package", ["numba", "llvmlite"])
def test_the_installed_version_is_a_tested_one(package: str) -> None:
    require_tested_version(package, version(package))
