"""The class `Study` and the function `open_study`: read, compare, replay and export a study."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Unpack

from baldwinlab import papers
from baldwinlab.api.export.formats import select_format, study_formats, write_export
from baldwinlab.api.load import load_installed_parts
from baldwinlab.api.run_options import (
    AssayArguments,
    AssayOptions,
    RunArguments,
    RunOptions,
    list_options,
)
from baldwinlab.api.run_study import extend, require_branch_length, run_missing_assays
from baldwinlab.api.study_runs import StudyRuns
from baldwinlab.core.deferred import xr
from baldwinlab.core.errors import BaldwinLabError
from baldwinlab.core.files import is_local, parse_location
from baldwinlab.core.numbers import check_numbers, format_count
from baldwinlab.studies.assays.catalog import load_assays, not_applicable_reasons
from baldwinlab.studies.assays.results import (
    find_missing_assays,
    is_stored,
    open_assay,
    open_assays,
)
from baldwinlab.studies.open import open_sample
from baldwinlab.studies.records import StudyError
from baldwinlab.studies.store import StudyStore

if TYPE_CHECKING:
    import pandas as pd

MAX_LISTED_CONDITIONS: Final = 10
"""Maximum number of conditions in the text of a study. A sweep may have thousands."""
CAPTION: Final = (
    "Fitness of the best and of the average agent, by generation: means over runs, with their 95 % "
    "intervals"
)


class Study(StudyRuns):
    """A study on disk.

    `run`, `sweep` and `reproduce` create a study, and `open_study` opens one. A method that takes a
    condition raises StudyError for a name that is not in `conditions`.
    """

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
        from baldwinlab.api.report import report

        return report(
            self._store,
            None if out is None else Path(out),
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
        return _render_study(repr(self), self._store, self.conditions[:MAX_LISTED_CONDITIONS])


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


def _render_study(text: str, study: StudyStore, conditions: Sequence[str]) -> str:
    """Return the text and the curves of conditions as HTML, or the reason for missing curves."""
    try:
        curves = _draw_curves(study, [name for name in conditions if study.runs(name)])
    except BaldwinLabError as error:
        curves = f"<p>{escape(str(error))}</p>"
    return f"<div><pre>{escape(text)}</pre>{curves}</div>"


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
