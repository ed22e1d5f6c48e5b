"""Kind and factors of a study of format 1, which stores neither.

Both are derived from the names of the conditions. A study of format 1 contains presets of the
first paper, or custom experiments. The name of a condition is split into factors only if each of
its components is a learner, a map or a variant of the first paper.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from baldwinlab.experiment.factors import CONDITIONS, MULTIVERSE, SWEEP, Factors, StudyKind

LEARNERS = {
    "evo", "evo+self-taught", "self-taught", "evo+costly-learning", "evo+drift",
    "evo+early-learning", "evo+evolved-rate", "evo+fresh-teacher", "evo+lamarckian",
    "evo+motor-noise", "evo+random-headings", "evo+shuffled-teacher",
}  # fmt: skip
MAPS = {"A", "B"}
STANDARD_VARIANT = "standard"
VARIANTS = {
    "biases", "contact-2", "contact-5", "contact-square", "literal", "mutation-per-child",
    "open-boundaries", "population-100", "rank", "sequential", "tournament", "truncation",
    "visual-radius-10", "visual-radius-20",
}  # fmt: skip


def kind_and_factors(directory: Path, names: Sequence[str]) -> tuple[StudyKind, dict[str, Factors]]:
    """Return the kind and the factors of a study of format 1 with these conditions."""
    if (directory / "sweep.toml").exists():
        return SWEEP, dict.fromkeys(names, Factors())
    factors = {name: _factors(name) for name in names}
    is_multiverse = bool(names) and all(condition.variant for condition in factors.values())
    return (MULTIVERSE if is_multiverse else CONDITIONS), factors


def _factors(name: str) -> Factors:
    match name.split("/"):
        case [learner, map_name] if learner in LEARNERS and map_name in MAPS:
            return Factors(learner, map_name)
        case [variant, learner, map_name] if (
            learner in LEARNERS and map_name in MAPS and _is_variant(variant)
        ):
            return Factors(learner, map_name, variant)
    return Factors(learner=name)


def _is_variant(name: str) -> bool:
    return name == STANDARD_VARIANT or VARIANTS.issuperset(name.split("+"))
