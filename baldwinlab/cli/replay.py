"""Any moment of a study again."""

from __future__ import annotations

from pathlib import Path

from baldwinlab import console
from baldwinlab.api import study as studies
from baldwinlab.cli.common import Directory, Parts, load_parts, require_folder_of
from baldwinlab.errors import RefusedError
from baldwinlab.files import write_atomically


def replay(directory: Directory, /, *, condition: str, run: int, generation: int, out: Path, part: Parts = None) -> None:
    """Live one stored lifetime again and write it: .nc trace, .mp4, .gif or .png."""
    if out.suffix not in (".nc", ".mp4", ".gif", ".png"):
        raise RefusedError(f"--out {out} must end in .nc, .mp4, .gif or .png")
    require_folder_of("--out", out)
    load_parts(part)
    study = studies.open(directory)
    trace = study.replay(condition, run=run, generation=generation)
    experiment = study.experiment(condition)
    if out.suffix == ".nc":
        write_atomically(out, bytes(trace.to_netcdf(engine="scipy")))
    elif out.suffix == ".png":
        from baldwinlab.figures import trajectories  # here, and the movie too, because to load them takes a while

        trajectories(trace).savefig(out, dpi=200)
    else:
        from baldwinlab.movie import write_movie

        write_movie(trace, experiment.world.width, experiment.world.height, out)
    eaten = int(trace.eaten.sum())
    console.say(f"{out}: {experiment.lifetime.steps} steps of {experiment.population.size} agents, who ate {eaten} items")
