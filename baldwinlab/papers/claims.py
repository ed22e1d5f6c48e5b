"""What a paper claims, as data: `claims.toml` in its folder, whose head in `le_2019` says what each key is."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal, Self

from pydantic import Field, ValidationInfo, field_validator, model_validator

from baldwinlab.core.suggestions import suggest
from baldwinlab.papers.loading import Declared, PaperError, declared, read

FIRST = "first"  # in place of a condition: the same one, in its first generations

Rule = Literal[
    "greater", "lower", "close", "survives_longer", "zero",
    "at_least", "within", "mean_within", "mean_at_most", "every_at_most", "every_at_least",
]  # fmt: skip
OF_ALL = (
    "best",
    "mean",
    "share",
    "most",
)  # what can be measured of any model; a model has `measures` of its own

RULES: Mapping[Rule, str] = {
    "greater": "Holds if every comparison has a corrected p below 0.05 and the first condition is the higher, in the median and "
    "in A12; does not hold if in any comparison it is significantly the lower; else undecided.",
    "lower": "Holds if every comparison has a corrected p below 0.05 and the first condition is the lower, in the median and in "
    "A12; does not hold if in any comparison it is significantly the higher; else undecided.",
    "close": "Holds if the 95 % interval of the difference lies within {bound} of 0; does not hold if it lies wholly beyond; "
    "else undecided.",
    "survives_longer": "Holds if every comparison has a corrected p of the log-rank test below 0.05 and the first lasts "
    "longer, in it and in the restricted mean; does not hold if in any comparison it lasts significantly shorter; else "
    "undecided. Runs that live on when they are left alone are censored.",
    "zero": "Holds if no agent ate a single item in any run and any generation; else does not hold.",
    "at_least": "Holds if the 95 % interval of the median over runs lies at or above {bound}; does not hold if it lies wholly "
    "below; else undecided.",
    "within": "Holds if the 95 % interval of the median over runs lies in {bound}; does not hold if it lies wholly outside; else "
    "undecided.",
    "mean_within": "Holds if the mean over runs lies in {bound}; else does not hold.",
    "mean_at_most": "Holds if the mean over runs is at most {bound}; else does not hold.",
    "every_at_most": "Holds if it is at most {bound} in every run; else does not hold.",
    "every_at_least": "Holds if it is at least {bound} in every run; else does not hold.",
}
_BETWEEN: tuple[Rule, ...] = ("within", "mean_within")
_BOUNDED: tuple[Rule, ...] = ("at_least", "mean_at_most", "every_at_most", "every_at_least")


class Comparison(Declared):
    """What is held against what. Without `b`, `a` is held against `bound`."""

    a: str = Field(min_length=1)
    measure: str  # one of `OF_ALL`, or of the measures of the condition's model
    rule: Rule
    b: str = ""
    paired: bool = False  # whether runs of the same number are held against each other: where they share a landscape, say
    bound: float | tuple[float, float] | None = None

    @field_validator("a")
    @classmethod
    def _names_a_condition(cls, name: str) -> str:
        if name == FIRST:
            raise ValueError("'first' is allowed for b only; a must name a condition")
        return name

    @model_validator(mode="after")
    def _has_no_idle_key(self) -> Self:
        with_bound = (*_BETWEEN, *_BOUNDED, "close")
        if self.bound is not None and self.rule not in with_bound:
            rules = ", ".join(with_bound)
            raise ValueError(
                f"the rule {self.rule!r} uses no bound; leave bound out, or take one of {rules}"
            )
        if self.a == self.b:
            raise ValueError(
                f"a and b are the same condition, {self.a!r}; b must be another, or 'first' for its first generations"
            )
        return self

    @model_validator(mode="after")
    def _can_be_decided(self) -> Self:
        needs = {
            "greater": (bool(self.b), "b beside a"),
            "lower": (bool(self.b), "b beside a"),
            "close": (bool(self.b) and isinstance(self.bound, float), "b beside a, and a bound"),
            "survives_longer": (
                bool(self.b) and not self.paired and self.measure not in OF_ALL,
                "b beside a, a measure of the model's own, and runs that are not paired",
            ),
            "zero": (self.measure == "most" and not self.b, "the measure 'most', and no b"),
        }
        ordered = isinstance(self.bound, tuple) and self.bound[0] <= self.bound[1]
        needs |= dict.fromkeys(
            _BETWEEN, (ordered and not self.b, "a bound of two numbers, the lower first, and no b")
        )
        needs |= dict.fromkeys(
            _BOUNDED, (isinstance(self.bound, float) and not self.b, "a bound, and no b")
        )
        if self.paired and not self.b:
            raise ValueError("paired runs need b beside a")
        met, what = needs[self.rule]
        if not met:
            raise ValueError(f"the rule {self.rule!r} needs {what}")
        if self.b == FIRST and self.measure not in ("best", "mean", "share"):
            raise ValueError(
                f"the measure {self.measure!r} is of a whole run, so b cannot be 'first'"
            )
        return self

    @property
    def other(self) -> str:
        """What `a` is held against, in words."""
        if not self.b:
            return self.limit
        return f"{self.a}, first generations" if self.b == FIRST else self.b

    @property
    def limit(self) -> str:
        """The bound, in words."""
        return (
            f"{self.bound[0]:g} to {self.bound[1]:g}"
            if isinstance(self.bound, tuple)
            else f"{self.bound or 0:g}"
        )

    @property
    def conditions(self) -> set[str]:
        return {self.a, self.b} - {"", FIRST}


class Choice(Declared):
    """What the paper leaves open."""

    id: str = ""  # its key in the file
    field: str  # where an experiment holds it, such as senses.visual_radius
    text: str


class Claim(Declared):
    id: str
    title: str
    text: str = Field(alias="claim")
    decided_by: Rule | None = Field(None, alias="rule")
    paper: str = ""  # what it says, or what another source says; "" where it is a question of the study's own
    figure: float | None = None
    choices: tuple[Choice, ...] = ()  # that could account for a difference, the likeliest first
    comparisons: tuple[Comparison, ...] = Field(min_length=1)

    @field_validator("choices", mode="before")
    @classmethod
    def _named(cls, names: Any, info: ValidationInfo) -> Any:
        known: Mapping[str, Choice] = info.context or {}
        for name in names if isinstance(names, list) else ():
            if name not in known:
                raise ValueError(f"there is no choice {name!r}{suggest(name, known)}")
        return [known[name] for name in names] if isinstance(names, list) else names

    @field_validator("comparisons", mode="before")
    @classmethod
    def _under_its_rule(cls, comparisons: Any, info: ValidationInfo) -> Any:
        rule = info.data.get("decided_by")
        tables = isinstance(comparisons, list) and all(isinstance(one, dict) for one in comparisons)
        return [{"rule": rule} | one for one in comparisons] if tables and rule else comparisons

    @property
    def of_paper(self) -> bool:
        """Whether it says what a paper found, which a result can then differ from."""
        return bool(self.paper or self.choices) or self.figure is not None

    @property
    def rule(self) -> str:
        """What decides it, in words."""
        used = {comparison.rule: comparison.limit for comparison in self.comparisons}
        return " And: ".join(RULES[rule].format(bound=bound) for rule, bound in used.items())

    @property
    def conditions(self) -> set[str]:
        return set().union(*(comparison.conditions for comparison in self.comparisons))


class _Choices(Declared):
    choices: dict[str, Choice]


class _Claims(Declared):
    claims: tuple[Claim, ...]


def read_claims(path: Path) -> tuple[Claim, ...]:
    """The claims in a file; none where there is no such file. Raises PaperError."""
    if not path.exists():
        return ()
    tree = read(path)
    named = declared(_Choices, {"choices": tree.pop("choices", {})}, path).choices
    choices = {name: choice.model_copy(update={"id": name}) for name, choice in named.items()}
    claims = declared(_Claims, tree, path, choices).claims
    ids = [claim.id for claim in claims]
    if twice := [name for name in ids if ids.count(name) > 1]:
        raise PaperError(f"{path}: two claims have the id {twice[0]!r}")
    return claims
