"""A study in Python: run or open it, then read, compare, replay and export it.

>>> import baldwinlab as bl
>>> study = bl.run(["evo/A", "evo+self-taught/A"], runs=30, out="mine")  # doctest: +SKIP
>>> study.assay("innate"), study.report()  # doctest: +SKIP
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import xarray as xr

from baldwinlab import papers
from baldwinlab.api.agents import AgentNetwork, make_network, only_condition, read_genomes
from baldwinlab.api.export import files, frames
from baldwinlab.api.export.ro_crate import write_crate
from baldwinlab.api.export.table import Table
from baldwinlab.api.export.zarr import write_zarr
from baldwinlab.api.load import load_installed
from baldwinlab.api.run_study import RunOptions, run_missing_assays
from baldwinlab.core.errors import require_positive
from baldwinlab.core.files import parse_location
from baldwinlab.core.resources import require
from baldwinlab.experiment import Experiment
from baldwinlab.experiment.factors import SWEEP
from baldwinlab.simulation.memory import estimate_tables
from baldwinlab.simulation.replay import replay
from baldwinlab.studies.assays.catalog import ASSAYS, not_applicable_reasons
from baldwinlab.studies.assays.results import find_missing_assays, is_stored, open_assay
from baldwinlab.studies.open import open_runs
from baldwinlab.studies.records import StudyError
from baldwinlab.studies.store import StudyStore
from baldwinlab.studies.sweeps.design import open_sweep

if TYPE_CHECKING:
    import pandas as pd
    import polars as pl

MAX_LISTED: Final = 10  # conditions in the text of a study; a sweep may have thousands
RENAMED: Final = {"crate": "to_ro_crate"}


class Study:
    """A study on disk.

    `run`, `sweep` and `reproduce` create a study, and `open_study` opens one. A method that takes a
    condition raises StudyError for a name that is not in `conditions`.

    Parameters
    ----------
    store
        The directory of the study.
    """

    def __init__(self, store: StudyStore) -> None:
        """Wrap the directory of a study. Use `open_study` to open one."""
        self._store = store

    # A type checker would accept any attribute.
    if not TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any:
            """Raise AttributeError, with the new name of a renamed method."""
            hint = f"; it was renamed to {RENAMED[name]}" if name in RENAMED else ""
            raise AttributeError(f"'Study' object has no attribute {name!r}{hint}")

    @property
    def directory(self) -> Path:
        """Return the directory of the study."""
        return self._store.directory

    @property
    def seed(self) -> int:
        """Return the seed of the study, 0 to 2**31 - 1."""
        return self._store.seed

    @property
    def conditions(self) -> tuple[str, ...]:
        """Return the names of the conditions."""
        return tuple(self._store.experiments)

    def experiment(self, condition: str) -> Experiment:
        """Return the experiment of a condition.

        Parameters
        ----------
        condition
            Name of a condition.

        Returns
        -------
        Experiment
            Its settings.

        Raises
        ------
        StudyError
            The study has no such condition.
        """
        return self._store.experiment(condition)

    def runs(self, condition: str) -> list[int]:
        """Return the numbers of the stored runs of a condition.

        Parameters
        ----------
        condition
            Name of a condition.

        Returns
        -------
        list of int
            Numbers, from 0, in ascending order.

        Raises
        ------
        StudyError
            The study has no such condition.
        """
        self.experiment(condition)
        return self._store.runs(condition)

    def data(self, conditions: Sequence[str] | None = None) -> xr.Dataset:
        """Return the stored runs as one dataset.

        Parameters
        ----------
        conditions
            Names of conditions; all, unless given.

        Returns
        -------
        xarray.Dataset
            The dataset of `open_runs`; for a whole sweep, that of `open_sweep`. Write
            `data["map"]` for the map of a condition: `data.map` is a method of xarray.

        Raises
        ------
        StudyError
            The study has no such condition.
        DamagedRecordError
            A stored run is damaged.
        """
        if conditions is None and self._store.kind == SWEEP:
            return open_sweep(self.directory)
        return open_runs(self.directory, conditions)

    def assay(
        self,
        name: str,
        condition: str | None = None,
        *,
        workers: int | None = None,
        executor: str = "threads",
        force: bool = False,
    ) -> xr.Dataset:
        """Return the results of an assay. Run the assay first where it is not stored.

        Parameters
        ----------
        name
            "innate", "neutral", "within-life", "modules", "reaction" or "descent".
        condition
            Name of a condition; all conditions, unless given.
        workers
            Number of threads, at least 1; by default one per core. With the executor "slurm", the
            number of jobs.
        executor
            "threads", "dask:tcp://HOST:PORT", or "slurm".
        force
            Run even if less memory or disk is free than the estimate.

        Returns
        -------
        xarray.Dataset
            The variables of `baldwinlab.core.variables.ASSAYS[name]`. Without `condition` it has
            the dimension `condition`, with the conditions to which the assay applies.

        Raises
        ------
        StudyError
            There is no such assay or condition, or the assay applies to none of the conditions.
        RefusedError
            Too little memory or disk is free.
        InterruptedStudyError
            A worker or a disk failed. The same call continues.
        """
        if any(find_missing_assays(self._store, [name]).values()):
            options = RunOptions(workers, executor=executor, force=force)
            run_missing_assays(self._store, [name], options)
        if condition is not None:
            return open_assay(self.directory, name, condition)
        measured = [
            candidate for candidate in self.conditions if is_stored(name, self._store, candidate)
        ]
        if not measured:
            reasons = not_applicable_reasons(self._store, [name])
            why = "; ".join(reasons) or f"{name} does not apply to any condition"
            raise StudyError(f"{self.directory}: {why}")
        return self._join_assays(name, measured)

    def _join_assays(self, name: str, conditions: Sequence[str]) -> xr.Dataset:
        """Return the stored results of an assay along the dimension `condition`."""
        datasets = [open_assay(self.directory, name, condition) for condition in conditions]
        experiments = [dataset.attrs["experiment"] for dataset in datasets]
        joined = xr.concat(
            datasets,
            "condition",
            join="outer",
            data_vars="all",
            coords="minimal",
            combine_attrs="drop",
        )
        joined = joined.assign_coords(condition=list(conditions))
        joined = joined.assign(experiment=("condition", experiments))
        return joined.assign_attrs(seed=self.seed)

    def compare(self, baseline: str | None = None, *, last: int = 10) -> pd.DataFrame:
        """Compare the conditions of the study, as its report does.

        Parameters
        ----------
        baseline
            Condition with which all others are compared. By default a condition is compared with
            the first condition on its map. A condition that is the only one on its map, or that has
            no map, is compared with the first condition of the study.
        last
            Number of final generations that are averaged in each run, at least 1.

        Returns
        -------
        pandas.DataFrame
            One row per condition and measure: "mean", the fitness of the average agent, and "best",
            that of the best agent.

            - `condition_a`, `condition_b`: the condition, and the one it is compared with.
            - `n_a`, `n_b`: the numbers of runs.
            - `median_a`, `median_b`: medians over runs, in the unit of fitness (energy, for
              foragers).
            - `effect`: median of `condition_a` minus median of `condition_b`, in the same unit;
              `low`, `high`: its 95 % bootstrap interval [1]_.
            - `u`, `p`: statistic and two-sided p-value of the Mann-Whitney test [2]_.
            - `p_holm`: p-value corrected for all rows by Holm's method [3]_.
            - `a12`: probability that a run of `condition_a` exceeds one of `condition_b`, 0 to 1
              [4]_.
            - `smallest_p_holm`: smallest corrected p-value that the numbers of runs allow [5]_.
            - `verdict`: "higher" or "lower" if `p_holm` is below 0.05; "too few runs" if no data
              could give a verdict; else "undecided".

            `attrs["pairing"]` states which conditions are compared, and `attrs["too_few"]` how many
            runs are needed.

        Raises
        ------
        StudyError
            No run is stored, or none of `baseline`, or the study has no such condition.
        ArgumentError
            `last` is less than 1.

        References
        ----------
        .. [1] Efron and Tibshirani, An Introduction to the Bootstrap, 1993.
        .. [2] Mann and Whitney, Annals of Mathematical Statistics 18, 1947.
        .. [3] Holm, Scandinavian Journal of Statistics 6, 1979.
        .. [4] Vargha and Delaney, Journal of Educational and Behavioral Statistics 25, 2000.
        .. [5] Tarone, Biometrics 46, 1990.
        """
        # Imported late: pandas and SciPy's statistics take a while to load.
        import pandas as pd

        from baldwinlab.analysis.statistics.contrasts import COLUMNS
        from baldwinlab.api.publish import lab_results

        require_positive("last", last)
        contrasts = lab_results.compare_study(self._store, last, baseline or "")
        rows = [
            {
                **contrast.row(),
                "smallest_p_holm": contrast.smallest_p_holm,
                "verdict": contrast.verdict,
            }
            for contrast in contrasts.rows
        ]
        table = pd.DataFrame(rows, columns=[*COLUMNS, "smallest_p_holm", "verdict"])
        table.attrs = {"pairing": contrasts.pairing, "too_few": contrasts.too_few}
        return table

    def report(
        self,
        out: str | Path | None = None,
        *,
        last: int = 10,
        baseline: str | None = None,
        paper: str | Path | None = None,
        force: bool = False,
    ) -> Path:
        """Write the statistics, the figures and the report of the study.

        Parameters
        ----------
        out
            HTML file; report.html in the directory of the study, unless given.
        last
            Number of final generations that are averaged in each run, at least 1.
        baseline
            Condition with which all others are compared; see `compare`.
        paper
            Name or folder of the paper whose claims are evaluated; the paper that made the study,
            unless given.
        force
            Write even if less memory is free than the estimate, and overwrite an HTML file that is
            not a report.

        Returns
        -------
        pathlib.Path
            The path of the HTML file.

        Raises
        ------
        StudyError
            No run is stored, or none of `baseline`, or the study has no such condition.
        PaperError
            There is no such paper.
        ArgumentError
            `last` is less than 1.
        RefusedError
            Too little memory is free; `out` is a file of another program; or the study is a sweep
            or a multiverse, which has no baseline or no claims.
        """
        # Imported late: loading the figures takes a while.
        from baldwinlab.api.report import report

        return report(
            self._store,
            None if out is None else Path(out),
            last=last,
            force=force,
            baseline=baseline or "",
            paper=None if paper is None else papers.load(paper),
        )

    def replay(
        self,
        condition: str | None = None,
        *,
        run: int,
        generation: int,
        force: bool = False,
    ) -> xr.Dataset:
        """Simulate one lifetime of a stored run again, and record every step.

        Parameters
        ----------
        condition
            Name of a condition. A study with one condition does not need it.
        run
            Number of a stored run, from 0.
        generation
            Number of a generation, from 0.
        force
            Run even if less memory is free than the estimate.

        Returns
        -------
        xarray.Dataset
            The variables of `baldwinlab.core.variables.TRACE`, with the dimensions `step` and
            `agent`.

        Raises
        ------
        StudyError
            There is no such condition or run, or `condition` is missing.
        PartError
            A custom part of the study is not loaded.
        RefusedError
            There is no such generation, the model has no world, or too little memory is free.
        """
        condition = only_condition(self._store, condition)
        experiment = self.experiment(condition)
        self._store.require_parts(condition)
        energy = self._store.read(condition, run, genomes=False).energy
        return replay(
            experiment, seed=self.seed, run=run, generation=generation, energy=energy, force=force
        )

    def genomes(
        self,
        run: int,
        generation: int,
        agent: int | Sequence[int] | None = None,
        *,
        condition: str | None = None,
    ) -> xr.DataArray:
        """Return the genomes of one generation of a stored run.

        A generation whose genomes are not stored is bred again.

        Parameters
        ----------
        run, generation
            Numbers, from 0.
        agent
            Number of an agent, or several numbers, from 0; all agents, unless given.
        condition
            Name of a condition. A study with one condition does not need it.

        Returns
        -------
        xarray.DataArray
            The weights at birth, with the dimensions `agent`, `module` and `weight`. A single agent
            has no dimension `agent`.

        Raises
        ------
        StudyError
            The study has no such condition or run.
        ArgumentError
            The experiment has no such generation or agent.
        PartError
            A custom part of the study is not loaded.
        """
        name = only_condition(self._store, condition)
        return read_genomes(self._store, name, run, generation, agent)

    def network(
        self,
        run: int,
        generation: int,
        agent: int,
        *,
        condition: str | None = None,
        module: str = "action",
    ) -> AgentNetwork:
        """Return the network of one agent at birth.

        Parameters
        ----------
        run, generation, agent
            Numbers, from 0.
        condition
            Name of a condition. A study with one condition does not need it.
        module
            "action", or "reinforcement" if the agents have that network.

        Returns
        -------
        AgentNetwork
            Call it with inputs, an array [input] or [step, input], to get the outputs.

        Raises
        ------
        StudyError
            The study has no such condition or run.
        ArgumentError
            The experiment has no such generation or agent.
        RefusedError
            The agents have no such module, or are not foragers.
        PartError
            A custom part of the study is not loaded.
        """
        name = only_condition(self._store, condition)
        return make_network(self._store, name, run, generation, agent, module)

    def to_zarr(self, path: str | Path, *, force: bool = False) -> None:
        """Write the dataset of `data` as a Zarr store of version 3, one run at a time.

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
        require(f"one run of {self.directory}", need, force=force)
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
            Name of a condition; all, unless given.
        run
            Number of a run, from 0; all, unless given. It needs `condition`.
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

    def to_ro_crate(
        self, *, authors: Sequence[str] = (), license: str = "", force: bool = False
    ) -> Path:
        """Write ro-crate-metadata.json into the study: its content, origin, authors and license.

        Parameters
        ----------
        authors
            Names, each optionally followed by the address of an ORCID.
        license
            An address, or an SPDX name such as "CC-BY-4.0"; none, unless given.
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
            An author or the license is not valid, a library is missing, or the file was written by
            another program.
        """
        return write_crate(self._store, authors, license, force=force)

    def to_pandas(self) -> pd.DataFrame:
        """Return the table of `to_parquet`.

        Returns
        -------
        pandas.DataFrame
            `attrs` has the `units` and the `long_name` of the columns.

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

    def to_arviz(self, *, last: int = 10) -> xr.DataTree:
        """Return the outcome of each run as observations for ArviZ.

        Parameters
        ----------
        last
            Number of final generations that are averaged in each run, at least 1.

        Returns
        -------
        xarray.DataTree
            The fitness of the best and of the average agent, and the share of agents that ate (0 to
            1), by condition and run.

        Raises
        ------
        StudyError
            No run is stored, or a record is damaged.
        ArgumentError
            `last` is less than 1.
        """
        # Imported late: SciPy's statistics take a while to load.
        from baldwinlab.api.export.arviz import outcomes

        self._store.require_runs()
        return outcomes(self.data(), last)

    def __repr__(self) -> str:
        """Return the directory, the seed, the conditions with their runs, and the stored assays."""
        lines = [
            f"  {condition}: {_count_runs(len(self.runs(condition)))}"
            for condition in self.conditions[:MAX_LISTED]
        ]
        more = len(self.conditions) - MAX_LISTED
        if more > 0:
            lines.append(f"  and {more:,} more conditions")
        assays = [name for name in ASSAYS if (self.directory / "assays" / name).exists()]
        return "\n".join(
            [
                f"<Study {self.directory}, seed {self.seed}>",
                *lines,
                f"  assays: {', '.join(assays) or 'none'}",
            ]
        )

    def _repr_html_(self) -> str:
        """Return the text of the study and the curves of its first conditions, for notebooks."""
        # Imported late: loading the figures takes a while.
        from baldwinlab.api.study_html import html

        return html(repr(self), self._store, self.conditions[:MAX_LISTED])


def _count_runs(number: int) -> str:
    return "1 run" if number == 1 else f"{number:,} runs"


def open_study(directory: str | Path) -> Study:
    """Open a study.

    Parameters
    ----------
    directory
        The directory of a study, or a URL that fsspec can open.

    Returns
    -------
    Study
        The study.

    Raises
    ------
    StudyError
        There is no study, or its files are damaged.
    """
    load_installed()
    return Study(StudyStore(parse_location(directory)))
