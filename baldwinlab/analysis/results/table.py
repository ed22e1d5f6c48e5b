"""The tables of comparisons, the same in reports, the lab and terminals.

The first table has effects and verdicts. The second one has the tests, and pages fold it.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from baldwinlab.analysis.results.contrasts import Contrast, Contrasts
from baldwinlab.analysis.results.numbers import (
    format_estimate,
    format_number,
    format_numbers,
    format_p_value,
)
from baldwinlab.analysis.results.verdicts import TOO_FEW_RUNS
from baldwinlab.analysis.statistics.comparisons import Comparison, Pairs
from baldwinlab.experiment.outcome import name_outcome_of

# The agent whose outcome is compared, by measure.
AGENT_NAMES: Final = {"mean": "average agent", "best": "best agent"}
# Headings of the numbers in all tables of comparisons, by key of `format_comparison`.
NUMBER_HEADINGS: Final[Mapping[str, str]] = {
    "effect": "Effect [95 % interval]",
    "p": "p",
    "p_holm": "Corrected p",
    "a12": "A12",
    "runs": "Runs",
}
# The columns of both tables of conditions, by key of `list_cells`. The first column also has the
# cell "context".
HEADINGS: Final[Mapping[str, str]] = {
    "condition": "Condition",
    "verdict": "Verdict",
    "effect": NUMBER_HEADINGS["effect"],
    "runs": NUMBER_HEADINGS["runs"],
}
TEST_HEADINGS: Final[Mapping[str, str]] = {
    "condition": "Condition",
    **{key: NUMBER_HEADINGS[key] for key in ("p", "p_holm", "a12")},
}


def format_comparison(numbers: Comparison | Pairs, p_holm: float) -> dict[str, str]:
    """Return the numbers of a comparison as text, by the keys of `NUMBER_HEADINGS`.

    A12 of pairs is the fraction of runs above 0, where a tie counts half.
    """
    if isinstance(numbers, Pairs):
        runs = f"{numbers.above} above, {numbers.below} below 0, of {numbers.n}"
    else:
        runs = f"{numbers.n_a}, {numbers.n_b}" if numbers.n_b else str(numbers.n_a)
    return {
        "effect": format_effect(numbers),
        "p": format_p_value(numbers.p),
        "p_holm": format_p_value(p_holm),
        "a12": format_number(numbers.a12),
        "runs": runs,
    }


def list_cells(contrasts: Contrasts) -> list[dict[str, str]]:
    """Return the cells of each comparison as text, by the keys of both tables and "context".

    A common reference is left out, because `pairing` names it.
    """
    return [_format_cells(row, contrasts.has_common_reference) for row in contrasts.rows]


def _format_cells(contrast: Contrast, has_common_reference: bool) -> dict[str, str]:
    agent = AGENT_NAMES[contrast.measure]
    return {
        "condition": contrast.condition,
        "context": agent
        if has_common_reference
        else f"{agent}, compared with {contrast.reference}",
        "verdict": contrast.verdict,
        **format_comparison(contrast.numbers, contrast.test.p_holm),
    }


def describe_method(contrasts: Contrasts) -> str:
    """Return sentences that explain the columns of a table of comparisons."""
    return (
        f"The value of a run is its average over the last {contrasts.last} generations. The effect "
        "is the difference between the medians of the runs, with its 95 % bootstrap interval. p is "
        f"from the Mann-Whitney test; Holm's method corrects it for {len(contrasts.rows)} tests. "
        "The verdict is higher or lower if the corrected p is below 0.05, even if the interval of "
        "this comparison alone says otherwise. A12 is the probability that a run of the condition "
        "is higher than a run of the other condition."
    )


def describe_contrast(contrast: Contrast) -> str:
    """Return the result of a comparison as a sentence with effect, interval, p-value and runs."""
    condition, reference, numbers = contrast.condition, contrast.reference, contrast.numbers
    if contrast.is_decided:
        result = f"{condition} is {contrast.verdict} than {reference}"
    elif contrast.verdict == TOO_FEW_RUNS:
        result = f"The runs are too few to compare {condition} and {reference}"
    else:
        result = f"It is undecided whether {condition} and {reference} differ"
    return (
        f"{result} in {name_outcome_of(contrast.outcome, AGENT_NAMES[contrast.measure])}: "
        f"{format_effect(numbers)}, corrected p {format_p_value(contrast.test.p_holm)}, "
        f"{numbers.n_a} and {numbers.n_b} runs."
    )


def format_effect(numbers: Comparison | Pairs) -> str:
    """Return an effect with its interval: "+198 [171, 224]". Without sample b, it has no "+"."""
    is_level = isinstance(numbers, Comparison) and not numbers.n_b
    sign = "+" if numbers.effect > 0 and not is_level else ""
    return f"{sign}{format_estimate(numbers.effect, numbers.low, numbers.high)}"


def format_medians(numbers: Comparison | Pairs) -> list[str]:
    """Return the medians of both samples."""
    return format_numbers([numbers.median_a, numbers.median_b])
