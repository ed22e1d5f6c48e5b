"""Test that compiled code is stored for the next start and is never stale."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

import baldwinlab
from baldwinlab.simulation.simulate import simulate
from tests.engine.processes import run_python
from tests.worlds import make_small_experiment

COUNT_AND_RUN = """
from baldwinlab.engine import cache, rng
words = rng.words(1, 2, 3, 4, (1, 1))
directory = cache.cache_directory((rng.words,))
print(directory.name, rng.unit(2**31), len(list(directory.parent.rglob("*.compiled"))))
"""


def start(package: Path, cache: Path) -> list[str]:
    environment = {"BALDWINLAB_CACHE": str(cache)}
    return run_python(COUNT_AND_RUN, environment=environment, folder=package).stdout.split()


def test_only_an_edit_of_code_that_a_function_can_contain_compiles_it_again(
    tmp_path: Path,
) -> None:
    package = tmp_path / "source"
    shutil.copytree(
        Path(baldwinlab.__file__).parent,
        package / "baldwinlab",
        ignore=shutil.ignore_patterns("__pycache__"),
    )
    cache = tmp_path / "cache"
    first = start(package, cache)
    second = start(package, cache)
    assert first[1] == "0.5"
    assert second[:3] == first[:3]
    assert int(first[2]) > 0
    rng = package / "baldwinlab" / "engine" / "rng.py"
    text = rng.read_text()
    rng.write_text("# A comment.\n\n" + text.replace('"""Return', '"""Compute and return'))
    unused = package / "baldwinlab" / "evolution" / "diversity_selection.py"
    unused.write_text(f"{unused.read_text()}\nUNUSED = 1\n")
    assert start(package, cache) == second
    rng.write_text(text.replace("2.0**-24", "2.0**-23"))
    third = start(package, cache)
    assert third[0] != first[0]
    assert third[1] == "1.0"


PATCHED = """
import sys
from baldwinlab.engine import jit
from tests.worlds import make_small_experiment
from baldwinlab.simulation.simulate import simulate
if sys.argv[1] == "patched":
    from baldwinlab.models.miniworld.learning import teachers
    def learn(part, model, state, step, lane):
        state.weights[0, 0] = state.weights[0, 0]
    teachers.SelfTaught.learn = staticmethod(learn)
print(simulate(make_small_experiment("evo+self-taught"), seed=1).energy.values.sum(axis=1).tolist())
"""


# The engine is compiled twice.
@pytest.mark.nightly
def test_a_patched_function_is_not_in_the_code_that_a_later_process_loads(tmp_path: Path) -> None:
    patched, later = (
        run_python(PATCHED, code, environment={"BALDWINLAB_CACHE": str(tmp_path)}).stdout
        for code in ("patched", "original")
    )
    energy = simulate(make_small_experiment("evo+self-taught"), seed=1).energy
    assert later == f"{energy.values.sum(axis=1).tolist()}\n"
    assert patched != later


SIMULATE = """
from tests.worlds import make_small_experiment
from baldwinlab.simulation.simulate import simulate
experiment = make_small_experiment("evo", lifetime={"steps": 40}, evolution={"generations": 2})
print(simulate(experiment, seed=1).food_eaten.values.tolist())
"""


def test_a_simulation_without_the_compiler_has_the_same_results() -> None:
    plain_python = {"NUMBA_DISABLE_JIT": "1", "PYTHONWARNINGS": "ignore::RuntimeWarning"}
    without_compiler = run_python(SIMULATE, environment=plain_python)
    assert without_compiler.stdout == run_python(SIMULATE).stdout
