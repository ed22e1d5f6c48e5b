"""Tests that every phase can be measured."""

from __future__ import annotations

import pytest

from baldwinlab.models.miniworld.backends.choice import CPU
from baldwinlab.papers.presets import load
from benchmarks import phases


@pytest.mark.parametrize(
    "phase",
    [
        pytest.param(phase, id=phase.name, marks=[pytest.mark.nightly] * (phase.name != "eat"))
        for phase in phases.PHASES
    ],
)
def test_a_phase_can_be_measured(phase: phases.Phase, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(phases, "ROUNDS", 1)
    monkeypatch.setattr(phases, "REPETITIONS", 1)
    assert (
        phases.nanoseconds(phase, phases.make_batch(load("evo+self-taught/A")), CPU.worlds * 20) > 0
    )
