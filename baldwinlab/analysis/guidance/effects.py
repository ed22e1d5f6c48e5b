"""Effects of the study what-guides: innate fitness of an arm minus that of the control.

All arms evolve through the same number of common generations without learning before innate fitness
is measured. A difference is thus due to the history of the genomes.
"""

from __future__ import annotations

from typing import Final

import xarray as xr

CONTROL: Final = "control"
EQUAL_EVALUATIONS: Final = "equal-evaluations"
LEARNING: Final = "learning"


def name_costly(arm: str) -> str:
    """Return the name of an arm with a cost of learning.

    >>> name_costly("learning")
    'costly-learning'
    """
    return f"costly-{arm}"


COSTLY_LEARNING: Final = name_costly(LEARNING)


def compute_effects(cells: xr.Dataset, *, is_relative: bool) -> xr.DataArray:
    """Return the effects of all arms but the control (cell, run, arm, start, horizon).

    `is_relative`: divide by the higher mean innate fitness of arm and control over the runs. The
    effect is NaN if both are 0.
    """
    innate = cells["innate"]
    control = innate.sel(arm=CONTROL, drop=True)
    arms = innate.drop_sel(arm=CONTROL)
    effects = arms - control
    if is_relative:
        scale = arms.mean("run").clip(min=control.mean("run"))
        effects = effects / scale.where(scale > 0)
    return effects.transpose(*innate.dims)
