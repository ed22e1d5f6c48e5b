"""Views of a generation of a model without a world, drawn in the World tab of the lab.

A model declares views by name in `Model.views`. A view depends only on the genomes at birth and on
the key of random numbers, so the lab can draw any generation of a stored run. A view returns a
matrix, paths or a grid.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

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
    value_label : str
        Description of a number, with its unit.
    """

    rows: Sequence[str]
    columns: Sequence[str]
    values: npt.NDArray[Any]
    value_label: str


class PathView(NamedTuple):
    """Lines from birth to death, such as the fitness after each trial.

    Attributes
    ----------
    lines : Mapping[str, array]
        Values of each line [step], by its name. All lines have the same length.
    step_label : str
        Name of a step, such as "trial".
    value_label : str
        Description of a number, with its unit.
    """

    lines: Mapping[str, npt.NDArray[Any]]
    step_label: str
    value_label: str


class GridView(NamedTuple):
    """A lifetime on a grid, in one or several visits.

    Attributes
    ----------
    cell_colors : Mapping[str, str]
        Color of each kind of cell, a name of the palette or "#rrggbb". The first kind has number 1.
    cells : array, int [step, row, column]
        Number of the kind of each cell. 0: empty.
    position : array, int [step, 2]
        Row and column of the agent.
    heading : array, int [step]
        Quarter turns clockwise from the right. -1: no heading.
    gained : array [step]
        Payoff of the current visit, up to this step.
    visit : array, int [step]
        Number of the visit. It never decreases.
    visit_label : str
        Name of a visit, such as "environment" or "trial".
    """

    cell_colors: Mapping[str, str]
    cells: npt.NDArray[Any]
    position: npt.NDArray[Any]
    heading: npt.NDArray[Any]
    gained: npt.NDArray[Any]
    visit: npt.NDArray[Any]
    visit_label: str


ViewData = MatrixView | PathView | GridView


class View(NamedTuple):
    """A view of a generation.

    The data should take a few MB at most. For long lifetimes, return the first steps.

    Attributes
    ----------
    description : str
        Text for the reader, in one or two sentences.
    make_data : Callable
        Function `make_data(model, key, genomes, agent)` that returns the data. `key` has `seed`,
        `run`, `generation` and `uniforms`. `genomes` are the genomes at birth, float32
        [agent, module, weight].
    has_agent_choice : bool
        True if the reader chooses the agent. False: `agent` is the fittest.
    """

    description: str
    make_data: Callable[[Any, Any, npt.NDArray[np.float32], int], ViewData]
    has_agent_choice: bool = True


def arrays_of(data: ViewData) -> dict[str, npt.NDArray[Any]]:
    """Return the arrays of a view in the data types that the web page of the lab reads.

    Raises `ValueError` if shapes or values do not match.
    """
    if isinstance(data, MatrixView):
        shape = (len(data.rows), len(data.columns))
        return {"values": _convert("values", data.values, shape, np.float32)}
    if isinstance(data, PathView):
        return {"lines": _stack_lines(data.lines)}
    return _convert_grid(data)


def _convert_grid(data: GridView) -> dict[str, npt.NDArray[Any]]:
    """Return the arrays of a grid view. Raise ValueError if shapes or values do not match."""
    cells = np.asarray(data.cells)
    n_kinds = len(data.cell_colors)
    if cells.ndim != 3 or not cells.size or not _are_whole_numbers(cells, n_kinds):
        raise ValueError(
            f"cells must be an array [step, row, column] of whole numbers from 0 to {n_kinds}, the "
            "number of entries of cell_colors, with at least one step"
        )
    steps, rows, columns = cells.shape
    layouts: Mapping[str, tuple[tuple[int, ...], Any]] = {
        "cells": ((steps, rows, columns), np.uint8),
        "position": ((steps, 2), np.int16),
        "heading": ((steps,), np.int8),
        "gained": ((steps,), np.float32),
        "visit": ((steps,), np.uint32),
    }
    return {
        name: _convert(name, getattr(data, name), shape, dtype)
        for name, (shape, dtype) in layouts.items()
    }


def _are_whole_numbers(values: npt.NDArray[Any], largest: int) -> bool:
    """Return whether all values are whole numbers from 0 to `largest`. NaN is no number."""
    # The remainder of NaN and of infinity is NaN, which is not 0.
    is_whole = (values % 1 == 0).all()
    return bool(is_whole and values.min() >= 0 and values.max() <= largest)


def _stack_lines(lines: Mapping[str, npt.NDArray[Any]]) -> npt.NDArray[np.float32]:
    """Return lines of equal length as one array [line, step]."""
    lengths = [np.size(line) for line in lines.values()]
    if not lengths or not lengths[0]:
        raise ValueError("a path view must have at least one line, and a line at least one number")
    shape = (lengths[0],)
    return np.stack([_convert(name, line, shape, np.float32) for name, line in lines.items()])


def _convert(name: str, values: Any, shape: tuple[int, ...], dtype: Any) -> npt.NDArray[Any]:
    """Return values as an array of a type. Raise ValueError if they do not have the shape."""
    if np.shape(values) != shape:
        raise ValueError(f"{name} is {list(np.shape(values))} and must be {list(shape)}")
    return np.asarray(values).astype(dtype)
