"""The class `Study` and the function `open_study`: read, compare, replay and export a study."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Unpack

from baldwinlab import papers
from baldwinlab._version import __version__
from baldwinlab.api.agents import AgentNetwork, make_network, read_genomes, select_condition
from baldwinlab.api.export.formats import select_format, study_formats, write_export
from baldwinlab.api.export.table import StudyTable
from baldwinlab.api.load import load_installed_parts
from baldwinlab.api.run_options import (
    AssayArguments,
    AssayOptions,
    RunArguments,
    RunOptions,
    list_options,
)
from baldwinlab.api.run_study import extend, require_branch_length, run_missing_assays
from baldwinlab.core import console
from baldwinlab.core.deferred import xr
from baldwinlab.core.errors import BaldwinLabError
from baldwinlab.core.files import is_local, parse_location
from baldwinlab.core.numbers import check_numbers, format_count
from baldwinlab.experiment import Experiment
from baldwinlab.experiment.conditions import SWEEP
from baldwinlab.simulation.reevaluation import restore_genomes
from baldwinlab.simulation.replay import (
    replay,
    replay_genomes,
    require_generation,
    require_simulated,
)
from baldwinlab.studies.assays.catalog import load_assays, not_applicable_reasons
from baldwinlab.studies.assays.results import (
    find_missing_assays,
    is_stored,
    open_assay,
    open_assays,
)
from baldwinlab.studies.open import open_runs, open_sample
from baldwinlab.studies.records import StudyError
from baldwinlab.studies.status import format_incomplete_sentence
from baldwinlab.studies.store import StudyStore
from baldwinlab.studies.sweeps.design import open_sweep

if TYPE_CHECKING:
    import pandas as pd

MAX_LISTED_CONDITIONS: Final = 10
"""Maximum number of conditions in the text of a study. A sweep may have thousands."""
CAPTION: Final = (
    "Fitness of the best and of the average agent, by generation: means over runs, with their 95 % "
    "intervals"
)


class Study:
    """A study on disk.

    `run`, `sweep` and `reproduce` create a study, and `open_study` opens one. A method that takes a
    condition raises StudyError for a name that is not in `conditions`.

    Parameters
    ----------
    store : StudyStore
        The directory of the study.
    """

    def __init__(self, store: StudyStore) -> None:
        self._store = store

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
        condition : str
            Name of a condition.

        Returns
        -------
        Experiment
            The settings of the condition.

        Raises
        ------
        StudyError
            The study has no such condition.

        Examples
        --------
        >>> import baldwinlab as bl
        >>> study = bl.open_study("mine")  # see the example of `run`
        >>> study.experiment("evo/A").lifetime.steps
        50
        """
        return self._store.experiment(condition)

    def runs(self, condition: str) -> list[int]:
        """Return the indices of the stored runs of a condition.

        Parameters
        ----------
        condition : str
            Name of a condition.

        Returns
        -------
        list of int
            Indices in ascending order, for example [0, 1, 2].

        Raises
        ------
        StudyError
            The study has no such condition.

        Examples
        --------
        >>> import baldwinlab as bl
        >>> study = bl.open_study("mine")  # see the example of `run`
        >>> study.runs("evo/A")
        [0, 1, 2, 3, 4]
        """
        # Raises StudyError for an unknown condition.
        self.experiment(condition)
        return self._store.runs(condition)

    def data(self, conditions: Sequence[str] | None = None) -> xr.Dataset:
        """Return the stored runs as one dataset.

        Parameters
        ----------
        conditions : sequence of str or None
            Names of conditions. By default all conditions.

        Returns
        -------
        xarray.Dataset
            The variables of `baldwinlab.core.variables.RUN_VARIABLES`, with the dimensions
            `condition`, `run`, `generation` and `agent`. All files are verified. Values are read
            when they are used, as with `xarray.open_dataset`. `data.load()` reads all values.
            Missing values are NaN: conditions can differ in the number of runs, generations or
            agents, and a run that stopped has no later generations. If runs can stop, the
            coordinate `n_generations` (condition, run) is the number of simulated generations. The
            variable `experiment` (condition) has the settings as TOML. `learner`, `map` and
            `variant` are coordinates of `condition` if a condition has them. Write `data["map"]`:
            `data.map` is a method of xarray. The attributes of a variable are `units` and
            `long_name`. The attributes of the dataset are the `seed` of the study and the
            `outcome`, the name of the fitness, for example "items eaten".

            If `conditions` is None, a sweep has no dimension `condition`. A grid has one dimension
            per swept setting. Another design has the dimension `point` with the settings as
            coordinates. The attributes are `design`, `fields` (the swept settings, separated by
            commas), `base` (the swept experiment), `set` (the settings that differ from `base` in
            all points) and `seed`.

        Raises
        ------
        StudyError
            The study has no such condition.
        DamagedRecordError
            A stored run is damaged.

        Examples
        --------
        >>> import baldwinlab as bl
        >>> study = bl.open_study("mine")  # see the example of `run`
        >>> dict(study.data().energy.sizes)
        {'condition': 2, 'run': 5, 'generation': 2, 'agent': 20}
        """
        console.warn_if_any(format_incomplete_sentence(self._store))
        if conditions is None and self._store.kind == SWEEP:
            data = open_sweep(self.directory)
            # An attribute of a netCDF file cannot be a list of texts.
            texts = {name: ", ".join(data.attrs[name]) for name in ("fields", "set")}
            return data.assign_attrs(texts)
        return open_runs(self.directory, conditions)

    @check_numbers
    def replay(
        self,
        condition: str | None = None,
        *,
        run: int,
        generation: int,
        world: int = 0,
        force: bool = False,
    ) -> xr.Dataset:
        """Simulate one generation of a stored run again, and record every step of its agents.

        Parameters
        ----------
        condition : str or None
            Name of a condition. A study with one condition does not need it.
        run : int
            Index of a stored run, from 0.
        generation : int
            Index of a generation, from 0.
        world : int
            Index of a world of the population, from 0. The agents of this world are recorded.
        force : bool
            Run even if less memory is free than the estimate.

        Returns
        -------
        xarray.Dataset
            The variables of `baldwinlab.core.variables.trace_variables`, with the dimensions `step`
            and `agent`.

        Raises
        ------
        StudyError
            There is no such condition or run, or `condition` is missing.
        PartError
            A custom part of the study is not loaded.
        RefusedError
            There is no such generation, the model has no world, or too little memory is free.

        Examples
        --------
        >>> import baldwinlab as bl
        >>> study = bl.open_study("mine")  # see the example of `run`
        >>> trace = study.replay("evo/A", run=0, generation=1)
        >>> trace.sizes["step"], trace.sizes["agent"]
        (50, 20)
        """
        condition = select_condition(self._store, condition)
        experiment = self.experiment(condition)
        self._store.require_parts(condition)
        if isinstance(experiment, Experiment) and experiment.population.species:
            require_generation(experiment, generation)
            record = self._store.record(condition, run)
            # With species, `replay` simulates all earlier generations. Stored genomes are faster.
            return replay_genomes(
                experiment,
                restore_genomes(experiment, record, generation),
                seed=self.seed,
                run=run,
                generation=generation,
                world=world,
                species=record["species"].values[generation],
                force=force,
            )
        energy = self._store.read(condition, run, genomes=False).energy
        require_simulated(experiment, run, generation, energy.sizes["generation"])
        return replay(
            experiment,
            seed=self.seed,
            run=run,
            generation=generation,
            energy=energy,
            world=world,
            force=force,
        )

    @check_numbers
    def genomes(
        self,
        run: int,
        generation: int,
        agent: int | Sequence[int] | None = None,
        *,
        condition: str | None = None,
    ) -> xr.DataArray:
        """Return the genomes of one generation of a stored run.

        Genomes that are not stored are computed again from the previous stored generation.

        Parameters
        ----------
        run, generation : int
            Index of a stored run, and index of a generation, from 0.
        agent : int, sequence of int or None
            Index of an agent, or several indices, from 0. By default all agents.
        condition : str or None
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

        Examples
        --------
        >>> import baldwinlab as bl
        >>> study = bl.open_study("mine")  # see the example of `run`
        >>> genome = study.genomes(run=0, generation=1, agent=3, condition="evo+self-taught/A")
        >>> dict(genome.sizes)
        {'module': 2, 'weight': 60}
        """
        name = select_condition(self._store, condition)
        return read_genomes(self._store, name, run, generation, agent)

    @check_numbers
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
        run, generation, agent : int
            Index of a stored run, of a generation, and of an agent, each from 0.
        condition : str or None
            Name of a condition. A study with one condition does not need it.
        module : str
            "action", or "reinforcement" if the agents have a reinforcement network.

        Returns
        -------
        AgentNetwork
            A call with inputs, an array [input] or [step, input], returns the outputs.

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

        Examples
        --------
        >>> import baldwinlab as bl
        >>> study = bl.open_study("mine")  # see the example of `run`
        >>> network = study.network(run=0, generation=1, agent=3, condition="evo/A")
        >>> network.inputs, network([[0, 1, 0]]).sizes["action"]
        (('left', 'front', 'right'), 3)
        """
        name = select_condition(self._store, condition)
        return make_network(self._store, name, run, generation, agent, module=module)

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

        Examples
        --------
        >>> import baldwinlab as bl
        >>> study = bl.open_study("mine")  # see the example of `run`
        >>> table = study.to_pandas()
        >>> len(table), table.attrs["units"]["food_eaten"]
        (400, 'items')
        """
        return StudyTable(self._store).to_pandas()

    @check_numbers
    def to_arviz(self, *, last: int = 10) -> xr.DataTree:
        """Return the outcome of each run as observations for ArviZ, for a Bayesian comparison.

        Claims are evaluated on these outcomes.

        Parameters
        ----------
        last : int
            Number of final generations that are averaged in each run, at least 1.

        Returns
        -------
        xarray.DataTree
            The group `observed_data` has `best` and `mean`, the fitness of the best and of the
            average agent, and `share`, the fraction of agents that eat (0 to 1). Each has the
            dimensions `condition` and `run`. Missing runs are NaN.

        Raises
        ------
        StudyError
            No run is stored, or a record is damaged.
        ArgumentError
            `last` is less than 1.

        Examples
        --------
        >>> import baldwinlab as bl
        >>> study = bl.open_study("mine")  # see the example of `run`
        >>> study.to_arviz(last=1)["observed_data"]["mean"].sizes["run"]
        5
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

    def __reduce__(self) -> Any:
        # A process with another working directory must open the same directory.
        directory = self.directory
        location = str(directory.absolute()) if is_local(directory) else str(directory)
        return open_study, (location,)

    @check_numbers
    @list_options(RunOptions)
    def extend(
        self,
        generations: int | None = None,
        *,
        runs: int | None = None,
        **options: Unpack[RunArguments],
    ) -> None:
        """Run the study further, with more generations, more runs, or both.

        The stored generations do not change. The result is bit-identical to that of one long run.

        Parameters
        ----------
        generations : int or None
            Number of generations of all conditions. By default the stored number.
        runs : int or None
            Number of runs of each condition. By default the largest stored number.
        **options
            Fields of `RunOptions`.

        Raises
        ------
        StudyError
            The study has more generations, or it is a sweep or a multiverse.
        ArgumentError
            A number is out of range.
        RefusedError
            Less memory or disk is free than the estimate.
        InterruptedStudyError
            A worker or a disk failed. A repeated call continues.

        Examples
        --------
        >>> import baldwinlab as bl
        >>> short = {"evolution.generations": 2, "lifetime.steps": 50}
        >>> study = bl.run("evo/A", runs=1, out="longer", set=short)
        >>> study.extend(generations=3)
        >>> study.data().sizes["generation"]
        3
        """
        self._store = extend(self._store, RunOptions(**options), generations=generations, runs=runs)

    @check_numbers
    @list_options(AssayOptions)
    def assay(
        self,
        name: str,
        condition: str | None = None,
        *,
        generations: int | None = None,
        **options: Unpack[AssayArguments],
    ) -> xr.Dataset:
        """Return the results of an assay. Run the assay first for conditions without results.

        Parameters
        ----------
        name : str
            Name of an assay, for example "innate"; `baldwinlab assay --help` lists all.
        condition : str or None
            Name of a condition. By default all conditions.
        generations : int or None
            Number of generations of the branches of "fork" or "fork-mode", at least 1. By default
            the stored number, or 20.
        **options
            Fields of `AssayOptions`.

        Returns
        -------
        xarray.Dataset
            The variables of the assay. `attrs` of a variable has the unit and meaning. Without
            `condition` it has the dimension `condition`, with the conditions to which the assay
            applies.

        Raises
        ------
        StudyError
            There is no such assay or condition, or the assay applies to none of the conditions.
        ArgumentError
            `generations` is less than 1, or is given for another assay.
        RefusedError
            Too little memory or disk is free.
        InterruptedStudyError
            A worker or a disk failed. A repeated call continues.

        Examples
        --------
        >>> import baldwinlab as bl
        >>> study = bl.open_study("mine")  # see the example of `run`
        >>> innate = study.assay("innate", "evo/A")
        >>> innate.sizes["run"]
        5
        """
        assay_options = AssayOptions(**options)
        require_branch_length(generations, [name])
        if any(find_missing_assays(self._store, [name], generations).values()):
            run_missing_assays(self._store, [name], assay_options, generations)
        if condition is not None:
            return open_assay(self.directory, name, condition)
        conditions = [
            candidate for candidate in self.conditions if is_stored(name, self._store, candidate)
        ]
        if not conditions:
            reasons = not_applicable_reasons(self._store, [name])
            reason = "; ".join(reasons) or f"{name} does not apply to any condition"
            raise StudyError(f"{self._store.location}: {reason}")
        return open_assays(self._store, name, conditions)

    @check_numbers
    def compare(self, baseline: str | None = None, *, last: int = 10) -> pd.DataFrame:
        """Compare the conditions of the study, as its report does.

        Parameters
        ----------
        baseline : str or None
            Condition with which all other conditions are compared. By default a condition is
            compared with the first condition in its world, and the only condition of a world is
            not compared. Conditions in different worlds are compared only with a baseline.
        last : int
            Number of final generations that are averaged in each run, at least 1.

        Returns
        -------
        pandas.DataFrame
            One row per condition and measure. The measure "mean" is the fitness of the average
            agent, and "best" is the fitness of the best agent.

            - `condition_a`, `condition_b`: the condition, and its baseline.
            - `map_a`, `map_b`: the maps of both, if the study has maps.
            - `n_a`, `n_b`: the numbers of runs.
            - `median_a`, `median_b`: medians over runs, in the unit of fitness (energy, for
              foragers).
            - `effect`: median of `condition_a` minus median of `condition_b`, in the same unit;
              `low`, `high`: 95 % bootstrap interval of `effect`.
            - `u`, `p`: statistic and two-sided p-value of the Mann-Whitney test.
            - `p_holm`: p-value corrected for all rows by Holm's method.
            - `a12`: probability that a run of `condition_a` exceeds one of `condition_b`, 0 to 1.
            - `smallest_p_holm`: smallest corrected p-value that the numbers of runs allow (Tarone).
            - `verdict`: "higher" or "lower" if `p_holm` is below 0.05; "too few runs" if
              `smallest_p_holm` is not below 0.05; else "undecided".

            `attrs["pairing"]` states which conditions are compared. `attrs["too_few"]` states the
            required number of runs, or is "" if the runs suffice.

        Raises
        ------
        StudyError
            No run is stored, `baseline` has no stored run, or the study has no such condition.
        ArgumentError
            `last` is less than 1.

        References
        ----------
        - Bootstrap: Efron and Tibshirani, An Introduction to the Bootstrap, 1993.
        - Test: Mann and Whitney, Annals of Mathematical Statistics 18, 1947.
        - Correction: Holm, Scandinavian Journal of Statistics 6, 1979.
        - A12: Vargha and Delaney, Journal of Educational and Behavioral Statistics 25, 2000.
        - Smallest p-value: Tarone, Biometrics 46, 1990.

        Examples
        --------
        >>> import baldwinlab as bl
        >>> study = bl.open_study("mine")  # see the example of `run`
        >>> table = study.compare()
        >>> table[["condition_a", "condition_b", "measure", "verdict"]].iloc[0].to_list()
        ['evo+self-taught/A', 'evo/A', 'mean', 'undecided']
        """
        # Imported late: pandas and SciPy's statistics take a while to load.
        import pandas as pd

        from baldwinlab.analysis.results.contrasts import COMPARISON_COLUMNS
        from baldwinlab.api.publish.comparisons import compare_study
        from baldwinlab.experiment.conditions import add_maps

        contrasts = compare_study(self._store, last, baseline or "")
        rows = [
            {**contrast.row(), "smallest_p_holm": contrast.test.smallest_p_holm}
            for contrast in contrasts.rows
        ]
        columns, rows = add_maps([*COMPARISON_COLUMNS, "smallest_p_holm"], rows, contrasts.factors)
        table = pd.DataFrame(rows, columns=columns)
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
        out : str, pathlib.Path or None
            HTML file. By default report.html in the directory of the study.
        last : int
            Number of final generations that are averaged in each run, at least 1.
        baseline : str or None
            Condition with which all other conditions are compared; see `compare`.
        paper : str, pathlib.Path or None
            Name or folder of the paper whose claims are evaluated. By default the paper that
            defines the study.
        force : bool
            Write even if less memory is free than the estimate, and overwrite an HTML file that is
            not a report.

        Returns
        -------
        pathlib.Path
            The path of the HTML file.

        Raises
        ------
        StudyError
            No run is stored, `baseline` has no stored run, or the study has no such condition.
        PaperError
            There is no such paper.
        ArgumentError
            `last` is less than 1.
        RefusedError
            Too little memory is free; `out` is a file of another program; `baseline` is given for a
            multiverse; or `paper` is given for a sweep or a multiverse.

        Examples
        --------
        >>> import baldwinlab as bl
        >>> study = bl.open_study("mine")  # see the example of `run`
        >>> study.report().name
        'report.html'
        """
        # Imported late: loading the figures takes a while.
        from baldwinlab.api.publish.unwritten_files import warn_of_unwritten_files
        from baldwinlab.api.report import report

        page = None if out is None else Path(out)
        with warn_of_unwritten_files(self.directory, page):
            return report(
                self._store,
                page,
                last=last,
                force=force,
                baseline=baseline or "",
                paper=None if paper is None else papers.load(paper),
            )

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
        the results of all runs. Only a part of these results is in memory at a time.

        Parameters
        ----------
        path : str, pathlib.Path or None
            The file to write. The format "ro-crate" needs no path.
        format : str or None
            Name of a format. By default, the suffix of `path` selects it.
        force : bool
            Overwrite a file that this method did not write. For Zarr, write even if less memory is
            free than the estimate.
        **options : object
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

        Examples
        --------
        >>> import baldwinlab as bl
        >>> study = bl.open_study("mine")  # see the example of `run`
        >>> study.export("mine.csv")
        >>> with open("mine.csv") as file:
        ...     print(file.readline()[:40])
        condition,learner,map,run,generation,age
        """
        location = None if path is None else Path(path)
        formats = study_formats()
        selected = select_format(formats, format, location)
        write_export(formats, selected, self._store, location, options, force=force)

    def __repr__(self) -> str:
        """Return the directory, the seed, the conditions with their runs, and the stored assays."""
        lines = [
            f"  {condition}: {format_count(len(self.runs(condition)), 'run')}"
            for condition in self.conditions[:MAX_LISTED_CONDITIONS]
        ]
        n_unlisted = len(self.conditions) - MAX_LISTED_CONDITIONS
        if n_unlisted > 0:
            lines.append(f"  and {n_unlisted:,} more conditions")
        assays = [name for name in load_assays() if (self.directory / "assays" / name).exists()]
        return "\n".join(
            [
                f"<Study {self._store.location}, seed {self.seed}>",
                *lines,
                f"  assays: {', '.join(assays) or 'none'}",
            ]
        )

    def _repr_html_(self) -> str:
        """Return the text of the study and the curves of its first conditions, for notebooks."""
        conditions = self.conditions[:MAX_LISTED_CONDITIONS]
        try:
            curves = _draw_curves(self._store, [name for name in conditions if self.runs(name)])
        except BaldwinLabError as error:
            curves = f"<p>{escape(str(error))}</p>"
        return f"<div><pre>{escape(repr(self))}</pre>{curves}</div>"


def open_study(directory: str | Path) -> Study:
    """Open a stored study.

    Parameters
    ----------
    directory : str or pathlib.Path
        The directory of a study, or a URL that fsspec can open.

    Returns
    -------
    Study
        The study.

    Raises
    ------
    StudyError
        There is no study, or its files are damaged.

    Examples
    --------
    >>> import baldwinlab as bl
    >>> bl.open_study("mine").conditions  # see the example of `run`
    ('evo/A', 'evo+self-taught/A')
    """
    load_installed_parts()
    return Study(StudyStore(parse_location(directory)))


def _draw_curves(study: StudyStore, conditions: Sequence[str]) -> str:
    """Return the curves as an image element of HTML, or "" if there are no conditions."""
    if not conditions:
        return ""
    # Imported late: loading the figures takes a while.
    from baldwinlab.analysis.figures.style import to_svg
    from baldwinlab.analysis.report.figures.fitness import draw_fitness_curves

    figure = draw_fitness_curves(open_sample(study, conditions))
    image = b64encode(to_svg(figure)).decode()
    return (
        f'<img alt="{CAPTION}" title="{CAPTION}" style="max-width: 100%" '
        f'src="data:image/svg+xml;base64,{image}">'
    )
