"""The command `replay`: simulate a stored lifetime again and write it."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path
from typing import Annotated, Final

import xarray as xr
from cyclopts import Parameter

from baldwinlab.api.agents import only_condition
from baldwinlab.api.study import Study
from baldwinlab.cli.options import (
    FLAG,
    OVERWRITE_FORCE,
    RESOURCE_FORCE,
    Directory,
    Integer,
    Parts,
    load_parts,
)
from baldwinlab.core import console
from baldwinlab.core.errors import RefusedError
from baldwinlab.core.file_writing import write_atomically
from baldwinlab.core.output_paths import REPLAY, require_writable
from baldwinlab.core.resources import Need, require
from baldwinlab.core.variables import TRACE
from baldwinlab.experiment import Experiment
from baldwinlab.simulation.memory import dimension_sizes, estimate_replay, require_storable
from baldwinlab.studies.store import StudyStore

ENDINGS: Final = (".nc", ".mp4", ".gif", ".png")


def replay(
    directory: Directory,
    /,
    *,
    condition: Annotated[
        str | None,
        Parameter(help="Condition of the run. Default: the only condition of the study."),
    ] = None,
    run: Annotated[Integer, Parameter(help="Number of a stored run, from 0.")],
    generation: Annotated[Integer, Parameter(help="Number of a generation, from 0.")],
    out: Annotated[
        Path,
        Parameter(help="File to write: a movie (.mp4, .gif), a picture (.png) or a trace (.nc)."),
    ],
    part: Parts = None,
    force: Annotated[bool, FLAG, Parameter(help=f"{RESOURCE_FORCE} {OVERWRITE_FORCE}")] = False,
) -> None:
    """Simulate one stored lifetime again, and write it as a movie, a picture or a trace.

    A trace is a netCDF file with the state of every agent in every step.

    For example:

        baldwinlab replay results/evo-A --run 0 --generation 99 --out life.gif
    """
    if out.suffix not in ENDINGS:
        raise RefusedError(f"--out {out} must end in .nc, .mp4, .gif or .png")
    require_writable("--out", out, REPLAY.encode(), force=force)
    load_parts(part)
    store = StudyStore(directory)
    condition = only_condition(store, condition)
    experiment = store.experiment(condition)
    if out.suffix == ".nc" and isinstance(experiment, Experiment):
        require_storable(TRACE, dimension_sizes(experiment), f"a life of {condition}")
        require(
            f"--out {out}", Need(disk=estimate_replay(experiment).disk), out.parent, force=force
        )
    trace = Study(store).replay(condition, run=run, generation=generation, force=force)
    _write_trace(trace, experiment, out)
    console.info(
        f"{out}: {experiment.lifetime.steps} steps, {experiment.population.size} agents, "
        f"{int(trace.eaten.sum())} items eaten"
    )


def _write_trace(trace: xr.Dataset, experiment: Experiment, out: Path) -> None:
    """Write a trace in the format that the ending of `out` names."""
    if out.suffix == ".nc":
        write_atomically(out, bytes(trace.assign_attrs(made_by=REPLAY).to_netcdf(engine="scipy")))
    elif out.suffix == ".png":
        # Imported late, as is the movie: loading the figures takes a while.
        from baldwinlab.analysis.figures import draw_trajectories

        picture = BytesIO()
        draw_trajectories(trace).savefig(
            picture, format="png", dpi=200, metadata={"Software": REPLAY}
        )
        write_atomically(out, picture.getvalue())
    else:
        from baldwinlab.analysis.movie import write_movie

        write_movie(trace, experiment.world.width, experiment.world.height, out)
