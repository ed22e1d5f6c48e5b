"""Views of a generation of a model without a world, drawn in the World tab of the lab.

A model declares views by name in `Model.views`. A view is a pure function of the genomes at birth,
so the lab can draw any generation of a stored run. It returns one of three kinds of data.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt


class MatrixView(NamedTuple):
    """A number for each row and column, such as payoffs between strategies.

    Attributes
    ----------
    rows, columns : sequence of str
        Names of the rows and columns.
    values : array [row, column]
        The numbers. NaN: no value.
    value : str
        Description of a number, with its unit.
    """

    rows: Sequence[str]
    columns: Sequence[str]
    values: npt.NDArray[Any]
    value: str


class PathView(NamedTuple):
    """Lines from birth to death, such as the fitness after each trial.

    Attributes
    ----------
    lines : Mapping[str, array]
        Values of each line [step], by its name. All lines have the same length.
    step : str
        Name of a step, such as "trial".
    value : str
        Description of a number, with its unit.
    """

    lines: Mapping[str, npt.NDArray[Any]]
    step: str
    value: str


class GridView(NamedTuple):
    """A lifetime on a grid, in one or several visits.

    Attributes
    ----------
    marks : Mapping[str, str]
        Color of each kind of cell, a name of the palette or "#rrggbb". The first kind has number 1.
    ground : array, int [step, row, column]
        Number of the kind of each cell. 0: empty.
    place : array, int [step, 2]
        Row and column of the agent.
    heading : array, int [step]
        Quarter turns clockwise from the right. -1: no heading.
    gained : array [step]
        Payoff of the current visit so far.
    visit : array, int [step]
        Number of the visit. It never decreases.
    visits : str
        Name of a visit, such as "environment" or "trial".
    """

    marks: Mapping[str, str]
    ground: npt.NDArray[Any]
    place: npt.NDArray[Any]
    heading: npt.NDArray[Any]
    gained: npt.NDArray[Any]
    visit: npt.NDArray[Any]
    visits: str


ViewData = MatrixView | PathView | GridView


class View(NamedTuple):
    """A view of a generation.

    The data should take a few MB at most. For long lifetimes, return the first steps.

    Attributes
    ----------
    meaning : str
        Description for the reader, in one or two sentences.
    of : Callable
        Function `of(model, key, genomes, agent)` that returns the data. `key` has `seed`, `run`,
        `generation` and `uniforms`. `genomes` are those at birth, float32 [agent, module, weight].
    of_an_agent : bool
        True if the reader chooses the agent. False: `agent` is the fittest.
    """

    meaning: str
    of: Callable[[Any, Any, npt.NDArray[np.float32], int], ViewData]
    of_an_agent: bool = True


def arrays_of(seen: ViewData) -> dict[str, npt.NDArray[Any]]:
    """Return the arrays of a view by name, in the types of the page.

    Raises
    ------
    ValueError
        If shapes or values do not match.
    """
    if isinstance(seen, MatrixView):
        wanted = (len(seen.rows), len(seen.columns))
        return {"values": _of_shape("values", seen.values, wanted, np.float32)}
    if isinstance(seen, PathView):
        lines = [np.asarray(line) for line in seen.lines.values()]
        if not lines or not lines[0].size:
            raise ValueError("a walk has a line at least, and each a number at least")
        return {
            "lines": np.stack(
                [
                    _of_shape(name, line, (lines[0].size,), np.float32)
                    for name, line in seen.lines.items()
                ]
            )
        }
    steps, *grid = np.shape(seen.ground) if np.ndim(seen.ground) == 3 else (0, 0, 0)
    if not steps or np.max(seen.ground) > len(seen.marks):
        raise ValueError(
            "ground must be [step, row, column] of numbers of marks, with a step at least"
        )
    return {
        name: _of_shape(name, getattr(seen, name), (steps, *last(grid)), dtype)
        for name, (last, dtype) in _OF_CELLS.items()
    }


_OF_CELLS: Final[Mapping[str, tuple[Callable[[list[int]], tuple[int, ...]], Any]]] = {
    "ground": (tuple, np.uint8),
    "place": (lambda grid: (2,), np.int16),
    "heading": (lambda grid: (), np.int8),
    "gained": (lambda grid: (), np.float32),
    "visit": (lambda grid: (), np.uint32),
}


def _of_shape(name: str, values: Any, shape: tuple[int, ...], dtype: Any) -> npt.NDArray[Any]:
    if np.shape(values) != shape:
        raise ValueError(f"{name} is {list(np.shape(values))} and must be {list(shape)}")
    return np.asarray(values).astype(dtype)
