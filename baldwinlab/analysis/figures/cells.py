"""Cells: tables of colored cells with texts."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.colors import Colormap, LinearSegmentedColormap
from matplotlib.image import AxesImage

from baldwinlab.analysis.figures.style import BLUE
from baldwinlab.analysis.palette import choose_text_color

# People with any color vision can read cividis: J. R. Nuñez, C. R. Anderton and R. S. Renslow, PLOS
# ONE 13 (2018).
CIVIDIS: Final = "cividis"
WHITE_TO_BLUE: Final = LinearSegmentedColormap.from_list("white to blue", ["white", BLUE])


def draw_cells(
    axes: Axes,
    values: npt.NDArray[np.float64],
    texts: npt.ArrayLike,
    colormap: str | Colormap = CIVIDIS,
    limits: tuple[float, float] = (0, 1),
    *,
    is_upward: bool = False,
) -> AxesImage:
    """Draw values [row, column] as colored cells with texts. A cell of NaN has no color.

    `limits`: the values of the first and of the last color. `is_upward`: whether the first row is
    at the bottom, as on an axis.
    """
    image = axes.imshow(
        values,
        colormap,
        vmin=limits[0],
        vmax=limits[1],
        aspect="auto",
        origin="lower" if is_upward else "upper",
    )
    colors = np.asarray(image.to_rgba(np.ma.masked_invalid(values)))
    opacities = colors[..., 3:]
    backgrounds = opacities * colors[..., :3] + 1 - opacities
    for (row, column), text in np.ndenumerate(np.asarray(texts, str)):
        color = choose_text_color(backgrounds[row, column].tolist())
        axes.text(column, row, str(text), ha="center", va="center", color=color)
    axes.grid(visible=False)
    return image


def label_cells(axes: Axes, rows: Sequence[object], columns: Sequence[object]) -> None:
    """Label the rows and the columns of cells, without frame and ticks."""
    axes.set_xticks(range(len(columns)), [str(label) for label in columns])
    axes.set_yticks(range(len(rows)), [str(label) for label in rows])
    axes.tick_params(length=0)
    axes.spines[:].set_visible(False)
