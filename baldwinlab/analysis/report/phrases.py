"""Numbers and findings in words."""

from __future__ import annotations

import math

from baldwinlab.analysis.claims import ClaimResult, Finding
from baldwinlab.analysis.statistics import Comparison

MEASURES = {
    "best": "best agent",
    "mean": "average agent",
    "share": "share of agents that ate",
    "most": "most that any agent ate",
}


OVER_RUNS = {
    "mean_within": ", mean over runs",
    "mean_at_most": ", mean over runs",
    "every_at_most": ", largest of all runs",
    "every_at_least": ", least of all runs",
}


def measures(food: bool) -> dict[str, str]:
    """What each measure is called: where there is no food, nobody eats."""
    if food:
        return MEASURES
    return MEASURES | {
        "share": "share of agents with fitness above 0",
        "most": "highest fitness of any agent",
    }


def number(value: float) -> str:
    """Three digits or so; a dash where there is no number."""
    if not math.isfinite(value):
        return "–"
    if value == 0:
        return "0"
    digits = 0 if abs(value) >= 100 else 1 if abs(value) >= 10 else 2
    text = f"{value:,.{digits}f}"
    return text.replace("-", "−") if float(text.replace(",", "")) else text.removeprefix("-")


def signed(value: float) -> str:
    return f"+{number(value)}" if value > 0 else number(value)


def probability(p: float) -> str:
    if math.isnan(p):
        return "–"
    return f"{p:.1e}" if p < 0.001 else f"{p:.3f}" if p < 0.1 else f"{p:.2f}"


def interval(finding: Finding) -> str:
    return span(finding.numbers)


def span(numbers: Comparison) -> str:
    """The 95 % interval of the effect; empty where there is none."""
    return "" if math.isnan(numbers.low) else f"[{number(numbers.low)}, {number(numbers.high)}]"


def effect(finding: Finding) -> str:
    """The difference with its sign, or the level where there is but one sample."""
    value = finding.numbers.effect
    return signed(value) if finding.comparison.b else number(value)


def measure(finding: Finding) -> str:
    return finding.meaning or MEASURES[finding.comparison.measure]


def compared(finding: Finding) -> str:
    """What was held against what, with the medians."""
    comparison, numbers = finding.comparison, finding.numbers
    if comparison.b:
        how = (
            "; runs in pairs"
            if comparison.paired
            else "; medians"
            if comparison.rule == "survives_longer"
            else ""
        )
        return f"{comparison.a} {number(numbers.median_a)}, {comparison.other} {number(numbers.median_b)} ({measure(finding)}{how})"
    return f"{comparison.a}, {measure(finding)}{OVER_RUNS.get(comparison.rule, '')}; the bound is {comparison.other}"


def sentence(finding: Finding) -> str:
    """A finding for a reader in a hurry."""
    comparison, numbers = finding.comparison, finding.numbers
    if comparison.measure == "most":
        return f"the most that any agent of {comparison.a} ever ate is {number(numbers.effect)}"
    if not comparison.b and comparison.measure != "share":
        return f"{comparison.a}: {measure(finding)}{OVER_RUNS.get(comparison.rule, ', median over runs')}: {number(numbers.effect)}"
    if not comparison.b:
        return (
            f"at last, {number(numbers.effect)} of the agents of {comparison.a} eat in their life"
        )
    if comparison.rule == "survives_longer":
        return f"{measure(finding)}, restricted mean: {signed(numbers.effect)} in {comparison.a} against {comparison.other}"
    medians = f"{number(numbers.median_a)} in {comparison.a}, {number(numbers.median_b)} in {comparison.other}"
    return f"{measure(finding)}, median over runs: {medians}"


def from_paper(result: ClaimResult) -> str:
    """How far the measured effect lies from the paper's figure; empty where the paper gives none, or nothing was measured."""
    if result.from_paper is None or result.deciding is None:
        return ""
    if result.from_paper == 0:
        return "measured: the same"
    side = "above" if result.from_paper > 0 else "below"
    place = f"measured: {number(abs(result.from_paper))} {side}"
    if math.isnan(result.deciding.numbers.low):
        return place
    return f"{place}, {'inside' if agrees(result) else 'outside'} the interval"


def agrees(result: ClaimResult) -> bool:
    """Whether the paper's figure, where it gives one, lies in the measured interval, or is met where there is no interval."""
    if result.from_paper is None or result.deciding is None or result.claim.figure is None:
        return True
    low, high = result.deciding.numbers.low, result.deciding.numbers.high
    return result.from_paper == 0 if math.isnan(low) else low <= result.claim.figure <= high
