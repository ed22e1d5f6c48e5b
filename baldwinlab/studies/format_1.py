"""Kind and factors of a study of format 1, which are not stored but follow from its names.

A study of format 1 contains presets of the first paper, or custom experiments. The name of a
condition is split into factors only if every component is the name of such a preset.
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
        case [learner, where] if learner in LEARNERS and where in MAPS:
            return Factors(learner, where)
        case [variant, learner, where] if (
            learner in LEARNERS and where in MAPS and _is_variant(variant)
        ):
            return Factors(learner, where, variant)
    return Factors(learner=name)


def _is_variant(name: str) -> bool:
    return name == STANDARD_VARIANT or VARIANTS.issuperset(name.split("+"))
