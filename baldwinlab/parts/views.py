"""How a generation of a model can be looked at, where its lives have no world: what the lab's World tab draws of it.

A model declares views by name (`Model.views`). Each is a pure function of what a generation was born with, so that any
generation of any stored run can be looked at: the lab breeds its genomes again and asks. It gives one of three kinds of data.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt


class MatrixView(NamedTuple):
    """A number for each row and column, such as what one strategy gets against another."""

    rows: Sequence[str]
    columns: Sequence[str]
    values: npt.NDArray[Any]  # [row, column]; NaN where there is none
    value: str  # what a number is, with its unit


class PathView(NamedTuple):
    """Numbers that follow each other in a life, such as fitness trial by trial: a line each, from birth on."""

    lines: Mapping[
        str, npt.NDArray[Any]
    ]  # by name, [step]; all as long, and of a single number where nothing follows birth
    step: str  # what lies between two numbers: "trial"
    value: str  # what a number is, with its unit


class GridView(NamedTuple):
    """A life on a grid, step by step: where the agent stands, and what lies where. It may be made of several visits."""

    marks: Mapping[
        str, str
    ]  # what may lie in a cell, with its colour ("green", "#rrggbb"); the first has number 1
    ground: npt.NDArray[Any]  # [step, row, column], the number of what lies there; 0 for nothing
    place: npt.NDArray[Any]  # [step, (row, column)] of the agent
    heading: npt.NDArray[
        Any
    ]  # [step], quarter turns clockwise from the right; -1 where it has none
    gained: npt.NDArray[Any]  # [step], payoff in this visit until then
    visit: npt.NDArray[Any]  # [step], the number of the visit, never falling
    visits: str  # what a visit is called: "environment", "trial"


ViewData = MatrixView | PathView | GridView


class View(NamedTuple):
    """A way to look at a generation: `of(model, key, genomes, agent)`, with genomes [agent, module, weight] at birth.

    `key` has seed, run, generation and `uniforms`, so that what is seen is what was lived. What is seen should fit into some
    megabytes; of long lives, give the beginning.
    """

    meaning: str  # what one sees, in a sentence or two
    of: Callable[[Any, Any, npt.NDArray[np.float32], int], ViewData]
    of_an_agent: bool = True  # whether the reader chooses one; if not, `of` is given the fittest


def arrays_of(seen: ViewData) -> dict[str, npt.NDArray[Any]]:
    """The arrays of what is seen, by name, in the types of a page. Raises ValueError where they do not fit together."""
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
