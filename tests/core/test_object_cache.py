"""The cache of results of a function of an immutable object."""

import gc

from baldwinlab.core.object_cache import cache_per_object
from baldwinlab.experiment import Experiment


def test_a_result_is_computed_once_for_each_object_and_argument() -> None:
    calls = []

    @cache_per_object
    def describe(experiment: Experiment, unit: str) -> list[str]:
        calls.append((experiment.name, unit))
        return [f"{experiment.name} in {unit}"]

    first, second = Experiment(name="first"), Experiment(name="second")
    assert describe(first, "steps") is describe(first, "steps")
    assert describe(second, "steps") == ["second in steps"]
    assert describe(first, "runs") == ["first in runs"]
    assert calls == [("first", "steps"), ("second", "steps"), ("first", "runs")]


def test_a_result_is_removed_with_its_object() -> None:
    calls = 0

    @cache_per_object
    def count(experiment: Experiment) -> int:
        nonlocal calls
        calls += 1
        return calls

    # A new object can get the identity of a removed object.
    for expected in range(1, 6):
        experiment = Experiment(name=f"experiment-{expected}")
        assert count(experiment) == expected
        del experiment
        gc.collect()
