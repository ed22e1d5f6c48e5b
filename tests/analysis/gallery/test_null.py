"""Rates of false answers, and power, in tables of systems with and without an effect."""

from __future__ import annotations

from collections import Counter
from typing import NamedTuple

import numpy as np
import pytest
import xarray as xr

from baldwinlab.analysis.estimands import MEASURED, QUESTIONS, Estimate
from baldwinlab.analysis.gallery import decisions
from baldwinlab.analysis.gallery.decisions import SystemName, decide
from baldwinlab.analysis.results.verdicts import OPPOSITE, YES
from baldwinlab.analysis.statistics import bootstrap, comparisons
from baldwinlab.analysis.statistics.hypothesis_tests import sign_test
from tests.analysis.gallery.null_systems import BOUND, KINDS

# Numbers of runs of a system, as in the papers.
RUNS = (8, 12, 20, 40)
# In a table, 4 of 16 systems have no effect. The others have these effects, in standard deviations.
N_NULL = 4
SHIFTS = (0.8, 1.5, 3.0)
MAX_FALSE_SHARE = 0.06


def make_effects(generator: np.random.Generator, shift: float, n_runs: int) -> list[Estimate]:
    """Return a system with the same effect in every question."""
    return [
        Estimate(
            MEASURED,
            reason="",
            values=xr.DataArray(generator.normal(shift, 1, n_runs), dims="run"),
            equivalence_bound=BOUND,
            question=question,
        )
        for question in QUESTIONS
    ]


@pytest.fixture(autouse=True)
def _without_stability(monkeypatch: pytest.MonkeyPatch) -> None:
    """Omit the numbers that change no verdict, and take most of the time."""
    monkeypatch.setattr(comparisons, "STABILITY_RESAMPLES", 1)
    monkeypatch.setattr(bootstrap, "RESAMPLES", 1)
    monkeypatch.setattr(decisions, "_find_required_runs", lambda values, limits: None)
    monkeypatch.setattr(decisions, "measure_hurdle", lambda values, bound: None)


class Rates(NamedTuple):
    """Answers to the questions of many tables."""

    # Number of answers of systems without an effect, by question and answer.
    answers: Counter[tuple[str, str]]
    # Share of "yes" for an effect of 0.8 standard deviations, by number of runs.
    power: dict[int, float]

    @property
    def false_shares(self) -> dict[str, float]:
        """The share of "yes" and "opposite" of systems without an effect, by question."""
        shares = {}
        for question in QUESTIONS:
            counts = {name: n for (asked, name), n in self.answers.items() if asked == question}
            shares[question] = (counts.get(YES, 0) + counts.get(OPPOSITE, 0)) / sum(counts.values())
        return shares


def decide_tables(kind: str, tables: int) -> Rates:
    """Decide tables of systems, of which a quarter are of a kind without an effect."""
    generator = np.random.default_rng(list(KINDS).index(kind))
    runs = generator.choice(RUNS, tables * N_NULL)
    null_systems = iter(KINDS[kind](generator, runs.tolist()))
    answers: Counter[tuple[str, str]] = Counter()
    detections: dict[int, list[bool]] = {n_runs: [] for n_runs in RUNS}
    for _ in range(tables):
        table = {SystemName("null", str(number)): next(null_systems) for number in range(N_NULL)}
        for shift in SHIFTS:
            for n_runs in RUNS:
                system = SystemName(f"shift {shift}", str(n_runs))
                table[system] = make_effects(generator, shift, n_runs)
        for decision in decide(table):
            measurement = decision.measurement
            if decision.system.paper == "null":
                verdict = measurement.verdict if measurement else decision.estimate.measurability
                answers[decision.estimate.question, verdict] += 1
            elif decision.system.paper == f"shift {SHIFTS[0]}" and measurement:
                detections[measurement.runs].append(measurement.verdict == YES)
    return Rates(answers, {n_runs: float(np.mean(yes)) for n_runs, yes in detections.items()})


@pytest.mark.parametrize("kind", KINDS)
def test_few_tables_have_few_false_answers_and_detect_large_samples(kind: str) -> None:
    rates = decide_tables(kind, 3)
    n_false = sum(n for (_, name), n in rates.answers.items() if name in (YES, OPPOSITE))
    assert n_false <= MAX_FALSE_SHARE * rates.answers.total()
    assert rates.power[40] > rates.power[8]


def test_the_fall_of_the_learned_distance_in_neutral_evolution_is_no_assimilation() -> None:
    systems = KINDS["neutral evolution"](np.random.default_rng(1), [20] * 10)
    falls = [row.terms["learner"] for rows in systems for row in rows if row.terms]
    # The fall alone would be "yes" in every system.
    assert len(falls) == 10
    assert all(sign_test(fall.values[None])[0] < 0.05 for fall in falls)
    assert decide_tables("neutral evolution", 3).answers["assimilation", YES] == 0


@pytest.mark.nightly
@pytest.mark.parametrize("kind", KINDS)
def test_at_most_six_percent_of_answers_without_an_effect_are_yes_or_opposite(
    kind: str, capsys: pytest.CaptureFixture[str]
) -> None:
    rates = decide_tables(kind, 200)
    with capsys.disabled():
        shares = ", ".join(f"{name} {share:.1%}" for name, share in rates.false_shares.items())
        power = ", ".join(f"{share:.0%} of {n_runs} runs" for n_runs, share in rates.power.items())
        print(f"\n{kind}: false answers: {shares}; power at 0.8 SD: {power}")
    assert max(rates.false_shares.values()) <= MAX_FALSE_SHARE
