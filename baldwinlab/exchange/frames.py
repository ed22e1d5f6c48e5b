"""The tidy table of a study in memory, for pandas and polars."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from baldwinlab.exchange.extra import needed_for
from baldwinlab.exchange.table import Block, Column, Table

if TYPE_CHECKING:
    import polars as pl


def to_pandas(table: Table) -> pd.DataFrame:
    """Text is categorical, and what a condition's model does not record is NaN. `attrs` has the units and meanings."""
    found = pd.concat([frame_of(table, block) for block in table.blocks()], ignore_index=True)
    found.attrs = table.attributes
    return found


def frame_of(table: Table, block: Block) -> pd.DataFrame:
    """The rows of one run."""

    def values(column: Column) -> Any:
        if column.values:
            code = column.values.index(str(block.labels[column.name]))
            return pd.Categorical.from_codes(np.full(block.rows, code), column.values)
        if column.name in block.labels:
            return np.full(block.rows, block.labels[column.name], column.dtype)
        return block.arrays.get(column.name, np.full(block.rows, np.nan, np.result_type(column.dtype, np.float32)))

    return pd.DataFrame({column.name: values(column) for column in table.columns})


def to_polars(table: Table) -> pl.DataFrame:
    """Text is an Enum, and what a condition's model does not record is null."""
    with needed_for("a table of polars"):
        import polars as pl

    def series(column: Column, block: Block) -> pl.Series:
        if column.values:
            return pl.repeat(block.labels[column.name], block.rows, dtype=pl.Enum(column.values), eager=True)
        dtype = pl.Series(np.empty(0, column.dtype)).dtype
        if column.name in block.arrays:
            return pl.Series(block.arrays[column.name]).cast(dtype)
        return pl.repeat(block.labels.get(column.name), block.rows, dtype=dtype, eager=True)

    frames = [pl.DataFrame({column.name: series(column, block) for column in table.columns}) for block in table.blocks()]
    return pl.concat(frames, rechunk=True)
