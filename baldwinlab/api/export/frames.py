"""Convert the tidy table of a study to a data frame of pandas or polars."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from baldwinlab.api.export.extra import require_extra
from baldwinlab.api.export.table import Block, Column, Table
from baldwinlab.core.deferred import pd

if TYPE_CHECKING:
    import polars as pl


def to_pandas(table: Table) -> pd.DataFrame:
    """Return the table for pandas.

    Text is categorical. A variable that the model of a condition does not record is NaN. `attrs`
    holds the units and the meanings of the columns.
    """
    frame = _fill_frame(table, table.blocks(), table.rows)
    frame.attrs = table.attributes
    return frame


def make_frame(table: Table, block: Block) -> pd.DataFrame:
    """Return the rows of one run.

    Returns one row per agent and generation.
    """
    return _fill_frame(table, [block], block.rows)


def _fill_frame(table: Table, blocks: Iterable[Block], rows: int) -> pd.DataFrame:
    """Return the rows of blocks. The frame is filled block by block, to need one copy in memory."""
    arrays = {
        column.name: np.empty(rows, _code_dtype(column) if column.categories else column.dtype)
        for column in table.columns
    }
    start = 0
    for block in blocks:
        rows_of_block = slice(start, start + block.rows)
        start += block.rows
        for column in table.columns:
            name = column.name
            if column.categories:
                arrays[name][rows_of_block] = column.categories.index(str(block.run_values[name]))
            elif name in block.run_values or name in block.arrays:
                arrays[name][rows_of_block] = block.run_values.get(name, block.arrays.get(name))
            else:
                # The model does not record the variable. NaN needs a float type.
                arrays[name] = arrays[name].astype(
                    np.result_type(column.dtype, np.float32), copy=False
                )
                arrays[name][rows_of_block] = np.nan
    texts = {
        column.name: pd.Categorical.from_codes(arrays[column.name], column.categories)
        for column in table.columns
        if column.categories
    }
    return pd.DataFrame(arrays | texts, copy=False)


def _code_dtype(column: Column) -> np.dtype[Any]:
    """Return the smallest integer type for the codes of a column of text."""
    return np.min_scalar_type(-len(column.categories))


def to_polars(table: Table) -> pl.DataFrame:
    """Return the table for polars.

    Text is an Enum. A variable that the model of a condition does not record is null.
    """
    with require_extra("a table of polars"):
        import polars as pl

    def _series(column: Column, block: Block) -> pl.Series:
        """Return the values of a column in the rows of one run."""
        if column.categories:
            return pl.repeat(
                block.run_values[column.name],
                block.rows,
                dtype=pl.Enum(column.categories),
                eager=True,
            )
        dtype = pl.Series(np.empty(0, column.dtype)).dtype
        if column.name in block.arrays:
            return pl.Series(block.arrays[column.name]).cast(dtype)
        return pl.repeat(block.run_values.get(column.name), block.rows, dtype=dtype, eager=True)

    frames = []
    for block in table.blocks():
        series = {column.name: _series(column, block) for column in table.columns}
        frames.append(pl.DataFrame(series))
    return pl.concat(frames, rechunk=True)
