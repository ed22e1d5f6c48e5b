"""A study in Python: run it or open it, and ask it.

>>> import baldwinlab as bl
>>> study = bl.run(["evo/A", "evo+self-taught/A"], runs=30, out="mine")  # doctest: +SKIP
>>> study.assay("innate"), study.report()  # doctest: +SKIP
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

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
from baldwinlab.core.files import location
from baldwinlab.core.resources import require
from baldwinlab.experiment import Experiment
from baldwinlab.experiment.factors import SWEEP
from baldwinlab.simulation.memory import of_tables
from baldwinlab.simulation.replay import replay
from baldwinlab.studies import store
from baldwinlab.studies.assays.run import ASSAYS, is_stored, misfits, missing_assays, open_assay
from baldwinlab.studies.open import open_runs
from baldwinlab.studies.records import StudyError
from baldwinlab.studies.sweeps.design import open_sweep

if TYPE_CHECKING:
    import pandas as pd
    import polars as pl

SHOWN = 10  # conditions that are listed; a sweep may have thousands


class Study:
    """A study on disk, and what can be asked of it. `run`, `sweep` and `reproduce` make one, `open` opens one."""

    def __init__(self, stored: store.StudyStore) -> None:
        self._stored = stored

    @property
    def directory(self) -> Path:
        return self._stored.directory

    @property
    def seed(self) -> int:
        return self._stored.seed

    @property
    def conditions(self) -> tuple[str, ...]:
        return tuple(self._stored.experiments)

    def experiment(self, condition: str) -> Experiment:
        """Raises StudyError for a condition that the study has not, as everything here does that takes one."""
        return self._stored.experiment(condition)

    def runs(self, condition: str) -> list[int]:
        """The numbers of the runs that are stored."""
        self.experiment(condition)
        return self._stored.runs(condition)

    def data(self, conditions: Sequence[str] | None = None) -> xr.Dataset:
        """All stored runs, or those of some conditions: as `open_runs`; of a whole sweep, as `open_sweep`.

        The map of a condition is the coordinate `data["map"]`; `data.map` is a method of xarray.
        """
        if conditions is None and self._stored.kind == SWEEP:
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
        """What an assay measures of a condition, or of all along the dim `condition`; what is not stored yet is measured first.

        The variables are `baldwinlab.core.variables.ASSAYS[name]`. Raises StudyError for an assay that there is not, and where
        it has nothing to measure; and RefusedError, unless forced, for more memory or disk than is free.
        """
        if any(missing_assays(self._stored, [name]).values()):
            options = RunOptions(workers, executor=executor, force=force)
            run_missing_assays(self._stored, [name], options)
        if condition is not None:
            return open_assay(self.directory, name, condition)
        measured = [each for each in self.conditions if is_stored(name, self._stored, each)]
        if not measured:
            why = "; ".join(misfits(self._stored, [name])) or f"{name} has nothing to measure there"
            raise StudyError(f"{self.directory}: {why}")
        found = [open_assay(self.directory, name, each) for each in measured]
        texts = [each.attrs["experiment"] for each in found]
        whole = xr.concat(
            found,
            "condition",
            join="outer",
            data_vars="all",
            coords="minimal",
            combine_attrs="drop",
        )
        whole = whole.assign_coords(condition=measured)
        return whole.assign(experiment=("condition", texts)).assign_attrs(seed=self.seed)

    def compare(self, baseline: str | None = None, *, last: int = 10) -> pd.DataFrame:
        """Compare the conditions of the study, as its report does.

        Parameters
        ----------
        baseline
            The condition with which all others are compared. Unless given, a condition is compared with the first condition on
            its map; a condition that is alone on its map, or has no map, with the first condition of the study.
        last
            The number of generations over which a run is averaged, counted from its last one.

        Returns
        -------
        pandas.DataFrame
            A row for each condition and measure: "mean", the fitness of the average agent, and "best", that of the best agent.

            - `condition_a`, `condition_b`: the condition, and the one with which it is compared.
            - `n_a`, `n_b`: the numbers of runs.
            - `median_a`, `median_b`: medians over runs, in the unit of fitness (energy, for agents that forage).
            - `effect`: the difference of the medians [1], in the same unit; `low`, `high`: its 95 % bootstrap interval [2].
            - `u`, `p`: the statistic and the two-sided p-value of the Mann-Whitney test [3].
            - `p_holm`: the p-value corrected for all rows by Holm's method [4].
            - `a12`: the probability that a run of `condition_a` is higher than one of `condition_b`, from 0 to 1 [5].
            - `smallest_p_holm`: the smallest corrected p-value that the numbers of runs allow [6].
            - `verdict`: "higher" or "lower" where `p_holm` is below 0.05; "too few runs" where no data could give a verdict;
              else "undecided".

            `attrs["pairing"]` says which conditions are compared, and `attrs["too_few"]` how many runs are needed.

        Raises
        ------
        StudyError
            No run is stored, or none of `baseline`, or the study has no such condition.
        ArgumentError
            `last` is less than 1.

        References
        ----------
        [1] of `condition_a` less that of `condition_b`.
        [2] Efron and Tibshirani, An Introduction to the Bootstrap, 1993.
        [3] Mann and Whitney, Annals of Mathematical Statistics 18, 1947.
        [4] Holm, Scandinavian Journal of Statistics 6, 1979.
        [5] Vargha and Delaney, Journal of Educational and Behavioral Statistics 25, 2000.
        [6] Tarone, Biometrics 46, 1990.
        """
        import pandas as pd

        from baldwinlab.analysis.statistics.contrasts import COLUMNS
        from baldwinlab.api.publish import (
            lab_results,  # here, because SciPy's statistics take a while to load
        )

        require_positive("last", last)
        contrasts = lab_results.compare(self._stored, last, baseline or "")
        decided = [
            {"smallest_p_holm": row.smallest_p_holm, "verdict": row.verdict}
            for row in contrasts.rows
        ]
        rows = [row.row() | verdict for row, verdict in zip(contrasts.rows, decided, strict=True)]
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
        """Write the statistics, the figures and the page of the study.

        Parameters
        ----------
        out
            The HTML file; report.html in the study's directory unless given.
        last
            The number of generations over which a run is averaged, counted from its last one.
        baseline
            The condition with which all others are compared; see `compare`.
        paper
            The paper whose claims are decided, by its name or folder; the one that made the study unless given.
        force
            Write even if it takes more memory than is free, or over a file that is no report.

        Returns
        -------
        pathlib.Path
            The path of the page.

        Raises
        ------
        StudyError
            No run is stored, or none of `baseline`, or the study has no such condition.
        PaperError
            There is no such paper.
        RefusedError
            It takes more memory than is free, `out` is a file that is no report, or the study is of a kind that has no baseline
            or no claims.
        """
        from baldwinlab.api.report import report  # here, because to load the figures takes a while

        return report(
            self._stored,
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
        """Simulate one lifetime of a stored run again, every step: the variables of `baldwinlab.core.variables.TRACE`.

        A study with one condition does not need `condition`. Raises StudyError, with the conditions, where it is missing.
        """
        condition = only_condition(self._stored, condition)
        experiment = self.experiment(condition)
        self._stored.require_parts(condition)
        energy = self._stored.read(condition, run, genomes=False).energy
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
        """Return the genomes of one generation of a stored run, also of a generation that was not kept.

        Parameters
        ----------
        run, generation
            Numbers, from 0.
        agent
            One agent, or several; all of them if it is not given.
        condition
            The condition of the run. A study with one condition does not need it.

        Returns
        -------
        xarray.DataArray
            The weights at birth, with the dimensions `agent`, `module` and `weight`. One agent has no dimension `agent`.

        Raises
        ------
        StudyError
            For a condition or a run that the study does not have.
        ValueError
            For a generation or an agent that the experiment does not have.
        """
        name = only_condition(self._stored, condition)
        return read_genomes(self._stored, name, run, generation, agent)

    def network(
        self,
        run: int,
        generation: int,
        agent: int,
        *,
        condition: str | None = None,
        module: str = "action",
    ) -> AgentNetwork:
        """Return the network of one stored agent at birth. Call it with inputs to get its outputs.

        Parameters
        ----------
        run, generation, agent
            Numbers, from 0.
        condition
            The condition of the run. A study with one condition does not need it.
        module
            "action", or "reinforcement" where agents have that network.

        Returns
        -------
        AgentNetwork
            A function of inputs, an array [input] or [step, input], with the attributes `inputs`, `outputs` and `weights`.

        Raises
        ------
        StudyError
            For a condition or a run that the study does not have.
        ValueError
            For a generation, an agent or a module that the experiment does not have, and for another model than foragers.
        """
        name = only_condition(self._stored, condition)
        return make_network(self._stored, name, run, generation, agent, module)

    def to_zarr(self, path: str | Path, *, force: bool = False) -> None:
        """Write `data` as a Zarr store, version 3: a folder that is not there yet.

        It is written run by run. Raises RefusedError where it is, and, unless forced, for more memory than is free. This and all
        that follow raise StudyError where no run is stored and for a damaged record, and RefusedError where a library is missing.
        """
        self._stored.require_runs()
        need = max(of_tables([(self.experiment(condition), 1)]) for condition in self.conditions)
        require(f"one run of {self.directory}", need, force=force)
        write_zarr(self._stored, Path(path))

    def to_parquet(self, path: str | Path, *, force: bool = False) -> None:
        """Write a tidy table: a row for each condition, run, generation and agent, and a column for each variable.

        Units and meanings are the fields' metadata. It is written run by run. Raises RefusedError where a file is there that this
        has not written, unless forced.
        """
        files.write_parquet(Table(self._stored), Path(path), force=force)

    def to_csv(self, path: str | Path, *, force: bool = False) -> None:
        """Write the same table as CSV, with units and meanings beside it, in PATH-metadata.json. Raises as `to_parquet` does."""
        files.write_csv(Table(self._stored), Path(path), force=force)

    def to_phylogeny(
        self,
        path: str | Path,
        condition: str | None = None,
        run: int | None = None,
        *,
        force: bool = False,
    ) -> None:
        """Write who begot whom in all runs, those of a condition, or one: CSV in the ALife data standard.

        Raises as `to_parquet` does.
        """
        files.write_phylogeny(self._stored, Path(path), condition, run, force=force)

    def to_pandas(self) -> pd.DataFrame:
        """The table of `to_parquet` in memory; `attrs` has `units` and `long_name` of its columns."""
        return frames.to_pandas(Table(self._stored))

    def to_polars(self) -> pl.DataFrame:
        """The table of `to_parquet` in memory. Polars keeps no units."""
        return frames.to_polars(Table(self._stored))

    def to_arviz(self, *, last: int = 10) -> xr.DataTree:
        """The outcome of each run, averaged over its `last` generations, as ArviZ has observations: see `exchange.inference`."""
        from baldwinlab.api.export.arviz import (
            outcomes,  # here, because to load SciPy's statistics takes a while
        )

        self._stored.require_runs()
        return outcomes(self.data(), last)

    def crate(self, *, authors: Sequence[str] = (), license: str = "", force: bool = False) -> Path:
        """Write an RO-Crate's metadata into the study's folder, who, what, how and with which versions; gives the file's path.

        Raises as `exchange.crate.write_crate` does, which says what may be given.
        """
        return write_crate(self._stored, authors, license, force=force)

    def __repr__(self) -> str:
        shown = [
            f"  {condition}: runs: {len(self.runs(condition))}"
            for condition in self.conditions[:SHOWN]
        ]
        more = len(self.conditions) - SHOWN
        if more > 0:
            shown.append(f"  and {more:,} more conditions")
        stored = [name for name in ASSAYS if (self.directory / "assays" / name).exists()]
        return "\n".join(
            [
                f"<Study {self.directory}, seed {self.seed}>",
                *shown,
                f"  assays: {', '.join(stored) or 'none'}",
            ]
        )

    def _repr_html_(self) -> str:
        """In a notebook: what it holds, and the curves of its first conditions."""
        from baldwinlab.api.study_html import (
            html,  # here, because to load the figures takes a while
        )

        return html(repr(self), self._stored, self.conditions[:SHOWN])


def open_study(directory: str | Path) -> Study:
    """The study in a directory, or at any location that fsspec reaches. Raises StudyError where there is none."""
    load_installed()
    return Study(store.StudyStore(location(directory)))
