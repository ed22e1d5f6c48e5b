"""Papers: which there are, what can be run by name, and a whole one reproduced."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

from baldwinlab import console, presets
from baldwinlab import papers as room
from baldwinlab.assays import ASSAYS
from baldwinlab.cli.assays import live_again
from baldwinlab.cli.common import BackendName, Executor, Last, Out, Seed, Workers, app, bring, make_report, require_positive


@app.command
def papers() -> None:
    """List the papers that can be reproduced."""
    for paper in room.built_in().values():
        console.say(f"{paper.name:<12} {paper.about.source}")
        console.say(f"{'':<12} {paper.about.description}")
        console.say(f"{'':<12} conditions: {len(paper.experiments())}, claims: {len(paper.claims)}, {paper.about.link}")
    console.say("baldwinlab reproduce PAPER runs one; a folder of your own with a paper.toml is one, too")


@app.command
def reproduce(
    paper: Annotated[str, Parameter(help="a paper, see `baldwinlab papers`, or the folder of your own")] = room.DEFAULT,
    /,
    *,
    runs: Annotated[int | None, Parameter(help="independent runs of each condition; the paper's own number unless given")] = None,
    generations: Annotated[int | None, Parameter(help="generations of each run; the paper's own unless given")] = None,
    steps: Annotated[int | None, Parameter(help="steps of a life; the paper's own unless given")] = None,
    seed: Seed = 0,
    reading: Annotated[str, Parameter(help="a named reading of the paper; see `baldwinlab presets`")] = "standard",
    workers: Workers = None,
    out: Out = None,
    last: Last = 10,
    backend: BackendName = "auto",
    executor: Executor = "threads",
) -> None:
    """Reproduce a whole paper: its conditions, statistics, assays, figures and report."""
    chosen = room.load(paper)
    changes: dict[str, Any] = {}
    if generations is not None:
        changes["evolution"] = {"generations": generations}
    if steps is not None:
        changes["lifetime"] = {"steps": steps}
    experiments = [experiment.replace(**changes) for experiment in chosen.experiments(reading)]
    given = {"": reading if reading != "standard" else None, "generations": generations, "steps": steps, "seed": seed or None}
    first = "paper" if chosen.name == room.DEFAULT else chosen.name
    name = "-".join([first, *(f"{key}{value}" for key, value in given.items() if value is not None)])
    require_positive("--last", last)
    directory = out or Path("results") / name
    study = bring(experiments, chosen.about.runs if runs is None else runs, seed, workers, directory, backend, executor, chosen)
    live_again(study, list(ASSAYS), None if executor != "threads" else workers)
    make_report(study, study.directory / "report.html", last)


@app.command(name="presets")
def list_presets() -> None:
    """List the presets: conditions, controls, maps and readings."""
    for kind in presets.KINDS:
        console.say(kind)
        for name in presets.names(kind):
            console.say(f"  {name:<22} {presets.describe(kind, name)}")
    console.say("an experiment is CONDITION/MAP, such as evo+self-taught/B; a reading is chosen by --reading")
