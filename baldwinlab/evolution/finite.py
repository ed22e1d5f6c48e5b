"""Check of new genomes, once per generation and run: all genes are written and finite."""

from __future__ import annotations

import numpy as np

from baldwinlab.core.errors import RefusedError
from baldwinlab.evolution.rng_key import GenerationKey, Genome
from baldwinlab.experiment import BaseExperiment, Experiment


def require_finite(
    experiment: BaseExperiment, key: GenerationKey, genome: Genome, *paths: str
) -> None:
    """Require that all genes are finite, except those that the network or the model declares."""
    position = find_faulty_gene(experiment, genome)
    if position:
        agent, module, gene = position
        parts = " and ".join(f"{path} = {_name_parts(experiment, path)}" for path in paths)
        raise RefusedError(
            f"{parts} left gene {gene} of the module {experiment.modules[module]!r} of agent "
            f"{agent} unwritten or not finite ({genome[agent, module, gene]:g}), in generation "
            f"{key.generation} of run {key.run}; every gene must be a finite number, so correct "
            "the part, or choose smaller rates"
        )


def find_faulty_gene(experiment: BaseExperiment, genome: Genome) -> tuple[int, ...]:
    """Return the position of the first gene that is not finite and not declared, or ().

    The position has one number for each dimension of `genome` [..., module, weight].
    """
    if np.isfinite(genome).all():
        return ()
    faulty = ~np.isfinite(genome)
    # The part that defines the format of genomes declares which genes may be infinite.
    genome_field = "network.kind" if isinstance(experiment, Experiment) else "model"
    infinite_genes = list(experiment.part(genome_field).infinite_genes)
    faulty[..., infinite_genes] = np.isnan(genome[..., infinite_genes])
    positions = np.argwhere(faulty)
    return tuple(positions[0].tolist()) if len(positions) > 0 else ()


def _name_parts(experiment: BaseExperiment, path: str) -> str:
    """Return the value of a field: the names of its parts, or the paths of the genome files."""
    if path == "model":
        names = [experiment.model]
    elif path == "evolution.founders":
        names = [entry.path for entry in experiment.evolution.founders]
    else:
        names = [part.name for part in experiment.parts(path)]
    return ", ".join(repr(name) for name in names)
