"""Evolution: founders, selection, variation, inheritance and fitness, as compiled functions of arrays and of random numbers.

Kernels allocate nothing and validate nothing; what is called from outside of this package does both.
"""

from baldwinlab.evolution.breeding import breed, next_genome
from baldwinlab.evolution.fitness import cost_of_learning, energy_of, fitness
from baldwinlab.evolution.founders import draw_genome
from baldwinlab.evolution.inheritance import (
    bequeath,
    deal_teachers,
    elders_of,
    elders_teach,
    needs_lives,
    trace_back,
)
from baldwinlab.evolution.rng_key import Fitness, Genome, Moment, Parents, Uniforms
from baldwinlab.evolution.selection import select

__all__ = [
    "Fitness",
    "Genome",
    "Moment",
    "Parents",
    "Uniforms",
    "bequeath",
    "breed",
    "cost_of_learning",
    "deal_teachers",
    "draw_genome",
    "elders_of",
    "elders_teach",
    "energy_of",
    "fitness",
    "needs_lives",
    "next_genome",
    "select",
    "trace_back",
]
