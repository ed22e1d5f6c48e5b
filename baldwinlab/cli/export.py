"""A laboratory to give away, and a study for other people's tools."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from baldwinlab.cli.options import Assignments, Force, Parts, PerhapsWhole, load_parts
from baldwinlab.core import console
from baldwinlab.core.errors import RefusedError
from baldwinlab.core.files import location, write_atomically
from baldwinlab.core.output_paths import EXPORT, is_study, require_writable
from baldwinlab.experiment import Experiment, assign
from baldwinlab.experiment.unused_settings import require_effect
from baldwinlab.papers.presets import Loaded, load_with_origin
from baldwinlab.studies.store import StudyStore


def export(
    source: Annotated[
        str,
        Parameter(
            help="a preset such as evo+self-taught/B, a TOML file, or the directory of a study"
        ),
    ],
    /,
    *,
    out: Annotated[Path, Parameter(help="ends in .html, or of a study in .zarr, .parquet or .csv")],
    part: Parts = None,
    assignments: Assignments = None,
    seed: Annotated[
        PerhapsWhole, Parameter(help="that the page begins with; a study's own, else 0")
    ] = None,
    force: Force = False,
) -> None:
    """Write a live laboratory as one HTML file, or the results of a study as Parquet, CSV or Zarr."""
    if out.suffix != ".html":
        if part or assignments or seed is not None:
            raise RefusedError(
                f"--part, --set and --seed are for pages, which end in .html, and not for {out}"
            )
        _write_results(location(source), out, force=force)
        return
    from baldwinlab.engine.wasm import find_linker
    from baldwinlab.lab.export import live_page  # here, because to load the engine takes a while
    from baldwinlab.models.miniworld.backends.wasm_modules import is_ready

    require_writable("--out", out, EXPORT.encode(), force=force)
    load_parts(part)
    experiments, own_seed = _given(source, assignments or [])
    if any(not is_ready(each) for each in experiments if isinstance(each, Experiment)):
        find_linker()
        console.info("compiling for browsers, which takes about a minute …")
    page = live_page(experiments, own_seed if seed is None else seed)
    write_atomically(out, page)
    names = ", ".join(experiment.name for experiment in experiments)
    console.info(f"{out}: {names}; {len(page):,} bytes that need no server")


def _write_results(directory: Path, out: Path, *, force: bool) -> None:
    """As the ending says. Raises RefusedError for another, and StudyError where there is no study."""
    if out.suffix not in (".zarr", ".parquet", ".csv"):
        raise RefusedError(
            f"--out {out} must end in .html for a page, or in .zarr, .parquet or .csv for the results of a study"
        )
    from baldwinlab.api.study import Study as Whole  # here, because to load it takes a while

    study = Whole(StudyStore(directory))
    if out.suffix == ".zarr":
        study.to_zarr(out, force=force)
    elif out.suffix == ".parquet":
        study.to_parquet(out, force=force)
    else:
        study.to_csv(out, force=force)
    console.info(
        f"{out}: runs: {sum(len(study.runs(condition)) for condition in study.conditions):,}"
    )


def _given(source: str, assignments: list[str]) -> tuple[list[Experiment], int]:
    """The experiments that are meant, and their seed: those of a study, or one."""
    study = StudyStore(Path(source)) if is_study(Path(source)) else None
    if study:
        loaded = [
            Loaded(study.experiment(name), study.experiment(name)) for name in study.experiments
        ]
    else:
        loaded = [load_with_origin(source)]
    experiments = [assign(each.experiment, assignments) for each in loaded]
    require_effect(experiments, [each.origin for each in loaded])
    return experiments, study.seed if study else 0
