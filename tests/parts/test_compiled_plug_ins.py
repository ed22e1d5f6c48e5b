"""Test that compiled code of a part is used again exactly if the results stay the same."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.engine.processes import ROOT, run_python

PLUG_IN = """
import numpy as np
import plug_in_settings
from baldwinlab.parts import Fitness, compiled

TABLE = np.array([0.0, {entry}])


@compiled
def shift(value, offset={offset}):
    return value + offset


class PlugIn(Fitness, name="plug-in"):
    @staticmethod
    def evaluate(part, lifetimes, fitness):
        for agent in range(fitness.size):
            fitness[agent] = shift(plug_in_settings.SPEED + TABLE[1])
"""
RULE = '''
from baldwinlab.parts import Fitness


class Rule(Fitness, name="rule"):
    """A rule."""

    @staticmethod
    def evaluate(part, lifetimes, fitness):
        """Fill the fitness."""
        for agent in range(fitness.size):
            # The unit is 1.
            fitness[agent] = 1
'''
# Numba announces each compilation. The first argument is the code that loads the part.
SIMULATE = """
import sys
import numba.core.event
import baldwinlab as bl

exec(sys.argv[1])
experiment = bl.load("evo/A").replace(
    population={"size": 2},
    lifetime={"steps": 5},
    evolution={"generations": 1, "fitness": sys.argv[2]},
)
with numba.core.event.install_recorder("numba:compile") as recorder:
    run = bl.simulate(experiment)
print(len(recorder.buffer), float(run.energy[0, 0]))
"""


def simulate(folder: Path, load: str, name: str) -> tuple[int, float]:
    """Return the number of compilation events in a new process, and the fitness of an agent."""
    environment = {
        "PYTHONPATH": f"{ROOT}:{folder}",
        "PYTHONDONTWRITEBYTECODE": "1",
        # The handler of crashes, which each process compiles, is not installed.
        "PYTHONFAULTHANDLER": "1",
    }
    done = run_python(SIMULATE, load, name, environment=environment)
    n_events, fitness = done.stdout.split()
    return int(n_events), float(fitness)


def test_a_changed_constant_array_or_default_of_a_plug_in_changes_the_results(
    tmp_path: Path,
) -> None:
    changes = [{}, {"speed": 2.0}, {"entry": 10.0}, {"offset": 100.0}, {}]
    for change in changes:
        values = {"speed": 1.0, "entry": 0.0, "offset": 0.0, **change}
        (tmp_path / "plug_in_settings.py").write_text(f"SPEED = {values['speed']}\n")
        text = PLUG_IN.format(entry=values["entry"], offset=values["offset"])
        (tmp_path / "plug_in.py").write_text(text)
        _, fitness = simulate(tmp_path, "import plug_in", "plug-in")
        assert fitness == sum(values.values())


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("            # The unit is 1.\n", ""),
        ("class Rule", "# A comment.\n\n\nclass Rule"),
        ('"""Fill the fitness."""', '"""Set the fitness\n\n        of all agents.\n        """'),
    ],
    ids=["comment", "blank line", "docstring"],
)
def test_a_change_without_code_compiles_nothing(tmp_path: Path, old: str, new: str) -> None:
    file = tmp_path / "rule.py"
    load = f"from baldwinlab.parts import load_file; load_file({str(file)!r})"
    # The folder of the test makes the code of the test unique, so that it is not yet compiled.
    unit = f"TEXT = {str(tmp_path)!r}\n" + RULE.replace("= 1", "= 1 + 0 * len(TEXT)")
    file.write_text(unit)
    n_events, fitness = simulate(tmp_path, load, "rule")
    assert n_events > 0
    assert old in unit
    file.write_text(unit.replace(old, new))
    assert simulate(tmp_path, load, "rule") == (0, fitness)
    file.write_text(unit.replace("= 1 +", "= 2 +"))
    n_events, fitness = simulate(tmp_path, load, "rule")
    assert n_events > 0
    assert fitness == 2
