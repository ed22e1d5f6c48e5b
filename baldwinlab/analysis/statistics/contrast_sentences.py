"""Sentences on comparisons of conditions, the same in reports, tables, the lab and terminals."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from baldwinlab.analysis.statistics.contrasts import Contrast, Contrasts
from baldwinlab.analysis.statistics.numbers import (
    format_interval,
    format_p_value,
    format_signed,
)
from baldwinlab.analysis.statistics.sample_sizes import TOO_FEW_RUNS

# Measure of the sentences about several conditions: fitness of the average agent.
SUMMARY_MEASURE: Final = "mean"
# The agent whose fitness is compared, by measure.
AGENT_NAMES: Final = {"mean": "average agent", "best": "best agent"}
# Largest number of conditions with a sentence of their own.
MAX_SENTENCES: Final = 3


def describe_contrast(contrast: Contrast) -> str:
    """Return the result of a comparison as a sentence with effect, interval, p-value and runs.

    Parameters
    ----------
    contrast
        The comparison.

    Returns
    -------
    str
        A sentence.
    """
    return f"{state_verdict(contrast)}: {format_effect(contrast)}, {format_test(contrast)}."


def state_verdict(contrast: Contrast) -> str:
    """Return the verdict of a comparison as a sentence without numbers and without a period.

    Parameters
    ----------
    contrast
        The comparison.
    """
    agent = AGENT_NAMES[contrast.measure]
    condition, reference = contrast.condition, contrast.reference
    if contrast.verdict == TOO_FEW_RUNS:
        return f"The runs are too few to compare the {agent}s of {condition} and {reference}"
    if contrast.verdict in ("higher", "lower"):
        return (
            f"The {agent} of {condition} has a {contrast.verdict} fitness than that of {reference}"
        )
    return f"Whether the {agent}s of {condition} and {reference} differ in fitness is undecided"


def format_effect(contrast: Contrast) -> str:
    """Return the effect of a comparison with its interval, such as "+198 [171, 224]".

    Parameters
    ----------
    contrast
        The comparison.
    """
    numbers = contrast.numbers
    return f"{format_signed(numbers.effect)} {format_interval(numbers)}".rstrip()


def format_test(contrast: Contrast) -> str:
    """Return the p-value and the runs, such as "corrected p 1.9e-09, 30 and 30 runs".

    Parameters
    ----------
    contrast
        The comparison.
    """
    numbers = contrast.numbers
    return f"corrected p {format_p_value(contrast.p_holm)}, {numbers.n_a} and {numbers.n_b} runs"


def summarize_contrasts(contrasts: Contrasts) -> list[str]:
    """Return sentences on the comparisons of the average agent: their number, then the largest.

    Parameters
    ----------
    contrasts
        The comparisons.

    Returns
    -------
    list of str
        Sentences. A single comparison has one sentence.
    """
    rows = [row for row in contrasts.rows if row.measure == SUMMARY_MEASURE]
    if len(rows) < 2:
        return [describe_contrast(row) for row in rows]
    significant = [row for row in rows if row.verdict in ("higher", "lower")]
    significant.sort(key=lambda row: -abs(row.numbers.effect))
    count = (
        f"In the fitness of the average agent, {len(significant) or 'none'} of {len(rows)} "
        f"conditions differ from {_name_references(rows)} with a corrected p below 0.05."
    )
    return [count, *(describe_contrast(row) for row in significant[:MAX_SENTENCES])]


def _name_references(rows: Sequence[Contrast]) -> str:
    references = {row.reference for row in rows}
    return references.pop() if len(references) == 1 else "the first condition on their map"
