"""Schema of the variables of assays, and the names on their coordinates."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from baldwinlab.core.variables import Variable

_BRANCH_DIMS = ("run", "generation", "history", "regime", "agent")
_FORK_VARIABLES: Mapping[str, Variable] = {
    "innate_fitness": Variable(
        _BRANCH_DIMS, np.float64, "energy", "fitness without learning at the end of the branch"
    ),
    "fitness": Variable(
        _BRANCH_DIMS, np.float64, "energy", "fitness in the regime of the branch, at its end"
    ),
}

# Variables of the datasets of each assay (docs/explanation/assays.md).
ASSAY_VARIABLES: Mapping[str, Mapping[str, Variable]] = {
    "innate": {
        "energy": Variable(
            ("run", "generation", "life", "agent"),
            np.float64,
            "energy",
            "fitness in this kind of lifetime",
        ),
        "distance": Variable(
            ("run", "generation", "layer", "agent"),
            np.float32,
            "1",
            "distance of the weights of a layer between birth and death",
        ),
    },
    "neutral": {
        "energy": Variable(
            ("run", "generation", "newborns", "life", "agent"),
            np.float64,
            "energy",
            "fitness of these newborns in this kind of lifetime",
        ),
    },
    "within-life": {
        "eaten_in_window": Variable(
            ("run", "newborns", "window", "agent"),
            np.int32,
            "items",
            "items eaten in this part of the lifetime",
        ),
        "first_meal": Variable(
            ("run", "newborns", "agent"),
            np.float32,
            "steps",
            "step in which the agent first ate; NaN if it never ate",
        ),
    },
    "modules": {
        "energy": Variable(
            ("run", "modules", "agent"), np.float64, "energy", "fitness with these modules"
        ),
    },
    "reaction": {
        "energy": Variable(
            ("run", "setting", "agent"), np.float64, "energy", "fitness in this setting"
        ),
    },
    "descent": {
        "common_ancestor_age": Variable(
            ("run", "generation"),
            np.float32,
            "generations",
            "generations since the last common ancestor of all agents; NaN without one",
        ),
        "effective_ancestors": Variable(
            ("run", "generation"),
            np.float32,
            "agents",
            "effective number of founders: 1 / sum of squared shares in the gene pool",
        ),
    },
    "reaction-norms": {
        "energy": Variable(
            ("run", "generation", "factor", "agent"),
            np.float64,
            "energy",
            "fitness with this multiple of the amount of learning; NaN if it is not valid",
        ),
    },
    "canalization": {
        "energy": Variable(
            ("run", "generation", "life", "world", "agent"),
            np.float64,
            "energy",
            "fitness of the agent in this kind of lifetime and in this world",
        ),
        "mutant_energy": Variable(
            ("run", "generation", "life", "mutant", "agent"),
            np.float64,
            "energy",
            "fitness of a single mutant of the agent in the stored world; NaN without a mutation",
        ),
    },
    "opponents": {
        "energy": Variable(
            ("run", "first_generation", "second_generation", "species"),
            np.float64,
            "energy",
            "mean fitness of the agents of a species when these generations meet",
        ),
    },
    "unseen-maps": {
        "energy": Variable(
            ("run", "map"), np.float64, "energy", "mean fitness of the agents on this map"
        ),
    },
    "fork": _FORK_VARIABLES,
    "fork-mode": _FORK_VARIABLES,
}
# Assay of two species, which does not concern the Baldwin effect.
OPPONENTS = "opponents"
# Assay of generality, which does not concern the Baldwin effect.
UNSEEN_MAPS = "unseen-maps"
# Assays that evolve populations further, and the start of their branches.
POPULATION = "population"
MODE = "mode"
FORKS: Mapping[str, str] = {"fork": POPULATION, "fork-mode": MODE}
# Histories and regimes of the branches of a fork.
HISTORIES = ("learner", "control")
REGIMES = ("on", "off")
# Names of newborns in the assay within-life.
RANDOM_NEWBORNS = "random genome"
EVOLVED_NEWBORNS = "evolved"
# Name of the unchanged setting in the assay reaction.
UNCHANGED_SETTING = "as evolved"
# Newborns in the assay neutral: evolved newborns, and newborns of random parents.
NEUTRAL_NEWBORNS = (EVOLVED_NEWBORNS, "neutral control")
# Kinds of lifetimes: learning off, learning on, weights at death without learning, random drift.
LIFE_KINDS = ("off", "on", "frozen", "drift")
# Multiples of the amount of learning in the assay reaction-norms. 0 is learning off.
LEARNING_FACTORS = (0.0, 0.25, 0.5, 1.0, 2.0, 4.0)
# Worlds in the assay canalization: the stored world, and one with other random numbers.
WORLDS = ("stored", "new")
