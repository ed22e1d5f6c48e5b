"""Tables of results on the terminal, for `report` and for the command line."""

from __future__ import annotations

from collections.abc import Sequence
from math import nan
from typing import Any

from rich.box import SIMPLE_HEAD
from rich.table import Table
from rich.text import Text

from baldwinlab.analysis.claim_results import ClaimResult
from baldwinlab.analysis.multiverse.records import Multiverse
from baldwinlab.analysis.results.contrasts import Contrasts
from baldwinlab.analysis.results.headlines import describe_statistic, summarize_contrasts
from baldwinlab.analysis.results.numbers import format_estimate, format_number
from baldwinlab.analysis.results.table import HEADINGS, NUMBER_HEADINGS, list_cells
from baldwinlab.analysis.results.verdicts import MARKS, TOO_FEW_RUNS
from baldwinlab.core import console
from baldwinlab.papers.claims import KINDS

VERDICT_STYLE = {"holds": "green", "does not hold": "red", "undecided": "yellow"}
LABEL_STYLE = VERDICT_STYLE | {TOO_FEW_RUNS: "yellow", "higher": "green", "lower": "red"}
MIN_WIDE_COLUMNS = 60
"""Minimum width of a terminal in which a number has one line."""
MAX_COMPARISONS = 20
"""Maximum number of printed comparisons. The report shows all."""


def _make_table(**options: Any) -> Table:
    return Table(title_style="bold", box=SIMPLE_HEAD, **options)


def make_contrasts_table(contrasts: Contrasts) -> Table:
    """Return the comparisons of the conditions with their verdicts, at most `MAX_COMPARISONS`."""
    n_hidden = len(contrasts.rows) - MAX_COMPARISONS
    hidden = f"{n_hidden} more comparisons, and " if n_hidden > 0 else ""
    table = _make_table(
        title="Comparison of the conditions",
        caption=f"{contrasts.pairing} The report has {hidden}p, corrected p and A12.",
        caption_justify="left",
        padding=0,
    )
    # Longer verdicts have two lines, so that names fit into 80 columns.
    is_wide = console.console.width >= MIN_WIDE_COLUMNS
    for key, heading in HEADINGS.items():
        width = 9 if key == "verdict" and is_wide else None
        is_number = key in NUMBER_HEADINGS
        table.add_column(heading, overflow="fold", width=width, no_wrap=is_number and is_wide)
    for cells in list_cells(contrasts)[:MAX_COMPARISONS]:
        name = Text.assemble(cells["condition"], (f"\n{cells['context']}", "dim"))
        verdict = Text(cells["verdict"], style=LABEL_STYLE[cells["verdict"]])
        styled_cells = cells | {"condition": name, "verdict": verdict}
        table.add_row(*(styled_cells[key] for key in HEADINGS))
    return table


def show_contrasts(contrasts: Contrasts) -> None:
    """Print the comparisons of the conditions, and whether the runs are too few for a verdict."""
    if contrasts.rows:
        for sentence in summarize_contrasts(contrasts):
            console.info(sentence)
        console.info(describe_statistic(contrasts))
        console.console.print(make_contrasts_table(contrasts))
        notes = [contrast.note for contrast in contrasts.rows]
        # Only the notes of printed comparisons are printed, so `notes` can be longer.
        for cells, note in zip(list_cells(contrasts)[:MAX_COMPARISONS], notes, strict=False):
            if note:
                console.info(f"{cells['condition']}, {cells['context']}: {note}")
        console.info_if_any(contrasts.too_few)
    else:
        console.info_if_any(contrasts.pairing)


def make_claims_table(
    results: Sequence[ClaimResult], title: str = "", changed_model: str = ""
) -> Table:
    """Return every claim with its verdict, its measured effect and the number in the paper.

    A claim of several comparisons has the effect of the comparison that decided the verdict.

    `title`: "" for the default title. `changed_model`: sentence about the changes of the paper's
    model. "" if the model is not changed.
    """
    are_of_paper = any(result.claim.of_paper for result in results)
    if not title:
        title = "Claims of the paper and our results" if are_of_paper else "Claims and our results"
    if changed_model:
        title = f"{title}, in a changed model"
    table = _make_table(
        title=title,
        caption=changed_model,
        caption_style="bold",
        padding=(0, 1, 1, 0),
    )
    table.add_column("")
    table.add_column("verdict", width=13)
    paper_heading = "; the paper's figure" if are_of_paper else ""
    table.add_column(
        f"claim, measured effect [95 % interval], corrected p, effect size{paper_heading}"
    )
    for result in results:
        record = result.record()
        mark = "\nunstable" if result.is_unstable else ""
        verdict = Text(f"{result.label}{mark}", style=LABEL_STYLE.get(result.label, ""))
        table.add_row(
            record["id"],
            verdict,
            Text.assemble(record["claim"], (f"\n{_format_result(record)}", "dim")),
        )
    return table


def _format_result(record: dict[str, Any]) -> str:
    """Return, for example, "282.4 [212, 293.2], p 1.9e-08, A12 0.95 (claim of the paper)"."""
    if record["effect"] is None:
        effect = record["why_not"] or "not measured"
    else:
        low, high = record["interval"] or (nan, nan)
        effect = format_estimate(record["effect"], low, high, digits=4)
    numbers = [effect]
    if record["p_holm"] is not None:
        numbers.append(f"p {record['p_holm']:.2g}")
    if record["a12"] is not None:
        numbers.append(f"A12 {record['a12']:.2f}")
    text = ", ".join(numbers)
    if record["note"]:
        text = f"{text}; {record['note']}"
    if record["paper"]:
        text = f"{text}; paper: {record['paper']}"
    return f"{text} ({KINDS[record['kind']][0]})"


def make_variants_table(multiverse: Multiverse) -> Table:
    """Return the verdict of each claim under each variant that changes at most one choice."""
    table = _make_table(
        title="Every variant of the paper",
        padding=(0, 1, 0, 0),
    )
    # "hold": number of claims that hold. "distance": distance of the results from the paper.
    for heading in ("variant", *(claim.id for claim in multiverse.claims), "hold"):
        table.add_column(heading, no_wrap=True)
    table.add_column("distance", justify="right")
    for variant in multiverse.singles.variants:
        verdicts = [variant.outcomes[claim.id].verdict for claim in multiverse.claims]
        marks = [Text(MARKS[verdict], style=VERDICT_STYLE.get(verdict, "")) for verdict in verdicts]
        distance = "" if variant.distance is None else format_number(variant.distance)
        table.add_row(
            " ".join((variant.name, *variant.choices)), *marks, str(variant.held), distance
        )
    return table
