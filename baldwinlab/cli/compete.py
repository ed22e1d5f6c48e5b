"""The command `compete`: simulate the agents of two genome files in one population."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from baldwinlab.api.compete import run_competition
from baldwinlab.cli.options import (
    HIDE_DEFAULT,
    Assignments,
    Integer,
    Json,
    Parts,
    Seed,
    load_parts,
)
from baldwinlab.core import console


def compete(
    a: Annotated[Path, Parameter(help="Genome file (.nc, .npy) of the first competitor.")],
    b: Annotated[Path, Parameter(help="Genome file (.nc, .npy) of the second competitor.")],
    /,
    *,
    experiment: Annotated[
        str | None,
        HIDE_DEFAULT,
        Parameter(help="A preset or an experiment file. Default: the experiment of A."),
    ] = None,
    map: Annotated[
        str | None,
        HIDE_DEFAULT,
        Parameter(help="Name of a map. Default: the map of the experiment."),
    ] = None,
    assignments: Assignments = None,
    lives: Annotated[
        Integer,
        Parameter(
            help="Number of lives. Each is also simulated with the birthplaces of A and B swapped."
        ),
    ] = 100,
    seed: Seed = 0,
    part: Parts = None,
    json: Json = False,
) -> None:
    """Compare the agents of two genome files in one population. Each has half of it.

    The command prints the mean energy of each competitor, and their difference with its 95 %
    interval over lives.

    For example:

        baldwinlab compete learners.nc ancestors.nc --map B --lives 50
    """
    load_parts(part)
    if json:
        console.reserve_stdout()
    result = run_competition(
        a,
        b,
        experiment=experiment,
        map_name=map,
        assignments=assignments or [],
        lives=lives,
        seed=seed,
    )
    if json:
        console.print_json(result._asdict() | {"lives": result.lives.tolist()})
        return
    console.info(f"A, {a}: mean energy {result.energy_a:.4g}")
    console.info(f"B, {b}: mean energy {result.energy_b:.4g}")
    console.info(
        f"A minus B: {result.difference:.4g}, 95 % interval {result.low:.4g} to {result.high:.4g}, "
        f"{lives:,} lives"
    )
