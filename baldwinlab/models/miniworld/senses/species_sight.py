"""Senses of agents of other species: three sectors, with binary or real-valued inputs.

An agent senses the positions at the start of the step, within `senses.visual_radius`. The sectors
are those of the sense `food`. The senses are our choice, and have no source.

In an experiment without species, all inputs are 0.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from pydantic import Field

from baldwinlab.engine.phases import Array, per_agent
from baldwinlab.engine.simd import INFINITY, ONE
from baldwinlab.models.miniworld.population import SpeciesScan, see_species
from baldwinlab.models.miniworld.state import MiniWorldModel, State
from baldwinlab.parts.senses import Sense

N_SECTORS = 3


class SpeciesSense(Sense):
    """Base of the senses of agents of other species."""

    target: str = Field(
        "",
        max_length=60,
        description='Name of the sensed species. "": all species but that of the agent.',
    )
    sectors: ClassVar[tuple[tuple[float, float], ...]] = ((315, 345), (345, 15), (15, 45))
    # Distance of the nearest visible agent in each sector.
    arrays: ClassVar[Mapping[str, Array]] = {"distances": per_agent(N_SECTORS)}
    # -1: all other species. A batch with species sets the number of the species `target`.
    derived: ClassVar[Mapping[str, Any]] = {"target_number": lambda part, experiment: -1}


class SpeciesInSight(SpeciesSense, name="species-in-sight"):
    """Three binary inputs: an agent of another species in the left, front and right sector.

    The field `target` names the species.
    """

    inputs: ClassVar[tuple[str, ...]] = ("species left", "species in front", "species right")

    @staticmethod
    def sense(part: Any, model: MiniWorldModel, state: State, world: int, agent: int) -> int:
        see_species(state.population, model, state, SpeciesScan(part, world, agent))
        lane = world * model.agents + agent
        bits = 0
        for sector in range(N_SECTORS):
            if part.distances[sector, lane] < INFINITY:
                bits |= 1 << sector
        return bits


class SpeciesNearness(SpeciesSense, name="species-nearness"):
    """Three real-valued inputs: the nearest agent of another species in each sector.

    The sectors are left, front and right. An input is 1 - distance / `senses.visual_radius`, and 0
    without a visible agent. The field `target` names the species.
    """

    inputs: ClassVar[tuple[str, ...]] = (
        "nearness left",
        "nearness in front",
        "nearness right",
    )
    is_continuous: ClassVar[bool] = True

    @staticmethod
    def measure(part: Any, model: MiniWorldModel, state: State, world: int, agent: int) -> None:
        see_species(state.population, model, state, SpeciesScan(part, world, agent))
        lane = world * model.agents + agent
        for sector in range(N_SECTORS):
            share = min(part.distances[sector, lane] / model.visual_radius, ONE)
            state.activations[part.first_input + sector, lane] = ONE - share
