"""Any moment of a study again."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from baldwinlab.api import study as studies
from baldwinlab.api.agents import only_condition
from baldwinlab.cli.options import Directory, Force, Parts, Whole, load_parts
from baldwinlab.core import console
from baldwinlab.core.errors import RefusedError
from baldwinlab.core.files import write_atomically
from baldwinlab.core.output_paths import REPLAY, require_writable
from baldwinlab.core.resources import Need, require
from baldwinlab.core.variables import TRACE
from baldwinlab.experiment import Experiment
from baldwinlab.simulation.memory import of_replay, require_storable, sizes
from baldwinlab.studies import store


def replay(
    directory: Directory,
    /,
    *,
    condition: Annotated[
        str | None, Parameter(help="a condition of the study; the only one unless given")
    ] = None,
    run: Annotated[Whole, Parameter(help="the number of a stored run, from 0")],
    generation: Annotated[Whole, Parameter(help="the number of a generation, from 0")],
    out: Annotated[
        Path,
        Parameter(help="the file to write: a trace (.nc), a film (.mp4, .gif) or a picture (.png)"),
    ],
    part: Parts = None,
    force: Force = False,
) -> None:
    """Live one stored lifetime again and write it: .nc trace, .mp4, .gif or .png."""
    if out.suffix not in (".nc", ".mp4", ".gif", ".png"):
        raise RefusedError(f"--out {out} must end in .nc, .mp4, .gif or .png")
    require_writable("--out", out, REPLAY.encode(), force=force)
    load_parts(part)
    stored = store.StudyStore(directory)
    condition = only_condition(stored, condition)
    study, experiment = studies.Study(stored), stored.experiment(condition)
    if out.suffix == ".nc" and isinstance(experiment, Experiment):
        require_storable(TRACE, sizes(experiment), f"a life of {condition}")
        require(f"--out {out}", Need(disk=of_replay(experiment).disk), out.parent, force=force)
    trace = study.replay(condition, run=run, generation=generation, force=force)
    if out.suffix == ".nc":
        write_atomically(out, bytes(trace.assign_attrs(made_by=REPLAY).to_netcdf(engine="scipy")))
    elif out.suffix == ".png":
        from baldwinlab.analysis.figures import draw_trajectories

        picture = BytesIO()
        draw_trajectories(trace).savefig(
            picture, format="png", dpi=200, metadata={"Software": REPLAY}
        )
        write_atomically(out, picture.getvalue())
    else:
        from baldwinlab.analysis.figures.movie import write_movie

        write_movie(trace, experiment.world.width, experiment.world.height, out)
    eaten = int(trace.eaten.sum())
    console.info(
        f"{out}: {experiment.lifetime.steps} steps of {experiment.population.size} agents, who ate {eaten} items"
    )
