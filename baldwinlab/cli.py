"""The command line. Only it knows both towers: the study that is run, and the report that is made of it."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from json import dumps
from pathlib import Path
from typing import Annotated, Any

from cyclopts import App, CycloptsError, Parameter

from baldwinlab import console, presets, store
from baldwinlab.bench import bench as benchmark
from baldwinlab.bench import machine
from baldwinlab.config import Experiment, ExperimentError, assign
from baldwinlab.engine.backend import choose
from baldwinlab.files import write_atomically
from baldwinlab.movie import MovieError, write_movie
from baldwinlab.publish import publish
from baldwinlab.replay import replay as replay_life
from baldwinlab.simulate import SEED_LIMIT
from baldwinlab.store import Study, StudyError
from baldwinlab.study import agent_steps_of_run, available_cores, missing_runs, run_study
from baldwinlab.toml import to_toml
from baldwinlab.version import __version__

app = App(
    name="baldwinlab",
    help="A laboratory for evolution x lifetime learning.",
    version=__version__,
    error_formatter=lambda error: f"baldwinlab: {_plain(error)}",
    error_console=console.errors,
    suppress_keyboard_interrupt=False,
)

Runs = Annotated[int, Parameter(help="independent runs of each condition")]
Seed = Annotated[int, Parameter(help="the seed that all randomness comes from")]
Workers = Annotated[int | None, Parameter(help="threads; all cores unless given")]
Out = Annotated[Path | None, Parameter(help="directory of the study")]
BackendName = Annotated[str, Parameter(name="--backend", help="cpu, cuda, or auto for the fastest there is")]
Last = Annotated[int, Parameter(help="a run counts with its average over so many last generations")]
Assignments = Annotated[list[str] | None, Parameter(name="--set", consume_multiple=True, help="change a field: path=value")]


def _plain(error: CycloptsError) -> str:
    return " ".join(str(error).split())


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
) -> None:
    """Reproduce the whole paper: six conditions, statistics, figures and report."""
    changes: dict[str, Any] = {}
    if generations is not None:
        changes["evolution"] = {"generations": generations}
    if steps is not None:
        changes["lifetime"] = {"steps": steps}
    experiments = [experiment.replace(**changes) for experiment in presets.paper(reading)]
    given = {"": reading if reading != "standard" else None, "generations": generations, "steps": steps, "seed": seed or None}
    name = "-".join(["paper", *(f"{key}{value}" for key, value in given.items() if value is not None)])
    _require_positive("--last", last)
    study = _run(experiments, runs, seed, workers, out or Path("results") / name, backend)
    _report(study, study.directory / "report.html", last)


@app.command
def run(
    experiment: Annotated[str, Parameter(help="a preset such as evo+self-taught/B, or a TOML file")],
    /,
    *,
    assignments: Assignments = None,
    runs: Runs = 30,
    seed: Seed = 0,
    workers: Workers = None,
    out: Out = None,
    backend: BackendName = "auto",
) -> None:
    """Run one experiment, a preset or a TOML file."""
    resolved = assign(presets.load(experiment), assignments or [])
    study = _run([resolved], runs, seed, workers, out or Path("results") / resolved.name.replace("/", "-"), backend)
    console.say(f"for statistics, figures and a report: baldwinlab report {study.directory}")


@app.command(name="presets")
def list_presets() -> None:
    """List the presets: conditions, maps and readings."""
    for kind in presets.KINDS:
        console.say(kind)
        for name in presets.names(kind):
            console.say(f"  {name:<20} {presets.describe(kind, name)}")
    console.say("an experiment is CONDITION/MAP, such as evo+self-taught/B; a reading is chosen by --reading")


@app.command
def show(experiment: str, /, *, assignments: Assignments = None) -> None:
    """Show an experiment as TOML, which can be edited and run."""
    sys.stdout.write(to_toml(assign(presets.load(experiment), assignments or [])))


@app.command
def report(
    directory: Path,
    /,
    *,
    out: Annotated[Path | None, Parameter(help="the HTML file; DIR/report.html unless given")] = None,
    last: Last = 10,
) -> None:
    """Rebuild statistics, figures and report from stored results."""
    _require_positive("--last", last)
    _report(Study(directory), out or directory / "report.html", last)


@app.command
def replay(directory: Path, /, *, condition: str, run: int, generation: int, out: Path) -> None:
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


@app.command
def bench(
    *,
    quick: Annotated[bool, Parameter(help="measure less of each case", negative="")] = False,
    backend: BackendName = "auto",
    json: Annotated[Path | None, Parameter(help="a file for the records, for other programs")] = None,
) -> None:
    """Measure this machine: agent-steps a second of a study, of each condition, and of large worlds."""
    if json and not json.parent.is_dir():
        raise ValueError(f"--json {json}: there is no folder {json.parent}")
    records = []
    console.say(f"{'case':<18} {'million agent-steps/s':>22} {'seconds':>9} {'compile s':>10} {'peak MiB':>9} {'threads':>8}")
    for record in benchmark(quick, backend):
        records.append(record._asdict())
        rate = record.agent_steps_per_second / 1e6
        numbers = (
            f"{rate:>22.1f} {record.seconds:>9.2f} {record.compile_seconds:>10.2f} {record.peak_mib:>9.0f} {record.threads:>8}"
        )
        console.say(f"{record.case:<18} {numbers}")
    if json:
        write_atomically(json, (dumps({"machine": machine(), "records": records}, indent=2) + "\n").encode())
        console.say(f"records: {json}")


def _run(
    experiments: Sequence[Experiment], runs: int, seed: int, workers: int | None, directory: Path, backend_name: str
) -> Study:
    """Bring a study to the given number of runs, showing how far it is."""
    workers = available_cores() if workers is None else workers
    _require_positive("--runs", runs)
    _require_positive("--workers", workers)
    if not 0 <= seed < SEED_LIMIT:
        raise ValueError(f"--seed {seed} must be at least 0 and less than {SEED_LIMIT}")
    backend = choose(backend_name, runs * len(experiments), max(experiment.population.size for experiment in experiments))
    if backend.name == "cuda":
        workers = max(workers, len(experiments), 2)  # one block lives while the children of another are bred
    study = store.create(directory, experiments, seed)
    missing = missing_runs(study, runs, console.complain)
    total = sum(agent_steps_of_run(study.experiments[condition]) * len(numbers) for condition, numbers in missing.items())
    wanted = runs * len(experiments)
    if not total:
        console.say(f"{directory}: runs: {wanted}, all of them stored already")
        return study
    stored = wanted - sum(map(len, missing.values()))
    console.say(f"{directory}: runs: {wanted}, stored already: {stored}, agent-steps to do: {total:,}")
    try:
        run_study(study, missing, workers, console.progress, console.say, backend)
    except KeyboardInterrupt:
        raise InterruptedStudyError(f"stopped; {_standing(study, runs)}", code=130) from None
    except OSError as error:
        raise InterruptedStudyError(
            f"cannot write {error.filename or directory}: {error.strerror}; {_standing(study, runs)}", code=1
        ) from None
    return study


def _require_positive(name: str, value: int) -> None:
    if value < 1:
        raise ValueError(f"{name} {value} must be at least 1")


def _standing(study: Study, runs: int) -> str:
    stored = sum(len(set(study.runs(condition)) & set(range(runs))) for condition in study.experiments)
    return f"runs stored in {study.directory}: {stored}; the same command carries on from there"


def _report(study: Study, out: Path, last: int) -> None:
    results = publish(study, out, last, console.say)
    if any(result.record()["verdict"] in console.VERDICT_STYLE for result in results):
        console.console.print(console.claims_table(results))
    console.say(f"report: {out}")


class InterruptedStudyError(Exception):
    """A study that did not come to its end."""

    def __init__(self, message: str, code: int) -> None:
        super().__init__(message)
        self.code = code


def main() -> None:
    """Run the command line; every fault is one clear sentence and a non-zero exit."""
    try:
        app(sys.argv[1:])
    except (ExperimentError, StudyError, MovieError, ValueError) as error:
        console.complain(str(error))
        sys.exit(2)
    except InterruptedStudyError as error:
        console.complain(str(error))
        sys.exit(error.code)
    except KeyboardInterrupt:
        console.complain("stopped")
        sys.exit(130)
    except OSError as error:
        console.complain(f"{error.filename or ''}: {error.strerror}" if error.strerror else str(error))
        sys.exit(1)
