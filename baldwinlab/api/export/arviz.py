"""The outcome of a study's runs as ArviZ has observations, to begin a Bayesian comparison with."""

from __future__ import annotations

import xarray as xr

from baldwinlab._version import __version__
from baldwinlab.analysis.statistics import fitness
from baldwinlab.core.errors import require_positive


def outcomes(data: xr.Dataset, last: int) -> xr.DataTree:
    """A tree with the group `observed_data`: `best`, `mean` and `share` of each condition and run.

    They are what claims are decided by: fitness of the best and of the average agent, in the unit of `energy`, and the share of
    agents that ate (0 to 1), each averaged over the run's `last` generations. `data` is what `open_runs` gives. Missing runs are
    NaN. Raises ArgumentError unless `last` is at least 1.
    """
    require_positive("last", last)
    unit = data["energy"].attrs.get("units", "")
    told = {
        "best": {"units": unit, "long_name": "fitness of the best agent"},
        "mean": {"units": unit, "long_name": "fitness of the average agent"},
        "share": {"units": "1", "long_name": "share of agents that ate, or gained anything"},
    }
    found = xr.Dataset(
        {
            name: fitness.final(data, name, last).drop_attrs(deep=False).assign_attrs(told[name])
            for name in told
        }
    )
    attributes = {
        "creation_library": "baldwinlab",
        "creation_library_version": __version__,
        "last_generations": last,
    }
    return xr.DataTree.from_dict({"observed_data": found.assign_attrs(data.attrs | attributes)})
