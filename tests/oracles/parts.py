"""Oracles of built-in parts: the same rules in plain Python, written without the engine.

A custom part contains its oracle, with which `baldwinlab check` compares it. The oracles of
built-in parts are only for tests.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, Final

from baldwinlab.api.checks import REQUIREMENTS, CheckFinding, check_part, check_requirement
from baldwinlab.api.checks.fixture import group_parts
from baldwinlab.evolution.fitness import Energy
from baldwinlab.evolution.fitness_sharing import FitnessSharing
from baldwinlab.evolution.infinitesimal import Infinitesimal
from baldwinlab.evolution.inheritance import Darwinian
from baldwinlab.evolution.lexicase import Lexicase
from baldwinlab.evolution.neat.operators import Neat, SpeciesSelection
from baldwinlab.evolution.neutral_selection import Neutral
from baldwinlab.evolution.ordinal_selection import (
    BestCopies,
    LargerTournament,
    MuPlusLambda,
    Rank,
    Tournament,
    Truncation,
)
from baldwinlab.evolution.proportional_selection import ExpectedOffspring, Outcrossing, Roulette
from baldwinlab.evolution.self_adaptation import SelfAdaptive
from baldwinlab.evolution.social_heredity import SocialHeredity
from baldwinlab.evolution.stop import Fixation, Stagnation, TargetFitness
from baldwinlab.evolution.variation import Crossover
from baldwinlab.evolution.variation_operators import Copy, Gaussian, GenePool, OnePointCrossover
from baldwinlab.models.cell_foragers.variation import FewMutations
from baldwinlab.models.cue_learners.genes import OnePointOfUnits
from baldwinlab.models.digit_readers.variation import FourBitWeights
from baldwinlab.models.discrete_variation import BitFlips, OnePointOfAlleles, OnePointOfBits
from baldwinlab.models.lattice_walkers.breeding import LatticeSteps, MutantFixation
from baldwinlab.models.miniworld.behavior_fitness import Distance, EarlyFood
from baldwinlab.models.miniworld.bodies.kinematic import Continuous, Grid, Stay
from baldwinlab.models.miniworld.bodies.walker import Walker
from baldwinlab.models.miniworld.features.walls import Walls
from baldwinlab.models.miniworld.learning.abcd import ABCD, EvolvedABCD, EvolvedModulated, Modulated
from baldwinlab.models.miniworld.learning.hebbian import Covariance, Hebb, Postsynaptic, Presynaptic
from baldwinlab.models.miniworld.learning.imitation import Imitation, RandomTargets, Supervised
from baldwinlab.models.miniworld.learning.prediction import Prediction, RandomPrediction
from baldwinlab.models.miniworld.learning.reward import Complementary, Reward
from baldwinlab.models.miniworld.learning.self_taught import SelfTaught
from baldwinlab.models.miniworld.networks.feed_forward import FeedForward
from baldwinlab.models.miniworld.networks.neat import NeatNetwork
from baldwinlab.models.miniworld.networks.recurrent import ContinuousTime, SimpleRecurrent
from baldwinlab.models.miniworld.novelty import Novelty
from baldwinlab.models.miniworld.senses.binary import (
    Compass,
    LastAction,
    Neighbours,
    PatchSight,
    Touch,
)
from baldwinlab.models.miniworld.senses.food_rays import FoodRays
from baldwinlab.models.miniworld.senses.real_valued import EnergySense, Nearest, Rays, Smell
from baldwinlab.models.miniworld.senses.sight import Sight
from baldwinlab.models.miniworld.senses.species_sight import SpeciesInSight, SpeciesNearness
from tests.oracles import (
    bodies,
    fitness,
    hebbian,
    inheritance,
    learning,
    neat,
    networks,
    selection,
    senses,
    stop,
    variation,
)

# Part -> oracle, with the arguments that `api/checks/declarations.py` lists for its kind. Its name
# is a verb and the name of the part.
BUILT_IN_ORACLES: Final[Mapping[Any, Callable[..., Any]]] = {
    ABCD: hebbian.apply_abcd,
    BestCopies: selection.choose_best_copies,
    BitFlips: variation.breed_bit_flips,
    Compass: senses.compute_compass,
    Complementary: learning.apply_complementary,
    Continuous: bodies.move_continuous,
    ContinuousTime: networks.compute_continuous_time,
    Copy: variation.breed_copy,
    Covariance: hebbian.apply_covariance,
    Crossover: variation.breed_crossover,
    Darwinian: inheritance.inherit_darwinian,
    Distance: fitness.evaluate_distance,
    EarlyFood: fitness.evaluate_early_food,
    Energy: fitness.evaluate_energy,
    EnergySense: senses.compute_energy_sense,
    EvolvedABCD: hebbian.apply_abcd,
    EvolvedModulated: hebbian.apply_modulated,
    ExpectedOffspring: selection.choose_expected_offspring,
    FeedForward: networks.compute_feed_forward,
    FewMutations: variation.breed_few_mutations,
    FitnessSharing: selection.choose_fitness_sharing,
    Fixation: stop.stop_at_fixation,
    FoodRays: senses.compute_food_rays,
    FourBitWeights: variation.breed_four_bit_weights,
    Gaussian: variation.breed_gaussian,
    GenePool: variation.breed_gene_pool,
    Grid: bodies.move_grid,
    Hebb: hebbian.apply_hebb,
    Imitation: learning.apply_imitation,
    Infinitesimal: variation.breed_infinitesimal,
    LargerTournament: selection.choose_larger_tournament,
    LastAction: senses.compute_last_action,
    LatticeSteps: variation.breed_lattice_steps,
    Lexicase: selection.choose_lexicase,
    Modulated: hebbian.apply_modulated,
    MuPlusLambda: selection.choose_mu_plus_lambda,
    MutantFixation: selection.choose_mutant_fixation,
    Nearest: senses.compute_nearest,
    Neat: neat.breed_children,
    NeatNetwork: neat.compute_outputs,
    Neighbours: senses.compute_neighbours,
    Neutral: selection.choose_neutral,
    Novelty: fitness.evaluate_novelty,
    OnePointCrossover: variation.breed_one_point_crossover,
    OnePointOfAlleles: variation.breed_one_point_of_alleles,
    OnePointOfBits: variation.breed_one_point_of_bits,
    OnePointOfUnits: variation.breed_one_point_of_units,
    Outcrossing: selection.choose_outcrossing,
    PatchSight: senses.compute_patch_sight,
    Postsynaptic: hebbian.apply_postsynaptic,
    Prediction: learning.apply_prediction,
    Presynaptic: hebbian.apply_presynaptic,
    RandomPrediction: learning.apply_random_prediction,
    RandomTargets: learning.apply_random_targets,
    Rank: selection.choose_rank,
    Rays: senses.compute_rays,
    Reward: learning.apply_reward,
    Roulette: selection.choose_roulette,
    SelfAdaptive: variation.breed_self_adaptive,
    SelfTaught: learning.apply_self_taught,
    Sight: senses.compute_sight,
    SimpleRecurrent: networks.compute_simple_recurrent,
    Smell: senses.compute_smell,
    SocialHeredity: inheritance.inherit_social_heredity,
    SpeciesInSight: senses.compute_species_in_sight,
    SpeciesNearness: senses.compute_species_nearness,
    SpeciesSelection: neat.choose_parents,
    Stagnation: stop.stop_at_stagnation,
    Stay: bodies.move_walker,
    Supervised: learning.apply_supervised,
    TargetFitness: stop.stop_at_target_fitness,
    Touch: senses.compute_touch,
    Tournament: selection.choose_tournament,
    Truncation: selection.choose_truncation,
    Walker: bodies.move_walker,
    Walls: bodies.compute_walls,
}


def find_oracle(part: Any) -> Callable[..., Any]:
    """Return the oracle of a part or of a class of parts."""
    part_class = part if isinstance(part, type) else type(part)
    return next(BUILT_IN_ORACLES[base] for base in part_class.__mro__ if base in BUILT_IN_ORACLES)


@contextmanager
def use_oracles() -> Iterator[None]:
    """Give all built-in parts their oracles, as custom parts have them."""
    for part, oracle in BUILT_IN_ORACLES.items():
        part.oracle = staticmethod(oracle)
    try:
        yield
    finally:
        for part in BUILT_IN_ORACLES:
            del part.oracle


def check_built_in_parts(parts: Any, requirements: Sequence[str] = ()) -> list[CheckFinding]:
    """Check built-in parts, and compare them with their oracles.

    The child processes of a check do not know these oracles, so this process compares.
    """
    names = requirements or tuple(REQUIREMENTS)
    others = [name for name in names if name != "oracle"]
    # An empty list would be all requirements.
    findings = check_part(parts, requirements=others) if others else []
    if "oracle" in names:
        classes = [parts] if isinstance(parts, type) else parts
        with use_oracles():
            findings += check_requirement("oracle", list(group_parts(classes)), "")
    return findings
