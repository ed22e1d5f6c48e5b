"""How frequent each allele is at each locus of a stored run's genomes, for models that have no world to watch."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import xarray as xr
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from baldwinlab.experiment import BaseExperiment
from baldwinlab.lab import Lab, MissingError, frames, studies
from baldwinlab.lab.lives import MOST_BYTES
from baldwinlab.lab.query import Query, number, text
from baldwinlab.lab.turns import InTurn
from baldwinlab.runs.reevaluate import stored_genomes


def routes(lab: Lab) -> list[BaseRoute]:
    async def alleles(request: Request) -> Response:
        return InTurn(lab, lambda: Response(shares_of(lab, request.query_params), media_type="application/octet-stream"))

    return [Route("/api/alleles", alleles)]


def shares_of(lab: Lab, query: Query) -> bytes:
    """The container of `shares` of a stored run; its header has the names of the alleles, and what the model says of itself.

    Raises StudyError and ValueError as a request for a recording does, MissingError also where the model declares no alleles.
    """
    study, name, run = studies.find(lab, text(query, "study")), text(query, "condition"), number(query, "run")
    experiment = studies.condition(study, name)
    study.require_parts(name)
    _require_alleles(experiment)
    studies.require_run(lab, study, name, run)

    def make() -> bytes:
        header = {"kind": "alleles", "alleles": list(studies.alleles_of(experiment)), "about": studies.about(experiment)}
        return frames.pack(header, {"share": shares(experiment, study.record(name, run))})

    return lab.answers.get(("alleles", experiment, study.seed, run), make)


def shares(experiment: BaseExperiment, record: xr.Dataset) -> npt.NDArray[np.float32]:
    """Of the agents born in a generation, the share that has an allele at a locus: [generation, locus, allele].

    The loci of several modules follow each other. An entry that is none of the alleles counts for none of them.
    """
    values = np.array(list(studies.alleles_of(experiment).values()), np.float32)
    genomes = (genome.reshape(len(genome), -1, 1) for genome in stored_genomes(experiment, record))
    return np.stack([(genome == values).mean(axis=0, dtype=np.float32) for genome in genomes])


def _require_alleles(experiment: BaseExperiment) -> None:
    """Raises MissingError where a model declares no alleles, and ValueError for more numbers than one answer may hold."""
    alleles = studies.alleles_of(experiment)
    if not alleles:
        raise MissingError(f"{experiment.name} is of the model {experiment.model}, which declares no alleles")
    generations, loci = experiment.evolution.generations, len(experiment.modules) * experiment.genome_length
    if generations * loci * len(alleles) * np.dtype(np.float32).itemsize > MOST_BYTES:
        raise ValueError(f"{experiment.name} has {generations:,} generations of {loci:,} loci, more than one answer may hold")
