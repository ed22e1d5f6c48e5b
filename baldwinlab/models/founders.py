"""Founders of several models: random bits, random alleles, and normal numbers."""

from __future__ import annotations

from typing import Final

import numpy as np
import numpy.typing as npt

from baldwinlab.engine import poison
from baldwinlab.evolution.founders import draw_module
from baldwinlab.evolution.rng_key import GenerationKey
from baldwinlab.parts import FOUNDER

# Number that represents the allele ? in a genome.
UNSET_ALLELE: Final = 0.5


def draw_bits(key: GenerationKey, agents: int, bits: int) -> npt.NDArray[np.float32]:
    """Draw genomes of one module [agent, 1, bit], with 0 and 1 in equal shares."""
    # [agent, bit]: the first of four numbers.
    draws = key.uniforms(FOUNDER, (agents, bits))[:, :, 0]
    return (draws < 0.5).astype(np.float32)[:, None]


def draw_alleles(
    key: GenerationKey, agents: int, loci: int, unset_share: float
) -> npt.NDArray[np.float32]:
    """Draw genomes of one module [agent, 1, locus] of the alleles 0, 1 and ?."""
    draws = key.uniforms(FOUNDER, (agents, loci))[:, :, 0]
    # The shares of 0 and 1 are equal.
    zero_share = (1 - unset_share) / 2
    alleles = np.select([draws < zero_share, draws < 2 * zero_share], [0.0, 1.0], UNSET_ALLELE)
    return alleles[:, None].astype(np.float32)


def draw_normal_numbers(key: GenerationKey, agents: int, weights: int) -> npt.NDArray[np.float32]:
    """Draw genomes of one module [agent, 1, weight] from N(0, 1)."""
    genomes = poison.empty((agents, 1, weights), np.float32)
    draw_module(key, FOUNDER, genomes, 0)
    return genomes
