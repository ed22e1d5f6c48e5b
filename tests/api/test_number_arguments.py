"""Every public function checks its counts, seeds and numbers, and writes nothing before."""

from __future__ import annotations

import inspect
import math
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import baldwinlab as bl
from baldwinlab import ArgumentError, Study
from baldwinlab.api.integrations.optimizers import Problem
from baldwinlab.core.numbers import COUNTS, INDICES
from tests.small_studies import shorten_preset

INVALID_COUNTS = [0, -1, 1.5, True, math.nan, "2", 2**40, np.float64(2), np.bool_(True), [1]]
INVALID_INDICES = [value for value in INVALID_COUNTS if not (type(value) is int and value == 0)]
# Annotations of the arguments do not name the types of NumPy.
NUMPY: Any = np
# The other arguments of each function, with files that do not exist: a number is checked first.
ARGUMENTS: dict[str, dict[str, Any]] = {
    "Experiment.at": {},
    "Problem.evaluate": {"genomes": [[0.0]]},
    "Problem.founders": {},
    "Study.assay": {"name": "fork"},
    "Study.compare": {},
    "Study.extend": {},
    "Study.genomes": {"run": 0, "generation": 0},
    "Study.network": {"run": 0, "generation": 0, "agent": 0},
    "Study.replay": {"run": 0, "generation": 0},
    "Study.report": {},
    "Study.to_arviz": {},
    "check_part": {"part": "missing.py"},
    "compete": {"a": "missing.nc", "b": "missing.nc"},
    "freeze": {"reference": "missing:evo/A@0", "out": "frozen.nc"},
    "make_problem": {"experiment": shorten_preset()},
    "replay": {"experiment": shorten_preset()},
    "reproduce": {},
    "run": {"experiments": "evo/A"},
    "simulate": {"experiment": shorten_preset()},
    "sweep": {"plan": "missing.toml"},
    "vector_env": {"experiment": shorten_preset()},
}


def list_public_functions() -> Iterator[tuple[str, Callable[..., Any]]]:
    """Yield the public functions, and the public methods of classes, by name."""
    for name in bl.__all__:
        if inspect.isfunction(value := getattr(bl, name)):
            yield name, value
    for owner in (Study, Problem, bl.Experiment):
        for name in dir(owner):
            method = inspect.getattr_static(owner, name)
            is_own = str(getattr(method, "__module__", "")).startswith("baldwinlab")
            if inspect.isfunction(method) and is_own and not name.startswith("_"):
                yield f"{owner.__name__}.{name}", method


def list_numbers(function: Callable[..., Any]) -> list[str]:
    """Return the names of the arguments that are whole numbers."""
    return [
        name
        for name, parameter in inspect.signature(function).parameters.items()
        if re.match(r"int\b", str(parameter.annotation))
    ]


NUMBERS = [
    (function_name, argument)
    for function_name, function in list_public_functions()
    for argument in list_numbers(function)
]


