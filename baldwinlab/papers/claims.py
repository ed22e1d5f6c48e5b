"""Claims of a paper, read from its `claims.toml`.

The comment at the top of `le_2019/claims.toml` explains the keys.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any, Final, Literal, Self

from pydantic import AfterValidator, Field, ValidationInfo, field_validator, model_validator

from baldwinlab.core.names import suggest
from baldwinlab.papers.loading import DeclaredTable, PaperError, read_tables, validate_tables
from baldwinlab.papers.rules import RULES, Bound

# With this value of `b`, the condition `a` is compared with its own first generations.
FIRST_GENERATIONS = "first"

Kind = Literal["paper", "implementation", "own", "exploratory"]
EXPLORATORY: Final[Kind] = "exploratory"
KINDS: Mapping[Kind, tuple[str, str]] = {
    "paper": ("claim of the paper", "claims of the paper"),
    "implementation": ("check of the implementation", "checks of the implementation"),
    "own": ("own question", "own questions"),
    EXPLORATORY: ("exploratory claim", "exploratory claims"),
}
"""The singular and plural names of the kinds of claims.

- paper: a statement of the paper.
- implementation: agreement with an exact result, or with an independent implementation.
- own: a question of this project.
- exploratory: a claim that was restated after results were known, for example with another bound.

Verdicts are counted by kind, and never added over kinds. Those of exploratory claims are not
counted.
"""
# Measures of every model: "most" is the largest number of items of an agent in any generation. A
# model can have more measures in `measures`.
COMMON_MEASURES = ("best", "mean", "share", "most", "unseen-maps")
# Measure of the assay of the same name: the mean over agents and maps.
UNSEEN_MAPS_MEASURE = "unseen-maps"


def _check_rule(name: str) -> str:
    if name not in RULES:
        raise ValueError(f"{name!r} is not a rule; allowed are {', '.join(RULES)}")
    return name


RuleName = Annotated[str, AfterValidator(_check_rule)]


class ClaimComparison(DeclaredTable):
    """Comparison of the condition `a` with the condition `b`, or with `bound` without `b`."""

    a: str = Field(min_length=1)
    # One of `COMMON_MEASURES`, or a measure of the condition's model.
    measure: str
    rule: RuleName
    b: str = ""
    # Compare runs pair by pair, run 0 with run 0, for example because a pair shares a landscape.
    paired: bool = False
    bound: Bound = None

    @field_validator("a")
    @classmethod
    def _refuse_first_generations(cls, name: str) -> str:
        if name == FIRST_GENERATIONS:
            raise ValueError("'first' is allowed for b only; a must name a condition")
        return name

    @model_validator(mode="after")
    def _refuse_unused_keys(self) -> Self:
        if self.bound is not None and not RULES[self.rule].n_bounds:
            rules = ", ".join(name for name, rule in RULES.items() if rule.n_bounds)
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
        if self.paired and not self.b:
            raise ValueError("paired runs need a and b")
        requirements = [*self._list_requirements()]
        if not all(is_met for is_met, _ in requirements):
            *texts, last = [text for _, text in requirements]
            needed = f"{', '.join(texts)}, and {last}" if texts else last
            raise ValueError(f"the rule {self.rule!r} needs {needed}")
        if self.b == FIRST_GENERATIONS and self.measure not in ("best", "mean", "share"):
            raise ValueError(
                f"the measure {self.measure!r} is of a whole run, so b cannot be 'first'"
            )
        return self

    def _list_requirements(self) -> Iterator[tuple[bool, str]]:
        """Yield each requirement of the rule: whether it is met, and its description."""
        rule = RULES[self.rule]
        is_model_measure = self.measure not in COMMON_MEASURES
        if rule.has_reference:
            yield bool(self.b), "a and b"
        if rule.kind == "survival":
            yield is_model_measure, "a measure of the model"
            yield not self.paired, "runs that are not paired"
        if rule.statistic == "probability":
            yield is_model_measure, "a measure that is 0 or 1"
        if rule.n_bounds == 1:
            yield isinstance(self.bound, float), "a bound"
        if rule.n_bounds == 2:
            is_ordered = isinstance(self.bound, tuple) and self.bound[0] <= self.bound[1]
            yield is_ordered, "a bound of two numbers, the lower first"
        if self.rule == "zero":
            yield self.measure == "most", "the measure 'most'"
        if not rule.has_reference:
            yield not self.b, "no b"

    @property
    def reference(self) -> str:
        """Return the name of `b`, or the bound as text: `a` is compared with one of them."""
        if not self.b:
            return self.limit
        return f"{self.a}, first generations" if self.b == FIRST_GENERATIONS else self.b

    @property
    def limit(self) -> str:
        """Return the bound as text, such as "0.5" or "0.2 to 0.4"."""
        if isinstance(self.bound, tuple):
            low, high = self.bound
            return f"{low:g} to {high:g}"
        return f"{self.bound or 0:g}"

    @property
    def conditions(self) -> set[str]:
        return {self.a, self.b} - {"", FIRST_GENERATIONS}


class OpenChoice(DeclaredTable):
    """A choice that the paper leaves open."""

    # Key of the choice in the file, for example "R1".
    id: str = ""
    # Setting of the experiment, for example senses.visual_radius.
    field: str
    text: str


class Claim(DeclaredTable):
    """A claim of a paper, with the comparisons that decide it."""

    id: str
    title: str
    text: str = Field(alias="claim")
    decided_by: RuleName | None = Field(None, alias="rule")
    # Statement of the paper or of another source, or "" for an own question.
    paper: str = ""
    # By default, "paper" for a statement of a paper, else "own".
    kind: Kind = Field(default_factory=lambda claim: "paper" if claim.get("paper") else "own")
    # Effect in the paper, with which the measured effect is compared.
    paper_value: float | None = Field(None, alias="figure")
    # Open choices that could cause a difference from the paper, the most likely first.
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
        return bool(self.paper or self.choices or self.paper_value is not None)

    @property
    def rule(self) -> str:
        """Return the rules of the verdict as text."""
        bounds = {comparison.rule: comparison.limit for comparison in self.comparisons}
        return " And: ".join(RULES[rule].text.format(bound=bound) for rule, bound in bounds.items())

    @property
    def conditions(self) -> set[str]:
        return set().union(*(comparison.conditions for comparison in self.comparisons))


class _Choices(DeclaredTable):
    choices: dict[str, OpenChoice]


class _Claims(DeclaredTable):
    claims: tuple[Claim, ...]


def read_claims(path: Path) -> tuple[Claim, ...]:
    """Return the claims in a file, or () if there is no file. Raises PaperError."""
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
