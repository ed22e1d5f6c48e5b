"""Test that the parts of the library pass the checks of parts, alone and in combination."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import pytest

from baldwinlab.api.checks import REQUIREMENTS
from baldwinlab.experiment import registry
from baldwinlab.experiment.registry import LIBRARY
from tests.oracles.parts import check_built_in_parts

# The compilation of each part takes a minute.
pytestmark = pytest.mark.nightly

# Names by kind of part.
Names = Mapping[str, Sequence[str]]
QUICK = ("fields", "limits", "arithmetic", "oracle")
ALL_BUT_SPEED = tuple(name for name in REQUIREMENTS if name != "speed")
SELECTIONS = ("best-copies", "expected-offspring", "outcrossing")
VARIATIONS = ("copy", "gaussian", "gene-pool", "one-point-crossover")
# Parts that are checked in one experiment, with all requirements.
COMBINATIONS: list[Names] = [
    *({"model": [name]} for name in LIBRARY["model"] if not name.startswith("neat-")),
    {"model": ["neat-xor"], "variation": ["neat"], "selection": ["species"]},
    {"variation": ["infinitesimal"]},
    {"network": ["neat"]},
    {
        "world feature": ["walls", "patches", "drifting-food", "slow-regrowth"],
        "sense": ["patch", "last-action", "touch", "compass"],
    },
    {"world feature": ["regions-in-turn"]},
    {"world feature": ["births-and-deaths"]},
    {
        "sense": ["nearest", "smell", "energy", "rays", "food-rays", "neighbours"],
        "body": ["stay"],
    },
    {"sense": ["nearest"], "body": ["grid"]},
    {"body": ["continuous"]},
]
WITHOUT_SPEED: list[Names] = [
    {"network": ["simple-recurrent", "continuous-time"]},
    *({kind: [name]} for kind in ("learning rule", "inheritance") for name in LIBRARY[kind]),
]
QUICKLY_CHECKED: list[Names] = [
    {"selection": SELECTIONS, "variation": VARIATIONS},
    *({"selection": [name]} for name in ("larger-tournament", "mutant-fixation")),
    *(
        {"variation": [name]}
        for name in (
            *("bit-flips", "few-mutations", "four-bit-weights", "lattice-steps"),
            *("one-point-alleles", "one-point-bits"),
        )
    ),
    {"model": ["cue-learners"], "variation": ["one-point-of-units"]},
]
COMPILED = (
    *("compiles", "repeated", "block", "batch", "resumed", "replayed", "python", "simulator"),
)


def label(value: Names | Sequence[str]) -> str:
    """Return the names of the parts or the number of requirements, for the name of a test."""
    if isinstance(value, Mapping):
        return " ".join(name for names in value.values() for name in names)
    return str(len(value))


@pytest.mark.parametrize(
    ("names", "requirements"),
    [
        *((names, REQUIREMENTS) for names in COMBINATIONS),
        *((names, ALL_BUT_SPEED) for names in WITHOUT_SPEED),
        *((names, QUICK) for names in QUICKLY_CHECKED),
        (QUICKLY_CHECKED[0], COMPILED),
        ({"sense": ["food-rays"]}, ("fields", "limits", "bounds", "oracle")),
    ],
    ids=label,
)
def test_parts_pass_their_checks(names: Names, requirements: Sequence[str]) -> None:
    parts = [registry.find_class(kind, name) for kind in names for name in names[kind]]
    findings = check_built_in_parts(parts, requirements=requirements)
    assert [str(finding) for finding in findings if finding.holds is False] == []
