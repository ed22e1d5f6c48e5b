"""What a study of format 1 did not write down: its kind and its factors. The only place that reads them out of names.

Studies of format 1 were made of the first paper's presets, or of somebody's own experiments. A name counts only where all its
parts are names of those presets as they were then; any other condition is one of somebody's own.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from baldwinlab.experiment.factors import CONDITIONS, MULTIVERSE, SWEEP, Factors, Kind

LEARNERS = {
    "evo", "evo+self-taught", "self-taught", "evo+costly-learning", "evo+drift", "evo+early-learning", "evo+evolved-rate",
    "evo+fresh-teacher", "evo+lamarckian", "evo+motor-noise", "evo+random-headings", "evo+shuffled-teacher",
}  # fmt: skip
MAPS = {"A", "B"}
STANDARD = "standard"
VARIANTS = {
    "biases", "contact-2", "contact-5", "contact-square", "literal", "mutation-per-child", "open-boundaries", "population-100",
    "rank", "sequential", "tournament", "truncation", "visual-radius-10", "visual-radius-20",
}  # fmt: skip


def kind_and_factors(directory: Path, names: Sequence[str]) -> tuple[Kind, dict[str, Factors]]:
    """Of a study of format 1 in `directory`, whose conditions have these names."""
    if (directory / "sweep.toml").exists():
        return SWEEP, dict.fromkeys(names, Factors())
    factors = {name: _factors(name) for name in names}
    whole = bool(names) and all(one.variant for one in factors.values())
    return (MULTIVERSE if whole else CONDITIONS), factors


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
    return name == STANDARD or VARIANTS.issuperset(name.split("+"))
