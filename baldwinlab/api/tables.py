"""Print the results of a study as tables on the terminal."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from rich.box import SIMPLE_HEAD
from rich.table import Table
from rich.text import Text

from baldwinlab.analysis.claim_results import ClaimResult
from baldwinlab.analysis.multiverse.records import Multiverse
from baldwinlab.analysis.statistics.contrasts import Contrast, Contrasts
from baldwinlab.analysis.statistics.rules import MARKS
from baldwinlab.analysis.statistics.sample_sizes import TOO_FEW
from baldwinlab.core import console

VERDICT_STYLE = {"holds": "green", "does not hold": "red", "undecided": "yellow"}
LABEL_STYLE = VERDICT_STYLE | {TOO_FEW: "yellow", "higher": "green", "lower": "red"}
MAX_SHOWN = 20
"""Number of printed comparisons. The report has all."""
MEASURES = {"mean": "average agent", "best": "best agent"}


def contrasts_table(contrasts: Contrasts) -> Table:
    """Return the comparisons of the conditions with their verdicts, at most `MAX_SHOWN`.

    Parameters
    ----------
    contrasts
        The comparisons.

    Returns
    -------
    rich.table.Table
        The table.
    """
    hidden = len(contrasts.rows) - MAX_SHOWN
    more = (
        f" {hidden} more comparisons are in statistics.csv and in the report." if hidden > 0 else ""
    )
    table = Table(
        title="Comparison of the conditions",
        caption=f"{contrasts.pairing}{more}",
        title_style="bold",
        caption_justify="left",
        box=SIMPLE_HEAD,
        padding=(0, 1, 1, 0),
    )
    table.add_column("verdict", width=13)
    table.add_column(
        "condition, measured effect [95 % interval], p, corrected p, effect size, runs"
    )
    for contrast in contrasts.rows[:MAX_SHOWN]:
        compared = (
            f"{contrast.condition} against {contrast.reference}, {MEASURES[contrast.measure]}"
        )
        verdict = Text(contrast.verdict, style=LABEL_STYLE[contrast.verdict])
        table.add_row(verdict, Text.assemble(compared, (f"\n{_numbers(contrast)}", "dim")))
    return table


def show_contrasts(contrasts: Contrasts) -> None:
    """Print the comparisons of the conditions, and whether the runs are too few for a verdict.

    Parameters
    ----------
    contrasts
        The comparisons.
    """
    if contrasts.rows:
        console.console.print(contrasts_table(contrasts))
        console.info_if_any(contrasts.too_few)


def _numbers(contrast: Contrast) -> str:
    """For example: `+198 [171, 224], p 9.3e-10, corrected 1.9e-09, A12 1.00, runs 30 and 30`."""
    numbers = contrast.numbers
    interval = f" [{numbers.low:.4g}, {numbers.high:.4g}]" if numbers.low == numbers.low else ""
    tested = f"p {numbers.p:.2g}, corrected {contrast.p_holm:.2g}, A12 {numbers.a12:.2f}"
    return f"{numbers.effect:+.4g}{interval}, {tested}, runs {numbers.n_a} and {numbers.n_b}"


def claims_table(results: Sequence[ClaimResult], title: str = "", changed_model: str = "") -> Table:
    """Return every claim with its verdict, its measured effect and the paper's figure.

    For a claim of several comparisons, the effect is that of the comparison that decided.

    Parameters
    ----------
    results
        The evaluated claims.
    title
        Title of the table.
    changed_model
        Sentence about the changes of the paper's model, if it is changed.

    Returns
    -------
    rich.table.Table
        The table.
    """
    of_paper = any(result.claim.of_paper for result in results)
    title = title or f"What {'the paper claims' if of_paper else 'was asked'}, and what we measured"
    if changed_model:
        title = f"{title}, in a changed model"
    table = Table(
        title=title,
        caption=changed_model,
        title_style="bold",
        caption_style="bold",
        box=SIMPLE_HEAD,
        padding=(0, 1, 1, 0),
    )
    table.add_column("")
    table.add_column("verdict", width=13)
    last_column = "; the paper's figure" if of_paper else ""
    table.add_column(
        f"claim, measured effect [95 % interval], corrected p, effect size{last_column}"
    )
    for result in results:
        record = result.record()
        verdict = Text(result.label, style=LABEL_STYLE.get(result.label, ""))
        table.add_row(
            record["id"], verdict, Text.assemble(record["claim"], ("\n" + _measured(record), "dim"))
        )
    return table


def _measured(record: dict[str, Any]) -> str:
    """For example: `282.4 [212, 293.2], p 1.9e-08, A12 0.95; paper: about 40 items more`."""
    parts = [
        f"{record['effect']:.4g}"
        if record["effect"] is not None
        else record["why_not"] or "not measured"
    ]
    if record["interval"]:
        parts[0] += " [{:.4g}, {:.4g}]".format(*record["interval"])
    if record["p_holm"] is not None:
        parts.append(f"p {record['p_holm']:.2g}")
    if record["a12"] is not None:
        parts.append(f"A12 {record['a12']:.2f}")
    return "; ".join(
        [", ".join(parts), *([f"paper: {record['paper']}"] if record["paper"] else [])]
    )


def variants_table(multiverse: Multiverse) -> Table:
    """Return the verdict of each claim under each variant that changes at most one choice.

    Parameters
    ----------
    multiverse
        The results of a multiverse.

    Returns
    -------
    rich.table.Table
        The table. Its last column is the distance of a variant from the figures of the paper.
    """
    table = Table(
        title="Every variant of the paper",
        title_style="bold",
        box=SIMPLE_HEAD,
        padding=(0, 1, 0, 0),
    )
    for heading in ("variant", *(claim.id for claim in multiverse.claims), "hold"):
        table.add_column(heading, no_wrap=True)
    table.add_column("distance", justify="right")
    for variant in multiverse.singles.variants:
        verdicts = [variant.outcomes[claim.id].verdict for claim in multiverse.claims]
        marks = [Text(MARKS[verdict], style=VERDICT_STYLE.get(verdict, "")) for verdict in verdicts]
        distance = "" if variant.distance is None else f"{variant.distance:.2f}"
        table.add_row(
            " ".join((variant.name, *variant.choices)), *marks, str(variant.held), distance
        )
    return table
