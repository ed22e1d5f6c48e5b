"""Names on the coordinates of assays."""

from __future__ import annotations

from collections.abc import Mapping

# Assay of two species, which does not concern the Baldwin effect.
OPPONENTS = "opponents"
# Assay of generality, which does not concern the Baldwin effect.
UNSEEN_MAPS = "unseen-maps"
# Assays that evolve populations further, and the start of their branches.
FORKS: Mapping[str, str] = {"fork": "population", "fork-mode": "mode"}
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
