"""The table and the sentences of comparisons, the same in reports, the lab and terminals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

from baldwinlab.analysis.results.contrasts import Contrast, Contrasts
from baldwinlab.analysis.results.numbers import format_estimate, format_number, format_p_value
from baldwinlab.analysis.results.verdicts import TOO_FEW_RUNS
from baldwinlab.analysis.statistics.comparisons import Comparison, Pairs
from baldwinlab.experiment.outcome import name_outcome_of

# Measure of the sentences about several conditions: the average agent.
SUMMARY_MEASURE: Final = "mean"
# The agent whose outcome is compared, by measure.
AGENT_NAMES: Final = {"mean": "average agent", "best": "best agent"}
# Largest number of conditions with a sentence of their own.
MAX_SENTENCES: Final = 3
# Headings of the numbers in all tables of comparisons, by key of `format_comparison`.
NUMBER_HEADINGS: Final[Mapping[str, str]] = {
    "effect": "Effect [95 % interval]",
    "p": "p",
    "p_holm": "Corrected p",
    "a12": "A12",
    "runs": "Runs",
}
# The columns of a table of conditions, by key of `list_cells`. The first column also has the cell
# "context".
HEADINGS: Final[Mapping[str, str]] = {
    "condition": "Condition",
    "verdict": "Verdict",
    **NUMBER_HEADINGS,
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
    """Return the cells of each comparison as text, by the keys of `HEADINGS` and "context".

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
    return f"{state_verdict(contrast)}: {format_effect(contrast.numbers)}, {format_test(contrast)}."


def state_verdict(contrast: Contrast) -> str:
    """Return the verdict of a comparison as a sentence without numbers and without a period."""
    outcome = name_outcome_of(contrast.outcome, AGENT_NAMES[contrast.measure])
    condition, reference = contrast.condition, contrast.reference
    if contrast.verdict == TOO_FEW_RUNS:
        return f"The runs are too few to compare {condition} and {reference} in {outcome}"
    if contrast.verdict in ("higher", "lower"):
        return f"{condition} is {contrast.verdict} than {reference} in {outcome}"
    return f"It is undecided whether {condition} and {reference} differ in {outcome}"


def format_effect(numbers: Comparison | Pairs) -> str:
    """Return an effect with its interval: "+198 [171, 224]". Without sample b, it has no "+"."""
    is_level = isinstance(numbers, Comparison) and not numbers.n_b
    sign = "+" if numbers.effect > 0 and not is_level else ""
    return f"{sign}{format_estimate(numbers.effect, numbers.low, numbers.high)}"


def format_test(contrast: Contrast) -> str:
    """Return the p-value and the runs, such as "corrected p 1.9e-09, 30 and 30 runs"."""
    numbers = contrast.numbers
    return (
        f"corrected p {format_p_value(contrast.test.p_holm)}, {numbers.n_a} and {numbers.n_b} runs"
    )


def summarize_contrasts(contrasts: Contrasts) -> list[str]:
    """Return sentences on the average agent: how many conditions differ, then the largest effects.

    A single comparison has one sentence.
    """
    rows = [row for row in contrasts.rows if row.measure == SUMMARY_MEASURE]
    if len(rows) < 2:
        return [describe_contrast(row) for row in rows]
    significant = [row for row in rows if row.verdict in ("higher", "lower")]
    significant.sort(key=lambda row: -abs(row.numbers.effect))  # Largest effect first.
    outcome = name_outcome_of(rows[0].outcome, AGENT_NAMES[SUMMARY_MEASURE])
    verdicts = [row.verdict for row in significant]
    verb = "differ" if len(significant) > 1 else "differs"
    numbers = [f"{verdicts.count(verdict)} {verdict}" for verdict in dict.fromkeys(verdicts)]
    count = (
        f"{len(significant) or 'None'} of {len(rows)} conditions {verb} from "
        f"{_name_references(rows)} in {outcome}{': ' if numbers else ''}{', '.join(numbers)} "
        "(corrected p below 0.05)."
    )
    return [count, *(describe_contrast(row) for row in significant[:MAX_SENTENCES])]


def _name_references(rows: Sequence[Contrast]) -> str:
    references = {row.reference for row in rows}
    return references.pop() if len(references) == 1 else "the first on their map"
