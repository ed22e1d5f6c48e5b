"""Tables of settings that the experiments of all models have."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from baldwinlab.core.names import CONDITION_NAME
from baldwinlab.experiment.fields import Fields, refuse_fields
from baldwinlab.experiment.file import File
from baldwinlab.experiment.registry import PartChoice
from baldwinlab.experiment.species import SPECIES_FIELD, Species, find_species_faults

SHARE_TOLERANCE = 1e-9
"""Allowed difference between 1 and the sum of shares, because of rounding."""

Name = Annotated[
    str,
    Field(
        pattern=CONDITION_NAME,
        max_length=200,
        description="Name of the condition, in results and figures.",
    ),
]

ModelName = Annotated[str, PartChoice("model")]


class Population(Fields):
    size: int = Field(20, ge=1, le=1_000_000, description="Number of agents per generation (R6).")
    species: tuple[Species, ...] = SPECIES_FIELD

    @model_validator(mode="after")
    def _require_valid_species(self) -> Self:
        refuse_fields(find_species_faults(self.species, self.size))
        return self


class Founders(File):
    """File with genomes for a share of the first generation."""

    share: float = Field(
        1.0, gt=0, le=1, description="Share of the first generation that gets these genomes."
    )


class Evolution(Fields):
    generations: int = Field(100, ge=1, le=1_000_000, description="Number of generations per run.")
    inheritance: Annotated[str, PartChoice("inheritance")] = Field(
        "darwinian",
        description=(
            "Inheritance. darwinian: the genome at birth is inherited; none: all "
            "weights are drawn again in each generation."
        ),
    )
    lamarckian_share: float = Field(
        0.0,
        ge=0,
        le=1,
        description=(
            "Share of the learned weight change that is inherited. 0: Darwinian; 1: Lamarckian."
        ),
    )
    selection: Annotated[str, PartChoice("selection")] = Field(
        "roulette",
        description=(
            "Selection of parents: roulette, tournament of 2, truncation to the "
            "fitter half, linear rank (R4), or neutral (random)."
        ),
    )
    elite: int = Field(
        0,
        ge=0,
        le=1_000_000,
        description=("Number of the fittest agents that survive and replace as many children."),
    )
    compete: Literal["within", "across"] = Field(
        "within",
        description=(
            "Selection with several species. within: each species separately, at constant size; "
            "across: one selection over all agents, and the sizes change."
        ),
    )
    variation: Annotated[str, PartChoice("variation")] = Field(
        "crossover",
        description=(
            "Variation operator. crossover: each weight from either parent, then mutation."
        ),
    )
    fitness: Annotated[str, PartChoice("fitness")] = Field(
        "energy",
        description="Fitness. energy: energy of the eaten items, or payoff of the model, "
        "minus the cost of learning, and at least 0.",
    )
    stop: Annotated[str, PartChoice("stop")] = Field(
        "none",
        description="Condition under which a run ends before its last generation. none: no early "
        "end.",
    )
    mutation_gate: Literal["weight", "child"] = Field(
        "weight",
        description=(
            "Decision about mutation. weight: for each weight; child: once for all "
            "weights of a child (R5)."
        ),
    )
    mutation_rate: float = Field(
        0.05,
        ge=0,
        le=1,
        description="Probability of a mutation, per weight or per child.",
    )
    mutation_size: float = Field(
        0.05,
        ge=0,
        le=1000,
        description="Size of a mutation, which adds U(-size, size) to a weight.",
    )

    founders: tuple[Founders, ...] = Field(
        (),
        max_length=16,
        description=(
            "Genome files of the first generation, with shares that add up to 1. "
            "[]: random genomes."
        ),
    )

    @model_validator(mode="after")
    def _require_shares_of_one(self) -> Self:
        shares = [entry.share for entry in self.founders]
        total = sum(shares)
        if self.founders and abs(total - 1) > SHARE_TOLERANCE:
            refuse_fields([("founders", shares, "the shares must add up to 1")])
        return self


class Record(Fields):
    genome_every: int = Field(
        1,
        ge=1,
        le=1_000_000,
        description=(
            "Interval in generations at which genomes are stored. The last generation"
            " is always stored."
        ),
    )
