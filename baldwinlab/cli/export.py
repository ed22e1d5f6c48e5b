"""A laboratory to give away."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from baldwinlab import console
from baldwinlab.cli.common import Assignments, Force, Parts, PerhapsWhole, load_parts
from baldwinlab.experiment import Experiment, assign
from baldwinlab.experiment.idle import require_effect
from baldwinlab.files import write_atomically
from baldwinlab.outputs import EXPORT, is_study, require_writable
from baldwinlab.presets import load
from baldwinlab.studies.store import Study


def export(
    source: Annotated[str, Parameter(help="a preset such as evo+self-taught/B, a TOML file, or the directory of a study")],
    /,
    *,
    out: Annotated[Path, Parameter(help="the HTML file")],
    part: Parts = None,
    assignments: Assignments = None,
    seed: Annotated[PerhapsWhole, Parameter(help="that the page begins with; a study's own, else 0")] = None,
    force: Force = False,
) -> None:
    """Write a live laboratory: one HTML file in which evolution runs in the reader's own browser, to the same bits."""
    from baldwinlab.lab.export import live_page  # here, because to load the engine takes a while
    from baldwinlab.models.miniworld.modules import is_ready

    require_writable("--out", out, EXPORT.encode(), force=force)
    load_parts(part)
    experiments, own_seed = _given(source, assignments or [])
    if any(not is_ready(each) for each in experiments if isinstance(each, Experiment)):
        console.say("compiling for browsers, which takes about a minute …")
    page = live_page(experiments, own_seed if seed is None else seed)
    write_atomically(out, page)
    names = ", ".join(experiment.name for experiment in experiments)
    console.say(f"{out}: {names}; {len(page):,} bytes that need no server")


def _given(source: str, assignments: list[str]) -> tuple[list[Experiment], int]:
    """The experiments that are meant, and their seed: those of a study, or one."""
    if is_study(Path(source)):
        study = Study(Path(source))
        return [assign(study.experiment(name), assignments) for name in study.experiments], study.seed
    experiment = assign(load(source), assignments)
    require_effect([experiment])
    return [experiment], 0
