"""How frequent each allele is at each locus of the genomes of a stored or a live run, of models that have no world to watch."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import numpy.typing as npt
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from baldwinlab.evolution import Genome, Moment
from baldwinlab.experiment import BaseExperiment
from baldwinlab.lab import Lab, MissingError, binary_frames, studies
from baldwinlab.lab.concurrency import InTurn
from baldwinlab.lab.life_query import MOST_BYTES
from baldwinlab.lab.query import Query, number, text
from baldwinlab.simulation.reevaluation import stored_genomes
from baldwinlab.simulation.replay import genome_at


def routes(lab: Lab) -> list[BaseRoute]:
    async def alleles(request: Request) -> Response:
        asked = shares_of_live if "live" in request.query_params else shares_of
        return InTurn(
            lab,
            lambda: Response(
                asked(lab, request.query_params), media_type="application/octet-stream"
            ),
        )

    return [Route("/api/alleles", alleles)]


def shares_of(lab: Lab, query: Query) -> bytes:
    """The container of `shares` of a stored run; its header has the names of the alleles, and what the model says of itself.

    Raises StudyError and ValueError as a request for a recording does, MissingError also where the model declares no alleles.
    """
    study, name, run = (
        studies.find(lab, text(query, "study")),
        text(query, "condition"),
        number(query, "run"),
    )
    experiment = studies.condition(study, name)
    study.require_parts(name)
    _require_alleles(experiment, experiment.evolution.generations)
    studies.require_run(lab, study, name, run)

    def make() -> bytes:
        found = shares(experiment, stored_genomes(experiment, study.record(name, run)))
        return binary_frames.pack(_header(experiment, 0), {"share": found})

    return lab.answers.get(("alleles", experiment, study.seed, run), make)


def shares_of_live(lab: Lab, query: Query) -> bytes:
    """The container of `shares` of one generation of a live run. Raises as `LiveRun.history`, and as `shares_of`."""
    live, run, generation = (
        lab.live.run(query["live"]),
        number(query, "run"),
        number(query, "generation"),
    )
    experiment, history = live.experiment, live.history(run, generation)
    _require_alleles(experiment, 1)
    kept, genome = history.kept_until(generation)
    if kept != generation:
        genome = genome_at(
            experiment,
            Moment(live.seed, run, generation),
            live.energy(run, generation),
            (kept, genome),
        )
    return binary_frames.pack(
        _header(experiment, generation), {"share": shares(experiment, [genome])}
    )


def shares(experiment: BaseExperiment, genomes: Iterable[Genome]) -> npt.NDArray[np.float32]:
    """Of the agents born in a generation, the share that has an allele at a locus: [generation, locus, allele].

    The loci of several modules follow each other. An entry that is none of the alleles counts for none of them.
    """
    values = np.array(list(studies.alleles_of(experiment).values()), np.float32)
    by_locus = (genome.reshape(len(genome), -1, 1) for genome in genomes)
    return np.stack([(genome == values).mean(axis=0, dtype=np.float32) for genome in by_locus])


def _header(experiment: BaseExperiment, first: int) -> dict[str, Any]:
    """What is said of shares that begin with the generation `first`."""
    alleles = list(studies.alleles_of(experiment))
    return {
        "kind": "alleles",
        "alleles": alleles,
        "about": studies.about(experiment),
        "first": first,
    }


def _require_alleles(experiment: BaseExperiment, generations: int) -> None:
    """Raises MissingError where a model declares no alleles, and ValueError for more numbers than one answer may hold."""
    alleles = studies.alleles_of(experiment)
    if not alleles:
        raise MissingError(
            f"{experiment.name} is of the model {experiment.model}, which declares no alleles"
        )
    loci = len(experiment.modules) * experiment.genome_length
    if generations * loci * len(alleles) * np.dtype(np.float32).itemsize > MOST_BYTES:
        raise ValueError(
            f"{experiment.name} has {generations:,} generations of {loci:,} loci, more than one answer may hold"
        )
