"""The exports of a study: files for third-party tools, and tables in memory."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from baldwinlab._version import __version__
from baldwinlab.api.export.formats import select_format, study_formats, write_export
from baldwinlab.api.export.table import StudyTable
from baldwinlab.api.study_runs import StudyRuns
from baldwinlab.core.deferred import xr
from baldwinlab.core.numbers import check_numbers

if TYPE_CHECKING:
    import pandas as pd
    import polars as pl


class StudyExports(StudyRuns):
    """The stored runs of a study and their exports."""

    def export(
        self,
        path: str | Path | None = None,
        *,
        format: str | None = None,
        force: bool = False,
        **options: Any,
    ) -> None:
        """Write the study in a format of third-party tools, as the command `export` does.

        docs/how-to/python.md lists the formats and their options. Parquet, CSV and Zarr files have
        the results of all runs, and no more than a part of them is in memory at a time.

        Parameters
        ----------
        path
            The file to write. The format "ro-crate" has none.
        format
            Name of a format. By default, the suffix of `path` selects it.
        force
            Overwrite a file that this method did not write. For Zarr, write even if less memory is
            free than the estimate.
        **options
            Options of the format, for example `condition`, `run`, `generation` and `agent`.

        Raises
        ------
        StudyError
            No run is stored, a record is damaged, or there is no such condition or run.
        ArgumentError
            A number is out of range.
        RefusedError
            `path` is a file of another program or of a study, a library is missing, an option is
            missing or does not apply to the format, or the format does not apply to the model.
        PartError
            A custom part of the study is not loaded.
        """
        location = None if path is None else Path(path)
        formats = study_formats()
        selected = select_format(formats, format, location)
        write_export(formats, selected, self._store, location, options, force=force)

    def to_pandas(self) -> pd.DataFrame:
        """Return a table with one row per condition, run, generation and agent.

        Returns
        -------
        pandas.DataFrame
            The table. Its `attrs` hold the `units` and the `long_name` of the columns.

        Raises
        ------
        StudyError
            No run is stored, or a record is damaged.
        """
        return StudyTable(self._store).to_pandas()

    def to_polars(self) -> pl.DataFrame:
        """Return the table of `to_pandas`, without units.

        Returns
        -------
        polars.DataFrame
            The table.

        Raises
        ------
        StudyError
            No run is stored, or a record is damaged.
        RefusedError
            Polars or PyArrow is not installed.
        """
        return StudyTable(self._store).to_polars()

    @check_numbers
    def to_arviz(self, *, last: int = 10) -> xr.DataTree:
        """Return the outcome of each run as observations for ArviZ, for a Bayesian comparison.

        Claims are evaluated on these outcomes.

        Parameters
        ----------
        last
            Number of final generations that are averaged in each run, at least 1.

        Returns
        -------
        xarray.DataTree
            The group `observed_data` has `best` and `mean`, the fitness of the best and of the
            average agent, and `share`, the share of agents that eat (0 to 1), by condition and run.
            Missing runs are NaN.

        Raises
        ------
        StudyError
            No run is stored, or a record is damaged.
        ArgumentError
            `last` is less than 1.
        """
        # Imported late: SciPy's statistics take a while to load.
        from baldwinlab.analysis.statistics import fitness

        self._store.require_runs()
        data = self.data()
        unit = data["energy"].attrs.get("units", "")
        attributes = {
            "best": {"units": unit, "long_name": "fitness of the best agent"},
            "mean": {"units": unit, "long_name": "fitness of the average agent"},
            "share": {
                "units": "1",
                "long_name": "share of agents that eat, or have a fitness above 0",
            },
        }
        outcomes = {
            name: fitness.final(data, name, last)
            .drop_attrs(deep=False)
            .assign_attrs(attributes_of_outcome)
            for name, attributes_of_outcome in attributes.items()
        }
        origin = {
            "creation_library": "baldwinlab",
            "creation_library_version": __version__,
            "last_generations": last,
        }
        observed = xr.Dataset(outcomes, attrs=data.attrs | origin)
        return xr.DataTree.from_dict({"observed_data": observed})
