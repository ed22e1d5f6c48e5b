"""Stored runs of conditions as one dataset, for `open.py`. Values are read when they are used."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from xarray.core import indexing

from baldwinlab.core.deferred import pd, xr
from baldwinlab.core.variables import PARENT_NAMES, RUN_VARIABLES
from baldwinlab.experiment import Experiment
from baldwinlab.studies.record_files import assign_runs
from baldwinlab.studies.recorded_arrays import (
    GENERATION,
    NO_INDEX,
    FileContent,
    FileLayout,
    RecordedArray,
    RunIndex,
    make_layout,
    open_file,
)
from baldwinlab.studies.store import StudyStore


class StoredCondition(NamedTuple):
    """The stored runs of a condition, without the values of the variables.

    The arrays [run] are sorted by run. A condition without stored runs has one layout, but no
    contents.
    """

    runs: npt.NDArray[np.int32]  # Run numbers, for example [0, 1, 2].
    n_generations: npt.NDArray[np.int32]  # Number of stored generations of each run.
    files: npt.NDArray[np.intp]  # Index in `contents` of the file of each run.
    rows: npt.NDArray[np.intp]  # Index of each run in this file.
    contents: list[FileContent]
    layouts: list[FileLayout]  # The different layouts of the files.
    size: int  # Number of generations of the longest run.

    @property
    def attributes(self) -> dict[Hashable, dict[Any, Any]]:
        """Attributes of each variable of the first file: {"energy": {"units": "energy"}}."""
        return {name: variable.attrs for name, variable in self.layouts[0].variables.items()}

    @property
    def labels(self) -> xr.Dataset:
        """The labels of all dimensions of the runs, as a dataset without variables."""
        # The labels can differ between files, so the dataset has the union of the labels.
        datasets = [xr.Dataset(coords=layout.labels) for layout in self.layouts]
        combined = datasets[0] if len(datasets) == 1 else xr.align(*datasets, join="outer")[0]
        generations = np.arange(self.size, dtype=np.int32)
        return combined.assign_coords(run=self.runs, generation=generations)


def open_condition(
    study: StudyStore,
    name: str,
    selected_runs: Sequence[int] | None = None,
    report_file: Callable[[int], object] = lambda n_files: None,
) -> StoredCondition:
    """Verify the files of a condition, and return the stored runs without values.

    `selected_runs`: by default all stored runs. `report_file`: called with 1 after each file.
    """
    # `open_file` adds the new layouts.
    layouts: dict[Hashable, FileLayout] = {}
    contents: list[FileContent] = []
    # A file is skipped if other files are valid for all runs in this file.
    entries = [entry for entry in assign_runs(study.files(name)) if entry.runs]
    for entry in entries:
        contents.append(open_file(entry.file, study.experiment(name), study.seed, layouts))
        report_file(1)
    if not contents:
        empty = make_empty_dataset(study.experiments[name])
        size = empty.sizes["generation"]
        layout = make_layout(empty.isel(run=slice(0)).drop_vars("run"))
        none = np.empty(0, np.intp)
        counts = np.empty(0, np.int32)
        return StoredCondition(counts, counts, none, none, [], [layout], size)
    runs = np.concatenate([entry.runs for entry in entries])
    files = np.repeat(np.arange(len(entries)), [len(entry.runs) for entry in entries])
    rows = runs - np.array([entry.file.first for entry in entries])[files]
    lengths = [
        content.lengths.n_generations[np.array(entry.runs) - entry.file.first]
        for entry, content in zip(entries, contents, strict=True)
    ]
    n_generations = np.concatenate(lengths)
    # If files overlap, `runs` is not sorted.
    order = np.argsort(runs)
    if selected_runs is not None:
        order = order[np.isin(runs[order], selected_runs)]
    return StoredCondition(
        runs=runs[order].astype(np.int32),
        n_generations=n_generations[order],
        files=files[order],
        rows=rows[order],
        contents=contents,
        layouts=list(layouts.values()),
        size=int(n_generations[order].max()),
    )


def combine_conditions(conditions: Sequence[StoredCondition]) -> xr.Dataset:
    """Return a dataset [condition, run, ...] of all runs. Values are read when they are used."""
    label_sets = [condition.labels for condition in conditions]
    labels = xr.align(*label_sets, join="outer")[0]
    runs = [_index_runs(condition, labels.indexes["run"]) for condition in conditions]
    # The order is reversed, so that the first variable of each name replaces the later ones.
    variables = {
        name: variable
        for condition in reversed(conditions)
        for layout in reversed(condition.layouts)
        for name, variable in layout.variables.items()
    }
    # The names in the order of their first occurrence.
    names = dict.fromkeys(
        name
        for condition in conditions
        for layout in condition.layouts
        for name in layout.variables
    )
    # `xarray.open_dataset` uses the same three wrappers. xarray declares no types for them.
    wrap: Any = indexing
    data = {}
    for name in names:
        dims = [dim for dim in variables[name].dims if dim != "run"]
        array = RecordedArray(
            name,
            dims,
            {dim: labels[dim].values for dim in dims},
            _choose_type(name, dims, conditions, labels),
            runs,
        )
        lazy = wrap.MemoryCachedArray(wrap.CopyOnWriteArray(wrap.LazilyIndexedArray(array)))
        data[name] = xr.Variable(("condition", "run", *dims), lazy)
    return xr.Dataset(data, coords=labels.coords)


def _index_runs(condition: StoredCondition, runs: pd.Index) -> RunIndex:
    """Return the file and the row of each of the `runs`, -1 for a run that is not stored."""
    positions = runs.get_indexer(condition.runs)
    files = np.full(len(runs), NO_INDEX, np.intp)
    rows = np.full(len(runs), NO_INDEX, np.intp)
    files[positions] = condition.files
    rows[positions] = condition.rows
    return RunIndex(condition.contents, files, rows)


def _choose_type(
    name: Hashable,
    dims: Sequence[Hashable],
    conditions: Sequence[StoredCondition],
    labels: xr.Dataset,
) -> np.dtype[Any]:
    """Return the common type of a variable, or a type that can hold NaN if a value is missing."""
    sizes = {dim: labels.sizes[dim] for dim in ("run", *dims)}
    types = []
    is_missing = False
    for condition in conditions:
        layouts = [layout for layout in condition.layouts if name in layout.variables]
        types += [layout.variables[name].dtype for layout in layouts]
        # `initial` is the result for a condition without runs.
        shortest = condition.n_generations.min(initial=condition.size)
        # A file can lack the variable. The condition can lack runs, generations or other labels.
        is_missing |= (
            len(layouts) < len(condition.layouts)
            or len(condition.runs) < sizes["run"]
            or (GENERATION in dims and shortest < sizes[GENERATION])
            or any(
                len(layout.labels[dim]) < sizes[dim]
                for layout in layouts
                for dim in dims
                if dim != GENERATION
            )
        )
    common = np.result_type(*types)
    return _type_with_nan(common) if is_missing else common


def _type_with_nan(dtype: np.dtype[Any]) -> np.dtype[Any]:
    """Return the type to which xarray converts values if some are missing: float32 for int16."""
    if dtype.kind in "iu":
        has_short_integers = dtype.itemsize <= np.dtype(np.int16).itemsize
        return np.dtype(np.float32 if has_short_integers else np.float64)
    return np.dtype(object) if dtype.kind == "b" else dtype


def make_empty_dataset(experiment: Experiment) -> xr.Dataset:
    """Return an empty dataset for a condition without stored runs."""
    sizes = {
        "run": 0,
        "generation": experiment.evolution.generations,
        "agent": experiment.population.size,
        "parent": len(PARENT_NAMES),
    }
    # Models other than MiniWorld have no food.
    names = (
        ("food_eaten", "energy", "parents")
        if isinstance(experiment, Experiment)
        else ("energy", "parents")
    )
    arrays = {}
    for name in names:
        dims = ("run", *RUN_VARIABLES[name].dims)
        shape = [sizes[dim] for dim in dims]
        arrays[name] = (dims, np.empty(shape, RUN_VARIABLES[name].dtype))
    coordinates: dict[str, Any] = {
        dim: np.arange(size, dtype=np.int32) for dim, size in sizes.items()
    }
    coordinates["parent"] = list(PARENT_NAMES)
    return xr.Dataset(arrays, coordinates)
