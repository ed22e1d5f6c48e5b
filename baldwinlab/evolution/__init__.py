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
    remap_parents_of_runs,
    selects_by_lifetimes,
)
from baldwinlab.evolution.rng_key import (
    Fitness,
    GenerationKey,
    Genome,
    Parents,
    RunKeys,
    Uniforms,
    make_run_keys,
)
from baldwinlab.evolution.selection import select
from baldwinlab.evolution.stop import find_stopped_runs

__all__ = [
    "Fitness",
    "GenerationKey",
    "Genome",
    "Parents",
    "RunKeys",
    "Uniforms",
    "apply_inheritance",
    "breed",
    "compute_learning_cost",
    "draw_genomes",
    "find_archive_fitness",
    "find_stopped_runs",
    "find_teachers",
    "fitness",
    "has_parent_teachers",
    "make_founders",
    "make_generation",
    "make_run_keys",
    "mean_fitness",
    "needs_simulation",
    "remap_parents_of_runs",
    "require_fitness_without_archive",
    "require_founders",
    "select",
    "selects_by_lifetimes",
    "sum_energy",
]