@pytest.fixture(scope="module")
def owners(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """Return an object of each public class with methods."""
    experiment = shorten_preset("evo/A")
    study = bl.run(experiment, runs=1, out=tmp_path_factory.mktemp("numbers") / "study")
    return {"Study": study, "Problem": bl.make_problem(experiment), "Experiment": experiment}


def test_each_public_argument_that_is_a_whole_number_has_a_range() -> None:
    assert {name for name, _ in NUMBERS} == ARGUMENTS.keys()
    assert {argument for _, argument in NUMBERS} == INDICES | COUNTS
    # A number with another annotation would be overlooked.
    for name, function in list_public_functions():
        named = (INDICES | COUNTS) & inspect.signature(function).parameters.keys()
        assert named == set(list_numbers(function)), name


@pytest.mark.parametrize(("function_name", "argument"), NUMBERS)
def test_an_invalid_number_is_refused_by_its_name_before_anything_is_written(
    function_name: str,
    argument: str,
    owners: dict[str, Any],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    owner, _, name = function_name.rpartition(".")
    function = getattr(owners[owner] if owner else bl, name)
    stored_before = sorted(owners["Study"].directory.rglob("*"))
    rule = rf"{argument} = .* must be a whole number from {int(argument in COUNTS)} to \d+"
    values = INVALID_COUNTS if argument in COUNTS else INVALID_INDICES
    for value in values:
        if not (argument == "agent" and value == [1]):
            with pytest.raises(ArgumentError, match=rule):
                function(**{**ARGUMENTS[function_name], argument: value})
    assert not list(tmp_path.iterdir())
    assert sorted(owners["Study"].directory.rglob("*")) == stored_before


def test_a_generation_of_a_schedule_is_checked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    generations: list[Any] = [-1, 1.5, True, math.nan, "2", 2**40]
    message = r"generation = .* must be a whole number from 0 to"
    for generation in generations:
        with pytest.raises(ArgumentError, match=message):
            bl.run("evo/A", schedule={generation: {"learning.rule": "none"}})
    assert not list(tmp_path.iterdir())


def test_an_agent_is_one_of_the_population(owners: dict[str, Any]) -> None:
    for value in (-1, 1.5, 99, 2**31 - 1, [0, 99], ["0"], [True]):
        with pytest.raises(ArgumentError, match=r"agent = .* must be a whole number from 0 to"):
            owners["Study"].genomes(0, 0, value)


def test_integers_of_numpy_are_numbers(owners: dict[str, Any], tmp_path: Path) -> None:
    experiment, study, problem = owners["Experiment"], owners["Study"], owners["Problem"]
    repeated = bl.run(experiment, runs=NUMPY.int64(1), seed=NUMPY.uint8(0), out=tmp_path / "study")
    assert repeated.data().equals(study.data())
    assert repeated.seed == 0
    simulated = bl.simulate(experiment, seed=NUMPY.int32(3), run=NUMPY.array(1))
    assert simulated.identical(bl.simulate(experiment, seed=3, run=1))
    genomes = study.genomes(NUMPY.int64(0), NUMPY.int16(1), NUMPY.array([0, 2]))
    assert genomes.identical(study.genomes(0, 1, [0, 2]))
    trace = study.replay(run=NUMPY.int64(0), generation=NUMPY.int64(1), world=NUMPY.int8(0))
    assert trace.identical(study.replay(run=0, generation=1))
    founders = problem.founders(NUMPY.int64(20))
    fitness = problem.evaluate(founders, generation=NUMPY.int32(2)).fitness
    assert np.array_equal(fitness, problem.evaluate(founders, generation=2).fitness)
    assert experiment.at(NUMPY.int64(2)) == experiment


def test_scalars_and_arrays_of_numpy_are_settings(tmp_path: Path) -> None:
    changed = shorten_preset().replace(
        lifetime={"steps": NUMPY.int32(50)}, motor={"noise": NUMPY.float32(0.5)}
    )
    assert (changed.lifetime.steps, changed.motor.noise) == (50, 0.5)
    table = bl.Experiment(lifetime={"steps": NUMPY.int64(50)}, motor={"noise": NUMPY.float16(0.5)})
    assert (table.lifetime.steps, table.motor.noise) == (50, 0.5)
    study = bl.run(
        "hinton-nowlan-1987:guessing-100",
        runs=NUMPY.int64(1),
        set={"evolution.generations": NUMPY.int16(2), "population.size": NUMPY.uint16(20)},
        out=tmp_path / "run",
    )
    assert study.experiment("guessing-100").population.size == 20
    plan = {
        "experiment": "hinton-nowlan-1987:guessing-100",
        "runs": NUMPY.int64(1),
        "set": {"evolution.generations": NUMPY.int64(1)},
        "fields": {"population.size": NUMPY.array([10, 20])},
    }
    swept = bl.sweep(plan, out=tmp_path / "sweep")
    sizes = [swept.experiment(name).population.size for name in swept.conditions]
    assert sizes == [10, 20]
