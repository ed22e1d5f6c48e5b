"""The command `replay`: simulate a lifetime of stored or frozen genomes and write it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Final

from cyclopts import Parameter

from baldwinlab.api.agents import select_condition
from baldwinlab.api.freezer import read_frozen
from baldwinlab.api.replay import replay_frozen
from baldwinlab.api.study import Study
from baldwinlab.cli.options import LOCATION, Assignments, Directory, Force, Parts, load_parts
from baldwinlab.core import console
from baldwinlab.core.deferred import xr
from baldwinlab.core.errors import RefusedError
from baldwinlab.core.file_writing import write_atomically
from baldwinlab.core.files import REPLAY_MARK, require_writable
from baldwinlab.core.numbers import format_count
from baldwinlab.core.resources import Need, require_resources
from baldwinlab.core.variables import trace_variables
from baldwinlab.experiment import Experiment
from baldwinlab.simulation.memory import dimension_sizes, estimate_replay, require_storable
from baldwinlab.simulation.replay import require_world
from baldwinlab.studies.store import StudyStore

ENDINGS: Final = (".nc", ".mp4", ".gif", ".png")


StudyOrExperiment = Annotated[
    Directory,
    Parameter(
        help=f"{LOCATION} With --genome: a preset or an experiment file, by default the experiment "
        "of the genome file."
    ),
]
Condition = Annotated[
    str | None,
    Parameter(help="Condition of the run. Default: the only condition of the study."),
]
GenomeFile = Annotated[
    Path | None,
    Parameter(
        help="Genome file (.nc, .npy) whose agents are simulated. By default the agents are those "
        "of the study."
    ),
]
Run = Annotated[
    int | None,
    Parameter(
        help="Number of a stored run, from 0. It is required for a study, and for a genome file of "
        "several runs. Default of other genome files: the run of the genomes."
    ),
]
Generation = Annotated[
    int | None,
    Parameter(
        help="Number of a generation, from 0. It is required for a study. Default of a genome "
        "file: the generation of the genomes."
    ),
]
Seed = Annotated[
    int | None,
    Parameter(help="With --genome: seed of the lifetime. Default: the seed of the genomes."),
]
World = Annotated[
    int, Parameter(help="Number of a world of the population (`population.worlds`), from 0.")
]
Map = Annotated[
    str | None,
    Parameter(help="With --genome: name of a map. Default: the map of the experiment."),
]
TraceOut = Annotated[
    Path,
    Parameter(help="File to write: a movie (.mp4, .gif), a picture (.png) or a trace (.nc)."),
]


def replay(
    directory: StudyOrExperiment = None,
    /,
    *,
    condition: Condition = None,
    genome: GenomeFile = None,
    run: Run = None,
    generation: Generation = None,
    seed: Seed = None,
    world: World = 0,
    map: Map = None,
    assignments: Assignments = None,
    out: TraceOut,
    part: Parts = None,
    force: Force = False,
) -> None:
    """Simulate one lifetime again, and write it as a movie, a picture or a trace.

    The agents are those of a stored study or of a genome file. A trace is a netCDF file with the
    state of every agent in every step.

    For example:

        baldwinlab replay results/evo-A --run 0 --generation 99 --out life.gif
        baldwinlab replay --genome agent.nc --map B --out life.gif
    """
    require_writable("--out", out, REPLAY_MARK.encode(), force=force, suffixes=ENDINGS)
    load_parts(part)
    if genome is None:
        _require_study_options(directory, run, generation, (seed, map, assignments))
        assert run is not None
        assert generation is not None
        life = {"run": run, "generation": generation, "world": world}
        trace, experiment = _replay_stored(StudyStore(directory), condition, life, out, force)
    else:
        if condition is not None:
            raise RefusedError(f"--condition {condition} applies to a study, not to --genome")
        experiment_name = None if directory is None else str(directory)
        frozen = read_frozen(genome, experiment_name, map, assignments or [])
        experiment = require_world(frozen.experiment)
        _require_disk_space(experiment, out, force)
        trace = replay_frozen(
            frozen, seed=seed, run=run, generation=generation, world=world, force=force
        )
    _write_trace(trace, experiment, out)
    console.info(
        f"{out}: {experiment.lifetime.steps} steps, "
        f"{format_count(trace.sizes['agent'], 'agent')}, "
        f"{int(trace.eaten.sum())} {trace.eaten.attrs['units']} eaten"
    )


def _require_study_options(
    directory: Any, run: int | None, generation: int | None, genome_options: tuple[Any, ...]
) -> None:
    """Raise RefusedError for missing options of a study, and for options of a genome file."""
    if directory is None:
        raise RefusedError("give the directory of a study, or a genome file with --genome FILE")
    if run is None or generation is None:
        raise RefusedError(f"{directory}: add --run RUN and --generation GENERATION")
    if any(option is not None for option in genome_options):
        raise RefusedError("--seed, --map and --set apply to --genome FILE, not to a study")


def _replay_stored(
    store: StudyStore, condition: str | None, life: dict[str, int], out: Path, force: bool
) -> tuple[xr.Dataset, Experiment]:
    """Return the trace and the experiment of a stored lifetime. `life`: run, generation, world."""
    condition = select_condition(store, condition)
    experiment = store.experiment(condition)
    # For a model without a world, `replay` below raises the error.
    if isinstance(experiment, Experiment):
        _require_disk_space(experiment, out, force)
    return Study(store).replay(condition, **life, force=force), experiment


def _require_disk_space(experiment: Experiment, out: Path, force: bool) -> None:
    """Raise RefusedError if a trace is too large for its format or for the disk."""
    # Only traces are large, not movies and pictures.
    if out.suffix == ".nc":
        require_storable(
            trace_variables(experiment), dimension_sizes(experiment), f"a life of {experiment.name}"
        )
        need = Need(disk=estimate_replay(experiment).disk)
        require_resources(f"--out {out}", need, out.parent, force=force)


def _write_trace(trace: xr.Dataset, experiment: Experiment, out: Path) -> None:
    """Write a trace in the format that the ending of `out` names."""
    if out.suffix == ".nc":
        marked_trace = trace.assign_attrs(made_by=REPLAY_MARK)
        write_atomically(out, bytes(marked_trace.to_netcdf(engine="scipy")))
    elif out.suffix == ".png":
        # Imported late, as is the movie: loading the figures takes a while.
        from baldwinlab.analysis.figures.style import to_png
        from baldwinlab.analysis.figures.world import draw_trajectories

        write_atomically(out, to_png(draw_trajectories(trace), REPLAY_MARK))
    else:
        from baldwinlab.analysis.movie import Scene, write_scenes

        write_scenes([Scene(trace, experiment.world.width, experiment.world.height)], out)
