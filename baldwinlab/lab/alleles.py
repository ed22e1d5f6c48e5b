"""The frequency of each allele at each locus, for models that declare alleles."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import numpy.typing as npt
from starlette.routing import BaseRoute, Route

from baldwinlab.evolution import GenerationKey, Genome
from baldwinlab.experiment import BaseExperiment
from baldwinlab.lab import Lab, MissingError, binary_frames, model_displays
from baldwinlab.lab.concurrency import CONTAINER, queue_content
from baldwinlab.lab.life_query import MAX_RESPONSE_BYTES
from baldwinlab.lab.query import Query, read_number
from baldwinlab.lab.study_access import find_run
from baldwinlab.simulation.reevaluation import iterate_genomes
from baldwinlab.simulation.replay import recompute_genomes


def make_routes(lab: Lab) -> list[BaseRoute]:
    """Return the routes of this module."""

    def pack(query: Query) -> bytes:
        is_live = "live" in query
        return (pack_live_frequencies if is_live else pack_stored_frequencies)(lab, query)

    return [Route("/api/alleles", queue_content(lab, pack, CONTAINER))]


def pack_stored_frequencies(lab: Lab, query: Query) -> bytes:
    """Return the container with the allele frequencies of all generations of a stored run.

    Its header contains the names of the alleles and the description of the model.

    Raise StudyError and ValueError as `find_life`, and MissingError if the model declares no
    alleles.
    """
    study, experiment, run = find_run(lab, query)
    study.require_parts(experiment.name)
    _require_alleles(experiment, experiment.evolution.generations)

    def make() -> bytes:
        genomes = iterate_genomes(experiment, study.record(experiment.name, run))
        frequencies = compute_allele_frequencies(experiment, genomes)
        return binary_frames.pack(
            _make_header(experiment, first_generation=0), {"share": frequencies}
        )

    return lab.cache.get(("alleles", experiment, study.seed, run), make)


def pack_live_frequencies(lab: Lab, query: Query) -> bytes:
    """Return the container with the allele frequencies of one generation of a live run.

    Raise errors as `LiveRun.find_history` and `pack_stored_frequencies`.
    """
    live_run = lab.live.find_run(query["live"])
    run = read_number(query, "run")
    generation = read_number(query, "generation")
    experiment = live_run.experiment
    history = live_run.find_history(run, generation)
    _require_alleles(experiment, n_generations=1)
    saved_generation, genomes = history.saved_genomes_until(generation)
    if saved_generation != generation:
        genomes = recompute_genomes(
            experiment,
            GenerationKey(live_run.seed, run, generation),
            live_run.read_fitness(run, generation),
            start=(saved_generation, genomes),
        )
    frequencies = compute_allele_frequencies(experiment, [genomes])
    return binary_frames.pack(
        _make_header(experiment, first_generation=generation), {"share": frequencies}
    )


def compute_allele_frequencies(
    experiment: BaseExperiment, genomes: Iterable[Genome]
) -> npt.NDArray[np.float32]:
    """Return the share of agents that are born with each allele [generation, locus, allele].

    The loci of several modules follow each other. A value that is not an allele is not counted.
    """
    allele_values = np.array(list(model_displays.read_alleles(experiment).values()), np.float32)
    # The last axis is that of the alleles.
    # Genes of parts have no alleles.
    loci = slice(experiment.weight_count)
    genes_by_locus = (genome[..., loci].reshape(len(genome), -1, 1) for genome in genomes)
    return np.stack(
        [(genes == allele_values).mean(axis=0, dtype=np.float32) for genes in genes_by_locus]
    )


def _make_header(experiment: BaseExperiment, first_generation: int) -> dict[str, Any]:
    return {
        "kind": "alleles",
        "alleles": list(model_displays.read_alleles(experiment)),
        "description": model_displays.describe_model(experiment),
        "first": first_generation,
    }


def _require_alleles(experiment: BaseExperiment, n_generations: int) -> None:
    """Raise an error if there are no alleles, or if their frequencies exceed one response.

    The error is MissingError if the model declares no alleles, and ValueError for too many values.
    """
    alleles = model_displays.read_alleles(experiment)
    if not alleles:
        raise MissingError(f"{experiment.name}: the model {experiment.model} declares no alleles")
    n_loci = len(experiment.modules) * experiment.weight_count
    n_frequencies = n_generations * n_loci * len(alleles)
    if n_frequencies * np.dtype(np.float32).itemsize > MAX_RESPONSE_BYTES:
        raise ValueError(
            f"{experiment.name} has {n_generations:,} generations of {n_loci:,} loci, too many for"
            " one response"
        )
