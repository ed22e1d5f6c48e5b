"""The stored runs of a study: data, tables, replays, genomes and networks."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from baldwinlab._version import __version__
from baldwinlab.api.agents import AgentNetwork, make_network, read_genomes, select_condition
from baldwinlab.api.export.table import StudyTable
from baldwinlab.core import console
from baldwinlab.core.deferred import xr
from baldwinlab.core.numbers import check_numbers
from baldwinlab.experiment import Experiment
from baldwinlab.experiment.conditions import SWEEP
from baldwinlab.simulation.reevaluation import restore_genomes
from baldwinlab.simulation.replay import (
    replay,
    replay_genomes,
    require_generation,
    require_simulated,
)
from baldwinlab.studies.open import open_runs
from baldwinlab.studies.status import format_incomplete_sentence
from baldwinlab.studies.store import StudyStore
from baldwinlab.studies.sweeps.design import open_sweep

if TYPE_CHECKING:
    import pandas as pd


class StudyRuns:
    """The stored runs of a study.

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
