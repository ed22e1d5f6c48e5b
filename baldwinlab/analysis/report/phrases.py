"""Texts for numbers and findings in reports."""

from __future__ import annotations

import math

from baldwinlab.analysis.claim_results import ClaimResult, Finding
from baldwinlab.analysis.results.numbers import format_number, format_signed
from baldwinlab.experiment.outcome import FOOD_OUTCOMES, name_share

MEASURE_NAMES = {
    "best": "best agent",
    "mean": "average agent",
    "share": "share of agents that eat",
    "most": "highest number of items that an agent ate",
    "unseen-maps": "average agent on unseen maps",
}


def name_measures(outcome: str) -> dict[str, str]:
    """Return the name of each measure."""
    names = MEASURE_NAMES | {"share": name_share(outcome)}
    if outcome in FOOD_OUTCOMES:
        return names
    return names | {"most": "highest fitness of any agent"}


def name_measure(finding: Finding) -> str:
    """Return the name of the measure of a finding."""
    return finding.meaning or MEASURE_NAMES[finding.comparison.measure]


def describe_comparison(finding: Finding) -> str:
    """Return both conditions of a comparison with their medians."""
    comparison = finding.comparison
    measure = name_measure(finding)
    if not comparison.b:
        is_number = finding.rule.kind == "number" and comparison.measure != "most"
        aggregate = f", {finding.rule.statistic} over runs" if is_number else ""
        return f"{comparison.a}, {measure}{aggregate}; the bound is {comparison.reference}"
    median_a = format_number(finding.numbers.median_a)
    median_b = format_number(finding.numbers.median_b)
    method = _describe_method(finding)
    return f"{comparison.a} {median_a}, {comparison.reference} {median_b} ({measure}{method})"


def _describe_method(finding: Finding) -> str:
    if finding.comparison.paired:
        return "; paired runs"
    return "; medians" if finding.comparison.rule == "survives_longer" else ""


def describe_finding(finding: Finding) -> str:
    """Return a finding as a short phrase."""
    comparison = finding.comparison
    measure = name_measure(finding)
    effect = format_number(finding.numbers.effect)
    if comparison.measure == "most":
        return f"{comparison.a}: {measure}: {effect}"
    if not comparison.b and comparison.measure != "share":
        return f"{comparison.a}: {measure}, {finding.rule.statistic} over runs: {effect}"
    if not comparison.b:
        return f"{comparison.a}: share of agents that eat in the last generations: {effect}"
    if comparison.rule == "survives_longer":
        signed = format_signed(finding.numbers.effect)
        return (
            f"{measure}, restricted mean: {signed} in {comparison.a} compared with "
            f"{comparison.reference}"
        )
    median_a = format_number(finding.numbers.median_a)
    median_b = format_number(finding.numbers.median_b)
    return (
        f"{measure}, median over runs: {median_a} in {comparison.a}, "
        f"{median_b} in {comparison.reference}"
    )


def describe_distance(result: ClaimResult) -> str:
    """Return the difference between the measured effect and the value of the paper.

    Returns the difference, or "" if the paper has no value or the claim was not evaluated.
    """
    if result.difference_from_paper is None or result.deciding is None:
        return ""
    if result.difference_from_paper == 0:
        return "measured: the same"
    side = "above" if result.difference_from_paper > 0 else "below"
    distance = f"measured: {format_number(abs(result.difference_from_paper))} {side}"
    if math.isnan(result.deciding.numbers.low):
        return distance
    position = "inside" if agrees_with_paper(result) else "outside"
    return f"{distance}; the value of the paper is {position} the interval"


def agrees_with_paper(result: ClaimResult) -> bool:
    """Return whether the value of the paper, if it has one, is inside the measured interval.

    Returns True if the paper has no value. Without an interval, the two values must be equal.
    """
    if (
        result.difference_from_paper is None
        or result.deciding is None
        or result.claim.paper_value is None
    ):
        return True
    low = result.deciding.numbers.low
    high = result.deciding.numbers.high
    if math.isnan(low):
        return result.difference_from_paper == 0
    return low <= result.claim.paper_value <= high
