"""Figures of the verdicts under all variants of a paper, as tables of colored cells."""

from __future__ import annotations

from itertools import pairwise
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from baldwinlab.analysis.figures.style import BLUE, FIGURE_WIDTH, styled
from baldwinlab.analysis.multiverse.analysis import Share, compute_shares
from baldwinlab.analysis.multiverse.records import Multiverse, Outcome, VariantResult
from baldwinlab.analysis.palette import DARK_GRAY, MID_GRAY, VERDICT_COLORS
from baldwinlab.analysis.statistics.rules import VERDICT_MARKS

WHITE_TO_BLUE: Final = LinearSegmentedColormap.from_list("white to blue", ["white", BLUE])
# Smallest share with white text, which is easier to read than black text on dark cells.
MIN_SHARE_FOR_WHITE_TEXT: Final = 0.9
# Heights of a row, and of the headings and margins without and with a legend, in inches.
ROW_HEIGHT: Final = 0.27
HEADINGS_HEIGHT: Final = 0.6
HEADINGS_AND_LEGEND_HEIGHT: Final = 0.9


@styled
def draw_variants(multiverse: Multiverse) -> Figure:
    """Draw the verdict and the deciding effect of each claim under each single-choice variant.

    The figure has one row per variant, one column per claim.
    """
    variants = multiverse.singles.variants
    claims = [claim.id for claim in multiverse.claims]
    figure = Figure((FIGURE_WIDTH, HEADINGS_AND_LEGEND_HEIGHT + ROW_HEIGHT * len(variants)))
    axes = _make_table_axes(figure, [_label_variant(variant) for variant in variants], claims)
    for row, variant in enumerate(variants):
        for column, claim in enumerate(claims):
            outcome = variant.outcomes[claim]
            # Shares of the width of the table.
            left = column / len(claims)
            right = (column + 1) / len(claims)
            color = VERDICT_COLORS[outcome.verdict]
            axes.axhspan(row - 0.5, row + 0.5, left, right, color=color, lw=0)
            axes.text(column, row, _format_outcome(outcome), ha="center", va="center")
    choices = [min(variant.choices, default="") for variant in variants]
    _draw_cell_borders(axes, len(claims), choices)
    drawn_verdicts = {variant.outcomes[claim].verdict for variant in variants for claim in claims}
    legend_handles = [
        Patch(facecolor=VERDICT_COLORS[verdict], edgecolor=MID_GRAY, label=f"{mark} {verdict}")
        for verdict, mark in VERDICT_MARKS.items()
        if verdict in drawn_verdicts
    ]
    figure.legend(handles=legend_handles, loc="outside lower center", ncols=len(legend_handles))
    return figure


def _label_variant(variant: VariantResult) -> str:
    return f"{variant.name}  {''.join(variant.choices)}".rstrip()


def _format_outcome(outcome: Outcome) -> str:
    """Return a mark and the effect, such as "✓ +282". A level, such as a share, has no sign."""
    if outcome.effect is None:
        return VERDICT_MARKS[outcome.verdict]
    sign = "+" if outcome.p_holm is not None and outcome.effect > 0 else ""
    text = f"{outcome.effect:.{_decimals(outcome.effect)}f}"
    return f"{VERDICT_MARKS[outcome.verdict]} {sign}{text}".replace("-", "−")


def _decimals(effect: float) -> int:
    if abs(effect) >= 10 or effect == 0:
        return 0
    return 1 if abs(effect) >= 1 else 2


@styled
def draw_shares(multiverse: Multiverse) -> Figure:
    """Draw the share of combinations under which each claim holds, by choice and alternative.

    The figure has one row per alternative, one column per claim.
    """
    shares = compute_shares(multiverse)
    claims = [claim.id for claim in multiverse.claims]
    rows = list(dict.fromkeys((share.choice, share.alternative) for share in shares))
    table = {(share.choice, share.alternative, share.claim): share for share in shares}
    figure = Figure((FIGURE_WIDTH, HEADINGS_HEIGHT + ROW_HEIGHT * len(rows)))
    axes = _make_table_axes(
        figure, [f"{alternative}  {choice}" for choice, alternative in rows], claims
    )
    values = np.array([[table[(*row, claim)].share or 0.0 for claim in claims] for row in rows])
    axes.imshow(values, WHITE_TO_BLUE, vmin=0, vmax=1, aspect="auto")
    for row, key in enumerate(rows):
        for column, claim in enumerate(claims):
            _write_share(axes, column, row, table[(*key, claim)])
    _draw_cell_borders(axes, len(claims), [choice for choice, _ in rows])
    return figure


def _write_share(axes: Axes, column: int, row: int, share: Share) -> None:
    text = "–" if share.share is None else f"{share.share:.0%}"
    color = "white" if (share.share or 0) >= MIN_SHARE_FOR_WHITE_TEXT else "black"
    axes.text(column, row, text, ha="center", va="center", color=color)


def _make_table_axes(figure: Figure, row_labels: list[str], column_labels: list[str]) -> Axes:
    axes = figure.subplots()
    axes.grid(visible=False)
    axes.set_xlim(-0.5, len(column_labels) - 0.5)
    axes.set_ylim(len(row_labels) - 0.5, -0.5)
    axes.set_xticks(range(len(column_labels)), column_labels, fontweight="bold")
    axes.set_yticks(range(len(row_labels)), row_labels)
    axes.tick_params(top=True, labeltop=True, bottom=False, labelbottom=False, length=0)
    axes.spines[:].set_visible(False)
    return axes


def _draw_cell_borders(axes: Axes, n_columns: int, choices: list[str]) -> None:
    """Draw white lines between cells, and dark lines between the rows of different choices."""
    for column in range(1, n_columns):
        axes.axvline(column - 0.5, color="white", lw=1.5)
    for row, (choice, next_choice) in enumerate(pairwise(choices)):
        color = "white" if choice == next_choice else DARK_GRAY
        axes.axhline(row + 0.5, color=color, lw=1.0)
