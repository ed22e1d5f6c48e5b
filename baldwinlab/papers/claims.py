"""Claims of a paper, read from its `claims.toml`.

The comment at the top of `le_2019/claims.toml` explains the keys.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal, Self

from pydantic import Field, ValidationInfo, field_validator, model_validator

from baldwinlab.core.suggestions import suggest
from baldwinlab.papers.loading import DeclaredTable, PaperError, read_tables, validate_tables

# Value of `b` that selects the first generations of the condition `a`.
FIRST_GENERATIONS = "first"

Rule = Literal[
    "greater", "lower", "close", "survives_longer", "zero",
    "at_least", "within", "mean_within", "mean_at_most", "every_at_most", "every_at_least",
    "probability_above", "probability_below", "probability_equals",
]  # fmt: skip
Kind = Literal["paper", "implementation", "own"]
KINDS: Mapping[Kind, tuple[str, str]] = {
    "paper": ("claim of the paper", "claims of the paper"),
    "implementation": ("check of the implementation", "checks of the implementation"),
    "own": ("own question", "own questions"),
}
"""The singular and plural names of the kinds of claims.

- paper: a statement of the paper.
- implementation: agreement with an exact result, or with an independent implementation.
- own: a question of this project.

Verdicts are counted by kind, and never added over kinds.
"""
# Measures of every model. A model can declare more measures in `measures`.
COMMON_MEASURES = ("best", "mean", "share", "most", "unseen-maps")
# Measure of the assay of the same name: the mean over agents and maps.
UNSEEN_MAPS_MEASURE = "unseen-maps"

RULES: Mapping[Rule, str] = {
    "greater": (
        "Holds if, in every comparison, the corrected p is below 0.05 and the first condition is "
        "higher in the median and in A12. Does not hold if it is significantly lower in any "
        "comparison. Otherwise undecided."
    ),
    "lower": (
        "Holds if, in every comparison, the corrected p is below 0.05 and the first condition is "
        "lower in the median and in A12. Does not hold if it is significantly higher in any "
        "comparison. Otherwise undecided."
    ),
    "close": (
        "Holds if the 95 % interval of the difference is within {bound} of 0. Does not hold if the "
        "interval is completely outside. Otherwise undecided."
    ),
    "survives_longer": (
        "Holds if, in every comparison, the corrected p of the log-rank test is below 0.05 and the "
        "first condition survives longer, also in the restricted mean. Does not hold if it "
        "survives significantly shorter in any comparison. Otherwise undecided. Runs that survive "
        "to the end are censored."
    ),
    "zero": (
        "Holds if no agent ate an item in any run and any generation. Otherwise it does not hold."
    ),
    "at_least": (
        "Holds if the 95 % interval of the median over runs is at or above {bound}. Does not hold "
        "if the interval is completely below. Otherwise undecided."
    ),
    "within": (
        "Holds if the 95 % interval of the median over runs is in {bound}. Does not hold if the "
        "interval is completely outside. Otherwise undecided."
    ),
    "mean_within": "Holds if the mean over runs is in {bound}. Otherwise it does not hold.",
    "mean_at_most": "Holds if the mean over runs is at most {bound}. Otherwise it does not hold.",
    "every_at_most": (
        "Holds if the value is at most {bound} in every run. Otherwise it does not hold."
    ),
    "every_at_least": (
        "Holds if the value is at least {bound} in every run. Otherwise it does not hold."
    ),
    "probability_above": (
        "Holds if the 95 % Clopper-Pearson interval of the probability is above {bound}. Does not "
        "hold if the interval is below. Otherwise undecided."
    ),
    "probability_below": (
        "Holds if the 95 % Clopper-Pearson interval of the probability is below {bound}. Does not "
        "hold if the interval is above. Otherwise undecided."
    ),
    "probability_equals": (
        "Holds if the 95 % Clopper-Pearson interval of the probability contains {bound}. Otherwise "
        "it does not hold."
    ),
}
PROBABILITY_RULES: tuple[Rule, ...] = (
    "probability_above",
    "probability_below",
    "probability_equals",
)
"""Rules for a measure that is 0 or 1 in every run. The probability is that of 1."""
_RULES_WITH_TWO_BOUNDS: tuple[Rule, ...] = ("within", "mean_within")
_RULES_WITH_ONE_BOUND: tuple[Rule, ...] = (
    "at_least",
    "mean_at_most",
    "every_at_most",
    "every_at_least",
)


class ClaimComparison(DeclaredTable):
    """Comparison of the condition `a` with the condition `b`, or with `bound` without `b`."""

    a: str = Field(min_length=1)
    # One of `COMMON_MEASURES`, or a measure of the condition's model.
    measure: str
    rule: Rule
    b: str = ""
    # Compare runs with the same number, for example because they share a landscape.
    paired: bool = False
    bound: float | tuple[float, float] | None = None

    @field_validator("a")
    @classmethod
    def _refuse_first_generations(cls, name: str) -> str:
        if name == FIRST_GENERATIONS:
            raise ValueError("'first' is allowed for b only; a must name a condition")
        return name

    @model_validator(mode="after")
    def _refuse_unused_keys(self) -> Self:
        rules_with_bound = (
            *_RULES_WITH_TWO_BOUNDS,
            *_RULES_WITH_ONE_BOUND,
            *PROBABILITY_RULES,
            "close",
        )
        if self.bound is not None and self.rule not in rules_with_bound:
            rules = ", ".join(rules_with_bound)
            raise ValueError(
                f"the rule {self.rule!r} uses no bound; leave bound out, or take one of {rules}"
            )
        if self.a == self.b:
            raise ValueError(
                f"a and b are the same condition, {self.a!r}; b must be another, or 'first' for "
                "its first generations"
            )
        return self

    @model_validator(mode="after")
    def _require_keys_of_rule(self) -> Self:
        # By rule: whether its requirement is met, and the requirement.
        requirements = {
            "greater": (bool(self.b), "a and b"),
            "lower": (bool(self.b), "a and b"),
            "close": (bool(self.b) and isinstance(self.bound, float), "a, b and a bound"),
            "survives_longer": (
                bool(self.b) and not self.paired and self.measure not in COMMON_MEASURES,
                "a and b, a measure of the model, and runs that are not paired",
            ),
            "zero": (self.measure == "most" and not self.b, "the measure 'most', and no b"),
        }
        is_ordered = isinstance(self.bound, tuple) and self.bound[0] <= self.bound[1]
        requirements |= dict.fromkeys(
            _RULES_WITH_TWO_BOUNDS,
            (is_ordered and not self.b, "a bound of two numbers, the lower first, and no b"),
        )
        requirements |= dict.fromkeys(
            _RULES_WITH_ONE_BOUND,
            (isinstance(self.bound, float) and not self.b, "a bound, and no b"),
        )
        is_special_measure = self.measure not in COMMON_MEASURES
        requirements |= dict.fromkeys(
            PROBABILITY_RULES,
            (
                isinstance(self.bound, float) and not self.b and is_special_measure,
                "a measure that is 0 or 1, a bound, and no b",
            ),
        )
        if self.paired and not self.b:
            raise ValueError("paired runs need a and b")
        is_met, requirement = requirements[self.rule]
        if not is_met:
            raise ValueError(f"the rule {self.rule!r} needs {requirement}")
        if self.b == FIRST_GENERATIONS and self.measure not in ("best", "mean", "share"):
            raise ValueError(
                f"the measure {self.measure!r} is of a whole run, so b cannot be 'first'"
            )
        return self

    @property
    def reference(self) -> str:
        """Return the name of the condition or bound with which `a` is compared."""
        if not self.b:
            return self.limit
        return f"{self.a}, first generations" if self.b == FIRST_GENERATIONS else self.b

    @property
    def limit(self) -> str:
        """Return the bound as text."""
        if isinstance(self.bound, tuple):
            low, high = self.bound
            return f"{low:g} to {high:g}"
        return f"{self.bound or 0:g}"

    @property
    def conditions(self) -> set[str]:
        return {self.a, self.b} - {"", FIRST_GENERATIONS}


class OpenChoice(DeclaredTable):
    """A choice that the paper leaves open."""

    # Key in the file.
    id: str = ""
    # Setting of the experiment, for example senses.visual_radius.
    field: str
    text: str


class Claim(DeclaredTable):
    """A claim of a paper, with the comparisons that decide it."""

    id: str
    title: str
    text: str = Field(alias="claim")
    decided_by: Rule | None = Field(None, alias="rule")
    # Statement of the paper or of another source; "" for a question of this study.
    paper: str = ""
    # By default, "paper" for a statement of a paper, else "own".
    kind: Kind = Field(default_factory=lambda claim: "paper" if claim.get("paper") else "own")
    # Number in the paper with which the measured effect is compared.
    paper_value: float | None = Field(None, alias="figure")
    # Choices that could cause a difference, the most likely first.
    choices: tuple[OpenChoice, ...] = ()
    comparisons: tuple[ClaimComparison, ...] = Field(min_length=1)

    @field_validator("choices", mode="before")
    @classmethod
    def _find_choices(cls, names: Any, info: ValidationInfo) -> Any:
        choices: Mapping[str, OpenChoice] = info.context or {}
        if not isinstance(names, list):
            return names
        for name in names:
            if name not in choices:
                raise ValueError(f"there is no choice {name!r}{suggest(name, choices)}")
        return [choices[name] for name in names]

    @field_validator("comparisons", mode="before")
    @classmethod
    def _add_rule(cls, comparisons: Any, info: ValidationInfo) -> Any:
        rule = info.data.get("decided_by")
        if not rule or not isinstance(comparisons, list):
            return comparisons
        has_only_tables = all(isinstance(row, dict) for row in comparisons)
        return [{"rule": rule} | row for row in comparisons] if has_only_tables else comparisons

    @property
    def of_paper(self) -> bool:
        """Return whether the claim is a statement of a paper, from which a result can differ."""
        has_value = self.paper_value is not None
        return bool(self.paper or self.choices) or has_value

    @property
    def rule(self) -> str:
        """Return the rules of the verdict as text."""
        bounds = {comparison.rule: comparison.limit for comparison in self.comparisons}
        return " And: ".join(RULES[rule].format(bound=bound) for rule, bound in bounds.items())

    @property
    def conditions(self) -> set[str]:
        return set().union(*(comparison.conditions for comparison in self.comparisons))


class _Choices(DeclaredTable):
    choices: dict[str, OpenChoice]


class _Claims(DeclaredTable):
    claims: tuple[Claim, ...]


def read_claims(path: Path) -> tuple[Claim, ...]:
    """Return the claims in a file; an empty tuple if it does not exist. Raises PaperError."""
    if not path.exists():
        return ()
    tree = read_tables(path)
    choices_tree = {"choices": tree.pop("choices", {})}
    tables = validate_tables(_Choices, choices_tree, path).choices
    choices = {name: choice.model_copy(update={"id": name}) for name, choice in tables.items()}
    claims = validate_tables(_Claims, tree, path, choices).claims
    ids = [claim.id for claim in claims]
    if repeated := [name for name in ids if ids.count(name) > 1]:
        raise PaperError(f"{path}: two claims have the id {repeated[0]!r}")
    return claims
