"""The displays of models without a world: views of a generation, and frequencies of alleles.

A locus is an entry of a genome, and an allele a named value that a locus can have.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import numpy.typing as npt

from baldwinlab.core.names import did_you_mean
from baldwinlab.evolution import GenerationKey, Genome
from baldwinlab.experiment import BaseExperiment
from baldwinlab.lab import Lab, MissingError, Query, read_number, read_text
from baldwinlab.lab.sources import binary_frames, life_query, model_displays
from baldwinlab.lab.sources.life_query import MAX_RESPONSE_BYTES
from baldwinlab.lab.sources.studies import find_run
from baldwinlab.parts.views import GridView, MatrixView, View, ViewData, arrays_of
from baldwinlab.simulation.reevaluation import iterate_genomes, restore_genomes
from baldwinlab.simulation.replay import recompute_genomes


def pack_view(lab: Lab, query: Query) -> bytes:
    """Return the container with the requested view of a generation of a stored run.

    A view of one agent shows the requested agent, by default the fittest agent.
    """
    study, experiment, run = find_run(lab, query)
    study.require_parts(experiment.name)
    view = _find_view(experiment, read_text(query, "view"))
    generation = read_number(query, "generation")
    requested_agent = read_number(query, "agent", 0) if "agent" in query else None
    life_query.require_generation(experiment, generation)
    if requested_agent is not None:
        life_query.require_agent(experiment, requested_agent)

    def make() -> bytes:
        record = study.record(experiment.name, run)
        genomes = restore_genomes(experiment, record, generation)
        fittest_agent = int(record.energy.values[generation].argmax())
        agent = fittest_agent if requested_agent is None else requested_agent
        generation_key = GenerationKey(study.seed, run, generation)
        data = view.make_data(experiment.model_part, generation_key, genomes, agent)
        header = {
            "view_description": view.description,
            "agent": agent if view.has_agent_choice else None,
            "description": model_displays.describe_model(experiment),
        }
        return _pack_data(data, header)

    cache_key = ("view", experiment, study.seed, run, generation, query["view"], requested_agent)
    return lab.cache.get(cache_key, make)


def _find_view(experiment: BaseExperiment, name: str) -> View:
    views = model_displays.read_views(experiment)
    if name not in views:
        hint = "; it declares no views"
        if views:
            hint = f"{did_you_mean(name, views)}; its views are {', '.join(views)}"
        raise MissingError(
            f"{experiment.name}: the model {experiment.model} has no view {name!r}{hint}"
        )
    return views[name]


def _pack_data(data: ViewData, header: dict[str, Any]) -> bytes:
    arrays = arrays_of(data)
    n_bytes = sum(array.nbytes for array in arrays.values())
    if n_bytes > life_query.MAX_RESPONSE_BYTES:
        raise ValueError(
            f"this view has {n_bytes:,} bytes; one response can contain"
            f" {life_query.MAX_RESPONSE_BYTES:,} bytes"
        )
    return binary_frames.pack(header | _make_kind_header(data), arrays)


def _make_kind_header(data: ViewData) -> dict[str, Any]:
    """Return the entries of the header that depend on the kind of view: names and labels."""
    if isinstance(data, MatrixView):
        return {
            "kind": "matrix",
            "rows": list(data.rows),
            "columns": list(data.columns),
            "value_label": data.value_label,
        }
    if isinstance(data, GridView):
        return {
            "kind": "grid",
            "cell_colors": dict(data.cell_colors),
            "visit_label": data.visit_label,
        }
    return {
        "kind": "path",
        "names": list(data.lines),
        "step_label": data.step_label,
        "value_label": data.value_label,
    }


def pack_frequencies(lab: Lab, query: Query) -> bytes:
    """Return the container with the allele frequencies of a stored run or of a live run."""
    pack = pack_live_frequencies if "live" in query else pack_stored_frequencies
    return pack(lab, query)


def pack_stored_frequencies(lab: Lab, query: Query) -> bytes:
    """Return the container with the allele frequencies of all generations of a stored run.

    The array `share` is [generation, locus, allele]. The header names the alleles.
    """
    study, experiment, run = find_run(lab, query)
    study.require_parts(experiment.name)
    _require_alleles(experiment, experiment.evolution.generations)

    def make() -> bytes:
        genomes = iterate_genomes(experiment, study.record(experiment.name, run))
        frequencies = compute_allele_frequencies(experiment, genomes)
        return binary_frames.pack(
            _make_allele_header(experiment, first_generation=0), {"share": frequencies}
        )

    return lab.cache.get(("alleles", experiment, study.seed, run), make)


def pack_live_frequencies(lab: Lab, query: Query) -> bytes:
    """Return the container with the frequencies [1, locus, allele] of a live run's generation."""
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
        _make_allele_header(experiment, first_generation=generation), {"share": frequencies}
    )


def compute_allele_frequencies(
    experiment: BaseExperiment, genomes: Iterable[Genome]
) -> npt.NDArray[np.float32]:
    """Return the fraction of agents that are born with each allele [generation, locus, allele].

    `genomes`: one array [agent, module, weight] per generation. The loci of the first module come
    first. The fractions of a locus add up to less than 1 if genomes have values without an allele.
    """
    allele_values = np.array(list(model_displays.read_alleles(experiment).values()), np.float32)
    # The entries after the weights are genes of parts, which have no alleles.
    loci = slice(experiment.weight_count)
    # [agent, locus, 1]: the last axis is compared with the values of all alleles.
    genes_by_locus = (genome[..., loci].reshape(len(genome), -1, 1) for genome in genomes)
    return np.stack(
        [(genes == allele_values).mean(axis=0, dtype=np.float32) for genes in genes_by_locus]
    )


def _make_allele_header(experiment: BaseExperiment, first_generation: int) -> dict[str, Any]:
    return {
        "kind": "alleles",
        "alleles": list(model_displays.read_alleles(experiment)),
        "description": model_displays.describe_model(experiment),
        "first": first_generation,
    }


def _require_alleles(experiment: BaseExperiment, n_generations: int) -> None:
    """Raise MissingError for a model without alleles, and ValueError for too many frequencies."""
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
