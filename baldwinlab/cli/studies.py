"""Studies: the paper's and one's own, what can be run, what came of it, and any moment of it again."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

from baldwinlab import console, presets
from baldwinlab.assays import ASSAYS
from baldwinlab.assays.command import live_again
from baldwinlab.cli.common import (
    Assignments,
    BackendName,
    Directory,
    Executor,
    Last,
    Out,
    Runs,
    Seed,
    Workers,
    app,
    bring,
    make_report,
    require_positive,
)
from baldwinlab.experiment import assign
from baldwinlab.experiment.toml import to_toml
from baldwinlab.files import write_atomically
from baldwinlab.movie import write_movie
from baldwinlab.runs.replay import replay as replay_life
from baldwinlab.studies.store import Study


@app.command
def reproduce(
    *,
    runs: Runs = 30,
    generations: Annotated[int | None, Parameter(help="generations of each run; 100 unless given")] = None,
    steps: Annotated[int | None, Parameter(help="steps of a life; 5000 unless given")] = None,
    seed: Seed = 0,
    reading: Annotated[str, Parameter(help="a named reading of the paper; see `baldwinlab presets`")] = "standard",
    workers: Workers = None,
    out: Out = None,
    last: Last = 10,
    backend: BackendName = "auto",
    executor: Executor = "threads",
) -> None:
    """Reproduce the whole paper: six conditions, statistics, assays, figures and report."""
    changes: dict[str, Any] = {}
    if generations is not None:
        changes["evolution"] = {"generations": generations}
    if steps is not None:
        changes["lifetime"] = {"steps": steps}
    experiments = [experiment.replace(**changes) for experiment in presets.paper(reading)]
    given = {"": reading if reading != "standard" else None, "generations": generations, "steps": steps, "seed": seed or None}
    name = "-".join(["paper", *(f"{key}{value}" for key, value in given.items() if value is not None)])
    require_positive("--last", last)
    factors = {experiment.name: presets.factors(experiment.name) for experiment in experiments}
    study = bring(experiments, runs, seed, workers, out or Path("results") / name, backend, executor, factors=factors)
    live_again(study, list(ASSAYS), None if executor != "threads" else workers)
    make_report(study, study.directory / "report.html", last)


@app.command
def run(
    experiment: Annotated[str, Parameter(help="a preset such as evo+self-taught/B, or a TOML file")],
    /,
    *others: Annotated[str, Parameter(help="more of them, to be compared in one study")],
    assignments: Assignments = None,
    runs: Runs = 30,
    seed: Seed = 0,
    workers: Workers = None,
    out: Out = None,
    backend: BackendName = "auto",
    executor: Executor = "threads",
) -> None:
    """Run an experiment, a preset or a TOML file; or several in one study, such as a condition and its controls."""
    given = (experiment, *others)
    experiments = [assign(presets.load(name), assignments or []) for name in given]
    factors = {resolved.name: presets.factors(name) for resolved, name in zip(experiments, given, strict=True)}
    directory = out or Path("results") / "-".join(resolved.name.replace("/", "-") for resolved in experiments)
    study = bring(experiments, runs, seed, workers, directory, backend, executor, factors=factors)
    console.say(f"for statistics, figures and a report: baldwinlab report {study.directory}")


@app.command(name="presets")
def list_presets() -> None:
    """List the presets: conditions, controls, maps and readings."""
    for kind in presets.KINDS:
        console.say(kind)
        for name in presets.names(kind):
            console.say(f"  {name:<22} {presets.describe(kind, name)}")
    console.say("an experiment is CONDITION/MAP, such as evo+self-taught/B; a reading is chosen by --reading")


@app.command
def show(experiment: str, /, *, assignments: Assignments = None) -> None:
    """Show an experiment as TOML, which can be edited and run."""
    sys.stdout.write(to_toml(assign(presets.load(experiment), assignments or [])))


@app.command
def report(
    directory: Directory,
    /,
    *,
    out: Annotated[Path | None, Parameter(help="the HTML file; DIR/report.html unless given")] = None,
    last: Last = 10,
) -> None:
    """Rebuild statistics, figures and report from stored results."""
    require_positive("--last", last)
    make_report(Study(directory), out or directory / "report.html", last)


@app.command
def replay(directory: Directory, /, *, condition: str, run: int, generation: int, out: Path) -> None:
    """Live one stored lifetime again and write it: .nc trace, .mp4, .gif or .png."""
    if out.suffix not in (".nc", ".mp4", ".gif", ".png"):
        raise ValueError(f"--out {out} must end in .nc, .mp4, .gif or .png")
    if not out.parent.is_dir():
        raise ValueError(f"--out {out}: there is no folder {out.parent}")
    study = Study(directory)
    experiment = study.experiment(condition)
    energy = study.read(condition, run).energy
    trace = replay_life(experiment, study.seed, generation, run, energy)
    if out.suffix == ".nc":
        write_atomically(out, bytes(trace.to_netcdf(engine="scipy")))
    elif out.suffix == ".png":
        from baldwinlab.figures import trajectories

        trajectories(trace).savefig(out, dpi=200)
    else:
        write_movie(trace, experiment.world.width, experiment.world.height, out)
    eaten = int(trace.eaten.sum())
    console.say(f"{out}: {experiment.lifetime.steps} steps of {experiment.population.size} agents, who ate {eaten} items")
