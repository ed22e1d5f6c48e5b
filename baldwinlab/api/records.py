"""From a record to its experiment."""

from __future__ import annotations

import xarray as xr

from baldwinlab.api.load import load_installed
from baldwinlab.core.errors import RefusedError
from baldwinlab.core.suggestions import list_names
from baldwinlab.experiment import Experiment
from baldwinlab.experiment.toml import from_toml


def read_experiment(record: xr.Dataset, condition: str | None = None) -> Experiment:
    """The experiment that a record was made by: a run, a life, an assay, or one condition of a whole study's data.

    Raises RefusedError for a dataset that carries none, or several of which `condition` does not pick one.
    """
    load_installed()
    if "experiment" in record.attrs:
        return from_toml(record.attrs["experiment"], where="the record's experiment", lenient=True)
    if "experiment" not in record:
        raise RefusedError(
            "this dataset carries no experiment; it is no record of baldwinlab, or was computed from one"
        )
    texts = record["experiment"]
    if condition is not None and "condition" in texts.coords:
        texts = (
            texts.sel(condition=condition)
            if condition in texts.condition.values
            else texts.isel(condition=[])
        )
    if texts.size != 1:
        names = (
            [str(name) for name in record.condition.values.ravel()]
            if "condition" in record.coords
            else []
        )
        known = list_names(str(condition), names) if names else "select one point of it"
        raise RefusedError(
            f"condition = {condition!r} does not pick one experiment of this dataset; {known}"
        )
    return from_toml(str(texts.item()), where="the record's experiment", lenient=True)
