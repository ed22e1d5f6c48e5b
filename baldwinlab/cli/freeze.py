"""The command `freeze`: write an agent or a population as a genome file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from baldwinlab.api.freezer import freeze as write_genome_file
from baldwinlab.cli.options import OVERWRITE_FORCE, Json, Parts, load_parts
from baldwinlab.core import console
from baldwinlab.core.numbers import format_count


def freeze(
    reference: Annotated[
        str,
        Parameter(
            help="STUDY:CONDITION@GENERATION, with [RUN] at the end for the population of one run. "
            "Numbers start from 0."
        ),
    ],
    /,
    *,
    agent: Annotated[
        int | None,
        Parameter(help="Number of an agent, from 0. Default: all agents."),
    ] = None,
    out: Annotated[Path, Parameter(help="Genome file to write (.nc).")],
    part: Parts = None,
    force: Annotated[bool, Parameter(help=OVERWRITE_FORCE)] = False,
    json: Json = False,
) -> None:
    """Write the genomes of an agent or of a population to one small file.

    The file has the genomes at birth, the experiment and the origin. The file can be the founders
    of a study (run --founders) and can be replayed (replay --genome).

    For example:

        baldwinlab freeze results/evo-A:evo/A@99[0] --out population.nc
        baldwinlab freeze results/evo-A:evo/A@99[0] --agent 3 --out agent.nc
    """
    load_parts(part)
    frozen = write_genome_file(reference, agent, out=out, force=force)
    if json:
        console.print_json(frozen._asdict() | {"path": str(frozen.path)})
        return
    agents = format_count(frozen.n_agents, "agent")
    runs = format_count(frozen.n_runs, "run")
    console.info(f"{frozen.path}: {agents} of {runs}")
