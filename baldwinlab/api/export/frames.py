"""The tidy table of a study in memory, for pandas and polars."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from baldwinlab.api.export.extra import needed_for
from baldwinlab.api.export.table import Block, Column, Table

if TYPE_CHECKING:
    import polars as pl


def to_pandas(table: Table) -> pd.DataFrame:
    """Text is categorical, and what a condition's model does not record is NaN. `attrs` has the units and meanings."""
    found = _frame(table, table.blocks(), table.rows)
    found.attrs = table.attributes
    return found


def frame_of(table: Table, block: Block) -> pd.DataFrame:
    """The rows of one run."""
    return _frame(table, [block], block.rows)


def _frame(table: Table, blocks: Iterable[Block], rows: int) -> pd.DataFrame:
    """Filled block by block: there is never a second one of it."""
    arrays = {
        one.name: np.empty(rows, _code(one) if one.values else one.dtype) for one in table.columns
    }
    first = 0
    for block in blocks:
        there, first = slice(first, first + block.rows), first + block.rows
        for column in table.columns:
            name = column.name
            if column.values:
                arrays[name][there] = column.values.index(str(block.labels[name]))
            elif name in block.labels or name in block.arrays:
                arrays[name][there] = block.labels.get(name, block.arrays.get(name))
            else:
                arrays[name] = arrays[name].astype(
                    np.result_type(column.dtype, np.float32), copy=False
                )
                arrays[name][there] = np.nan
    texts = {
        one.name: pd.Categorical.from_codes(arrays[one.name], one.values)
        for one in table.columns
        if one.values
    }
    return pd.DataFrame(arrays | texts, copy=False)


def _code(column: Column) -> np.dtype[Any]:
    """The smallest whole numbers that tell the values of a column of text apart."""
    return np.min_scalar_type(-len(column.values))


def to_polars(table: Table) -> pl.DataFrame:
    """Text is an Enum, and what a condition's model does not record is null."""
    with needed_for("a table of polars"):
        import polars as pl

    def series(column: Column, block: Block) -> pl.Series:
        if column.values:
            return pl.repeat(
                block.labels[column.name], block.rows, dtype=pl.Enum(column.values), eager=True
            )
        dtype = pl.Series(np.empty(0, column.dtype)).dtype
        if column.name in block.arrays:
            return pl.Series(block.arrays[column.name]).cast(dtype)
        return pl.repeat(block.labels.get(column.name), block.rows, dtype=dtype, eager=True)

    frames = [
        pl.DataFrame({column.name: series(column, block) for column in table.columns})
        for block in table.blocks()
    ]
    return pl.concat(frames, rechunk=True)
