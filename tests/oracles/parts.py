"""Oracles of built-in parts: the same rules in plain Python, written without the engine.

A custom part contains an oracle, and `baldwinlab check` compares the two. Oracles of built-in parts
are only for tests.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, Final

from baldwinlab.api.checks import REQUIREMENTS, CheckFinding, check_part, check_requirement
from baldwinlab.api.checks.fixture import group_parts
from baldwinlab.experiment import registry
from tests.oracles import (
    bodies,
    breeding,
    hebbian,
    learning,
    neat,
    networks,
    selection,
    senses,
    variation,
)

# Kind of part -> name -> oracle. `ORACLES` in `api/checks/declarations.py` has the arguments.
_ORACLES: Final[Mapping[str, Mapping[str, Callable[..., Any]]]] = {
    "sense": {
        "compass": senses.compute_compass,
        "energy": senses.compute_energy_sense,
        "food": senses.compute_sight,
        "food-rays": senses.compute_food_rays,
        "last-action": senses.compute_last_action,
        "nearest": senses.compute_nearest,
        "neighbours": senses.compute_neighbours,
        "patch": senses.compute_patch_sight,
        "rays": senses.compute_rays,
        "smell": senses.compute_smell,
        "species-in-sight": senses.compute_species_in_sight,
        "species-nearness": senses.compute_species_nearness,
        "touch": senses.compute_touch,
    },
    "body": {
        "continuous": bodies.move_continuous,
        "grid": bodies.move_grid,
        "stay": bodies.move_walker,
        "walker": bodies.move_walker,
    },
    "network": {
        "continuous-time": networks.compute_continuous_time,
        "feed-forward": networks.compute_feed_forward,
        "neat": neat.compute_outputs,
        "simple-recurrent": networks.compute_simple_recurrent,
    },
    "learning rule": {
        "abcd": hebbian.apply_abcd,
        "covariance": hebbian.apply_covariance,
        "crbp": learning.apply_complementary,
        "evolved-abcd": hebbian.apply_abcd,
        "evolved-modulated": hebbian.apply_modulated,
        "hebb": hebbian.apply_hebb,
        "imitation": learning.apply_imitation,
        "modulated": hebbian.apply_modulated,
        "postsynaptic": hebbian.apply_postsynaptic,
        "prediction": learning.apply_prediction,
        "presynaptic": hebbian.apply_presynaptic,
        "random-prediction": learning.apply_random_prediction,
        "random-targets": learning.apply_random_targets,
        "reward": learning.apply_reward,
        "self-taught": learning.apply_self_taught,
        "supervised": learning.apply_supervised,
    },
    "world feature": {
        "walls": bodies.compute_walls,
    },
    "selection": {
        "best-copies": selection.choose_best_copies,
        "expected-offspring": selection.choose_expected_offspring,
        "fitness-sharing": selection.choose_fitness_sharing,
        "larger-tournament": selection.choose_larger_tournament,
        "lexicase": selection.choose_lexicase,
        "mu-plus-lambda": selection.choose_mu_plus_lambda,
        "mutant-fixation": selection.choose_mutant_fixation,
        "neutral": selection.choose_neutral,
        "outcrossing": selection.choose_outcrossing,
        "rank": selection.choose_rank,
        "roulette": selection.choose_roulette,
        "species": neat.choose_parents,
        "tournament": selection.choose_tournament,
        "truncation": selection.choose_truncation,
    },
    "variation": {
        "bit-flips": variation.breed_bit_flips,
        "copy": variation.breed_copy,
        "crossover": variation.breed_crossover,
        "few-mutations": variation.breed_few_mutations,
        "four-bit-weights": variation.breed_four_bit_weights,
        "gaussian": variation.breed_gaussian,
        "gene-pool": variation.breed_gene_pool,
        "infinitesimal": variation.breed_infinitesimal,
        "lattice-steps": variation.breed_lattice_steps,
        "neat": neat.breed_children,
        "one-point-alleles": variation.breed_one_point_of_alleles,
        "one-point-bits": variation.breed_one_point_of_bits,
        "one-point-crossover": variation.breed_one_point_crossover,
        "one-point-of-units": variation.breed_one_point_of_units,
        "self-adaptive": variation.breed_self_adaptive,
    },
    "inheritance": {
        "darwinian": breeding.inherit_darwinian,
        "social-heredity": breeding.inherit_social_heredity,
    },
    "fitness": {
        "distance": breeding.evaluate_distance,
        "early-food": breeding.evaluate_early_food,
        "energy": breeding.evaluate_energy,
        "novelty": breeding.evaluate_novelty,
    },
    "stop": {
        "fixation": breeding.stop_at_fixation,
        "stagnation": breeding.stop_at_stagnation,
        "target-fitness": breeding.stop_at_target_fitness,
    },
}
BUILT_IN_ORACLES: Final[Mapping[Any, Callable[..., Any]]] = {
    registry.find_class(kind, name): oracle
    for kind, oracles in _ORACLES.items()
    for name, oracle in oracles.items()
}


def find_oracle(part: Any) -> Callable[..., Any]:
    """Return the oracle of a part or of a class of parts."""
    part_class = part if isinstance(part, type) else type(part)
    return next(BUILT_IN_ORACLES[base] for base in part_class.__mro__ if base in BUILT_IN_ORACLES)


@contextmanager
def use_oracles() -> Iterator[None]:
    """Add oracles to all built-in parts, in the same way as custom parts have oracles."""
    for part, oracle in BUILT_IN_ORACLES.items():
        part.oracle = staticmethod(oracle)
    try:
        yield
    finally:
        for part in BUILT_IN_ORACLES:
            del part.oracle


def check_built_in_parts(parts: Any, requirements: Sequence[str] = ()) -> list[CheckFinding]:
    """Check built-in parts, and compare them with their oracles.

    The child processes of `check_part` do not have these oracles, so this process compares.
    """
    names = requirements or tuple(REQUIREMENTS)
    others = [name for name in names if name != "oracle"]
    # `check_part` with an empty list would check all requirements.
    findings = check_part(parts, requirements=others) if others else []
    if "oracle" in names:
        classes = [parts] if isinstance(parts, type) else parts
        with use_oracles():
            findings += check_requirement("oracle", list(group_parts(classes)), "")
    return findings
