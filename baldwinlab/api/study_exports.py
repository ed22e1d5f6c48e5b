"""The exports of a study: tables, stores, data trees and metadata."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from baldwinlab.api.export import files, frames
from baldwinlab.api.export.onnx_network import AgentKey, Moment, write_onnx
from baldwinlab.api.export.ro_crate import write_crate
from baldwinlab.api.export.table import Table
from baldwinlab.api.export.tree_sequence import write_tree_sequence
from baldwinlab.api.export.zarr import write_zarr
from baldwinlab.api.study_runs import StudyRuns
from baldwinlab.core.deferred import xr
from baldwinlab.core.numbers import check_numbers
from baldwinlab.core.resources import require_resources
from baldwinlab.simulation.memory import estimate_tables

if TYPE_CHECKING:
    import pandas as pd
    import polars as pl


class StudyExports(StudyRuns):
    """The stored runs of a study and their exports."""

    def to_zarr(self, path: str | Path, *, force: bool = False) -> None:
        """Write the dataset of the method `data` as a Zarr store of version 3.

        One run is in memory at a time.

        Parameters
        ----------
        path
            The folder to create. It must not exist.
        force
            Write even if less memory is free than the estimate.

        Raises
        ------
        StudyError
            No run is stored, or a record is damaged.
        RefusedError
            `path` exists, a library is missing, or too little memory is free.
        """
        self._store.require_runs()
        need = max(
            estimate_tables([(self.experiment(condition), 1)]) for condition in self.conditions
        )
        require_resources(f"one run of {self._store.location}", need, force=force)
        write_zarr(self._store, Path(path))

    def to_parquet(self, path: str | Path, *, force: bool = False) -> None:
        """Write a tidy table as Parquet, one run at a time.

        The table has one row per condition, run, generation and agent, and one column per variable.
        The metadata of a column has its unit and its meaning.

        Parameters
        ----------
        path
            The file to write.
        force
            Overwrite a file that this method did not write.

        Raises
        ------
        StudyError
            No run is stored, or a record is damaged.
        RefusedError
            `path` is a file of another program or of a study, or a library is missing.
        """
        files.write_parquet(Table(self._store), Path(path), force=force)

    def to_csv(self, path: str | Path, *, force: bool = False) -> None:
        """Write the table of `to_parquet` as CSV, with units and meanings in PATH-metadata.json.

        Parameters
        ----------
        path
            The file to write.
        force
            Overwrite a file that this method did not write.

        Raises
        ------
        StudyError
            No run is stored, or a record is damaged.
        RefusedError
            `path` is a file of another program or of a study.

        References
        ----------
        Metadata Vocabulary for Tabular Data, W3C Recommendation, 17 December 2015.
        """
        files.write_csv(Table(self._store), Path(path), force=force)

    @check_numbers
    def to_phylogeny(
        self,
        path: str | Path,
        condition: str | None = None,
        run: int | None = None,
        *,
        force: bool = False,
    ) -> None:
        """Write the parents of every agent as CSV in the ALife data standard for phylogenies.

        Parameters
        ----------
        path
            The file to write.
        condition
            Name of a condition. By default all conditions.
        run
            Number of a run, from 0. By default all runs. It needs `condition`.
        force
            Overwrite a file that this method did not write.

        Raises
        ------
        StudyError
            There is no such condition or run, no run is stored, or a record is damaged.
        RefusedError
            `path` is a file of another program or of a study, or `run` has no `condition`.
        """
        files.write_phylogeny(self._store, Path(path), condition, run, force=force)

    @check_numbers
    def to_tskit(
        self,
        path: str | Path,
        condition: str | None = None,
        run: int | None = None,
        *,
        force: bool = False,
    ) -> None:
        """Write the ancestry of the last generation of a run as a tree sequence of tskit.

        A position is a gene, in the row of the genes of all modules. A gene comes from the parent
        whose value is closer. If both values are equally close, it comes from the parent of the
        gene before it; the first gene, from the fitter parent.

        Parameters
        ----------
        path
            The file to write.
        condition
            Name of a condition. A study with one condition does not need it.
        run
            Number of a run, from 0. A condition with one run does not need it.
        force
            Overwrite a file that this method did not write.

        Raises
        ------
        StudyError
            There is no such condition or run, or a record is damaged.
        RefusedError
            `path` is a file of another program or of a study, tskit is not installed, `run` is
            missing, or genes of the experiment do not come from the stored parents.
        PartError
            A custom part of the study is not loaded.

        References
        ----------
        J. Kelleher et al., "Efficient pedigree recording for fast population genetics simulation",
        PLoS Computational Biology 14 (2018).
        """
        write_tree_sequence(self._store, Path(path), condition, run, force=force)

    @check_numbers
    def to_onnx(
        self,
        path: str | Path,
        run: int,
        generation: int,
        agent: int,
        *,
        condition: str | None = None,
        moment: Moment = "birth",
        force: bool = False,
    ) -> None:
        """Write the feed-forward action network of an agent as ONNX.

        The outputs of a runtime agree with those of `network` within float32.

        Parameters
        ----------
        path
            The file to write.
        run, generation, agent
            Numbers, from 0.
        condition
            Name of a condition. A study with one condition does not need it.
        moment
            "birth", or "death" for the weights after all learning.
        force
            Overwrite a file that this method did not write.

        Raises
        ------
        StudyError
            There is no such condition or run.
        ArgumentError
            The experiment has no such generation or agent.
        RefusedError
            `path` is a file of another program or of a study, onnx is not installed, or the network
            is not feed-forward.
        PartError
            A custom part of the study is not loaded.
        """
        key = AgentKey(run, generation, agent)
        write_onnx(self._store, Path(path), condition, key, moment=moment, force=force)

    def to_ro_crate(
        self, *, authors: Sequence[str] = (), license: str = "", force: bool = False
    ) -> Path:
        """Write ro-crate-metadata.json into the directory of the study.

        The file describes the content, the origin, the authors and the license of the study.

        Parameters
        ----------
        authors
            Names, each optionally followed by the address of an ORCID.
        license
            An address, or an SPDX name such as "CC-BY-4.0". By default no license.
        force
            Overwrite a file that this method did not write.

        Returns
        -------
        pathlib.Path
            The path of the file.

        Raises
        ------
        StudyError
            No run is stored, or a record is damaged.
        RefusedError
            An author or the license is not valid, a library is missing, or another program wrote
            the file.
        """
        return write_crate(self._store, authors, license, force=force)

    def to_pandas(self) -> pd.DataFrame:
        """Return the table of `to_parquet`.

        Returns
        -------
        pandas.DataFrame
            The table. Its `attrs` hold the `units` and the `long_name` of the columns.

        Raises
        ------
        StudyError
            No run is stored, or a record is damaged.
        """
        return frames.to_pandas(Table(self._store))

    def to_polars(self) -> pl.DataFrame:
        """Return the table of `to_parquet`, without units.

        Returns
        -------
        polars.DataFrame
            The table.

        Raises
        ------
        StudyError
            No run is stored, or a record is damaged.
        RefusedError
            Polars is not installed.
        """
        return frames.to_polars(Table(self._store))

    @check_numbers
    def to_arviz(self, *, last: int = 10) -> xr.DataTree:
        """Return the outcome of each run as observations for ArviZ.

        Parameters
        ----------
        last
            Number of final generations that are averaged in each run, at least 1.

        Returns
        -------
        xarray.DataTree
            The fitness of the best and of the average agent, and the share of agents that eat (0 to
            1), by condition and run.

        Raises
        ------
        StudyError
            No run is stored, or a record is damaged.
        ArgumentError
            `last` is less than 1.
        """
        # Imported late: SciPy's statistics take a while to load.
        from baldwinlab.api.export.arviz import collect_outcomes

        self._store.require_runs()
        return collect_outcomes(self.data(), last)
