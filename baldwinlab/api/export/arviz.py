"""Convert the outcomes of runs to observations for ArviZ, for a Bayesian comparison."""

from __future__ import annotations

from baldwinlab._version import __version__
from baldwinlab.analysis.statistics import fitness
from baldwinlab.core.deferred import xr


def collect_outcomes(data: xr.Dataset, last: int) -> xr.DataTree:
    """Return the outcome of each run as observed data. Claims are evaluated on these outcomes.

    The group `observed_data` has `best` and `mean`, the fitness of the best and of the average
    agent in the unit of `energy`, and `share`, the share of agents that eat (0 to 1), by condition
    and run. Missing runs are NaN.
    """
    unit = data["energy"].attrs.get("units", "")
    attributes_by_outcome = {
        "best": {"units": unit, "long_name": "fitness of the best agent"},
        "mean": {"units": unit, "long_name": "fitness of the average agent"},
        "share": {"units": "1", "long_name": "share of agents that eat, or have a fitness above 0"},
    }
    observed = xr.Dataset(
        {
            name: fitness.final(data, name, last)
            .drop_attrs(deep=False)
            .assign_attrs(attributes_by_outcome[name])
            for name in attributes_by_outcome
        }
    )
    origin = {
        "creation_library": "baldwinlab",
        "creation_library_version": __version__,
        "last_generations": last,
    }
    return xr.DataTree.from_dict({"observed_data": observed.assign_attrs(data.attrs | origin)})
