"""Operators on genomes: founders, selection, variation, inheritance and fitness.

Compiled functions allocate no memory and check no arguments. The functions that other packages call
allocate memory and check arguments.
"""

from baldwinlab.evolution.breeding import breed, make_generation
from baldwinlab.evolution.fitness import (
    compute_learning_cost,
    find_archive_fitness,
    fitness,
    mean_fitness,
    require_fitness_without_archive,
    sum_energy,
)
from baldwinlab.evolution.founders import draw_genomes, make_founders, require_founders
from baldwinlab.evolution.inheritance import (
    apply_inheritance,
    find_teachers,
    has_parent_teachers,
    needs_simulation,
    remap_parents,
    selects_by_lifetimes,
)
from baldwinlab.evolution.rng_key import Fitness, GenerationKey, Genome, Parents, Uniforms
from baldwinlab.evolution.selection import select
from baldwinlab.evolution.stop import is_stopped

__all__ = [
    "Fitness",
    "GenerationKey",
    "Genome",
    "Parents",
    "Uniforms",
    "apply_inheritance",
    "breed",
    "compute_learning_cost",
    "draw_genomes",
    "find_archive_fitness",
    "find_teachers",
    "fitness",
    "has_parent_teachers",
    "is_stopped",
    "make_founders",
    "make_generation",
    "mean_fitness",
    "needs_simulation",
    "remap_parents",
    "require_fitness_without_archive",
    "require_founders",
    "select",
    "selects_by_lifetimes",
    "sum_energy",
]
