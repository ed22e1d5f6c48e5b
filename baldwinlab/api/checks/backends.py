"""Compare compiled code with plain Python and with the simulator of a GPU."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

from baldwinlab.api.checks.cases import Case, make_cases
from baldwinlab.api.checks.findings import FailsError, NotCheckedError
from baldwinlab.api.checks.fixture import PartGroup, is_of_miniworld
from baldwinlab.api.checks.hashes import Bits, hash_runs
from baldwinlab.api.checks.processes import PLAIN_ENVIRONMENT, SIMULATOR_ENVIRONMENT, Process

SIMULATED_POPULATIONS: Final = (2, 17)
"""Numbers of agents for the slow simulator of a GPU: one case for each update."""


def check_plain_python(group: PartGroup) -> str:
    """Compare compiled code and plain Python."""
    cases = [case for case in make_cases(group) if case.is_same_code]
    plain = group.plain_bits or _simulate_in_process(group, cases, "cpu", PLAIN_ENVIRONMENT)
    for case in cases:
        if case.description not in plain:
            continue
        if hash_runs(case.experiment, group.seed, [0]) != plain[case.description]:
            raise FailsError(
                f"compiled code gives other bits than plain Python (with {case.description})"
            )
    return ""


def check_simulator(group: PartGroup) -> str:
    """Compare the CPU and the simulator of a GPU."""
    if not is_of_miniworld(group.experiment):
        raise NotCheckedError("the model runs only on the CPU")
    cases = [
        case
        for case in make_cases(group)
        if case.is_same_code and not case.has_items and case.agents in SIMULATED_POPULATIONS
    ]
    simulated_bits = _simulate_in_process(group, cases, "cuda", SIMULATOR_ENVIRONMENT)
    for case in cases:
        if hash_runs(case.experiment, group.seed, [0]) != simulated_bits[case.description]:
            raise FailsError(
                "compiled code gives other bits than the simulator of a GPU "
                f"(with {case.description})"
            )
    return ""


def _simulate_in_process(
    group: PartGroup, cases: Sequence[Case], backend: str, environment: Mapping[str, str]
) -> dict[str, Bits]:
    """Return the hashes of run 0 by case, from another process.

    Raise NotCheckedError if the backend is not available.
    """
    experiments = [case.experiment.to_dict() for case in cases]
    request = {"experiments": experiments, "seed": group.seed, "backend": backend}
    answers = list(Process("simulate", group.parts, environment, **request).answers())
    if isinstance(answers[0], dict):
        raise NotCheckedError(answers[0]["problem"])
    return dict(zip((case.description for case in cases), answers, strict=True))
