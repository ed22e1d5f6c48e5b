"""The claims under every variant of the paper, as heat maps."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from baldwinlab.analysis.figures.palette import DARK_GRAY, MID_GRAY, VERDICTS
from baldwinlab.analysis.figures.style import BLUE, WIDTH, styled
from baldwinlab.analysis.multiverse.analysis import Multiverse, Outcome, Share, Variant, shares
from baldwinlab.analysis.statistics.rules import MARKS

WHITE_TO_BLUE = LinearSegmentedColormap.from_list("white to blue", ["white", BLUE])
DARK = 0.9  # from this share on, white letters are the more legible


@styled
def variants(multiverse: Multiverse) -> Figure:
    """A row for each variant that makes at most one choice otherwise, a column a claim: its verdict, and the deciding effect."""
    rows, names = multiverse.singles.variants, [claim.id for claim in multiverse.claims]
    figure = Figure((WIDTH, 0.9 + 0.27 * len(rows)))
    axes = _grid(figure, [_label(variant) for variant in rows], names)
    for row, variant in enumerate(rows):
        for column, name in enumerate(names):
            outcome = variant.outcomes[name]
            axes.axhspan(
                row - 0.5,
                row + 0.5,
                column / len(names),
                (column + 1) / len(names),
                color=VERDICTS[outcome.verdict],
                lw=0,
            )
            axes.text(column, row, _cell(outcome), ha="center", va="center")
    _lines(axes, len(names), [min(variant.choices, default="") for variant in rows])
    seen = {variant.outcomes[name].verdict for variant in rows for name in names}
    keys = [
        Patch(facecolor=VERDICTS[verdict], edgecolor=MID_GRAY, label=f"{mark} {verdict}")
        for verdict, mark in MARKS.items()
        if verdict in seen
    ]
    figure.legend(handles=keys, loc="outside lower center", ncols=len(keys))
    return figure


def _label(variant: Variant) -> str:
    return f"{variant.name}  {''.join(variant.choices)}".rstrip()


def _cell(outcome: Outcome) -> str:
    """Such as: ✓ +282; a level, as of shares, has no sign."""
    if outcome.effect is None:
        return MARKS[outcome.verdict]
    sign = "+" if outcome.p_holm is not None and outcome.effect > 0 else ""
    digits = (
        0
        if abs(outcome.effect) >= 10 or outcome.effect == 0
        else 1
        if abs(outcome.effect) >= 1
        else 2
    )
    return f"{MARKS[outcome.verdict]} {sign}{outcome.effect:.{digits}f}".replace("-", "−")


@styled
def variants_shares(multiverse: Multiverse) -> Figure:
    """For each alternative of each choice, the share of the combinations with it under which a claim holds."""
    found, names = shares(multiverse), [claim.id for claim in multiverse.claims]
    rows = list(dict.fromkeys((share.choice, share.alternative) for share in found))
    table = {(share.choice, share.alternative, share.claim): share for share in found}
    figure = Figure((WIDTH, 0.6 + 0.27 * len(rows)))
    axes = _grid(figure, [f"{alternative}  {choice}" for choice, alternative in rows], names)
    values = np.array([[table[(*row, name)].share or 0.0 for name in names] for row in rows])
    axes.imshow(values, WHITE_TO_BLUE, vmin=0, vmax=1, aspect="auto")
    for row, key in enumerate(rows):
        for column, name in enumerate(names):
            _percent(axes, column, row, table[(*key, name)])
    _lines(axes, len(names), [choice for choice, _ in rows])
    return figure


def _percent(axes: Axes, column: int, row: int, share: Share) -> None:
    text = "–" if share.share is None else f"{share.share:.0%}"
    axes.text(
        column,
        row,
        text,
        ha="center",
        va="center",
        color="white" if (share.share or 0) >= DARK else "black",
    )


def _grid(figure: Figure, labels: list[str], names: list[str]) -> Axes:
    axes = figure.subplots()
    axes.grid(visible=False)
    axes.set_xlim(-0.5, len(names) - 0.5)
    axes.set_ylim(len(labels) - 0.5, -0.5)
    axes.set_xticks(range(len(names)), names, fontweight="bold")
    axes.set_yticks(range(len(labels)), labels)
    axes.tick_params(top=True, labeltop=True, bottom=False, labelbottom=False, length=0)
    axes.spines[:].set_visible(False)
    return axes


def _lines(axes: Axes, columns: int, choices: list[str]) -> None:
    """White lines between the cells, and a dark one where a choice ends and the next begins."""
    for column in range(1, columns):
        axes.axvline(column - 0.5, color="white", lw=1.5)
    for row, (above, below) in enumerate(pairwise(choices)):
        axes.axhline(row + 0.5, color="white" if above == below else DARK_GRAY, lw=1.0)
