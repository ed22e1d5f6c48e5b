"""Oracles in plain Python: senses."""

from __future__ import annotations

import math
from copy import copy
from typing import Any

from baldwinlab.models.miniworld.senses.other_agents import N_SECTORS
from baldwinlab.models.miniworld.senses.rays import RAY_DEGREES
from baldwinlab.models.miniworld.state import FOOD


def compute_patch_sight(part: Any, agent: Any, items: Any, naive: Any) -> Any:
    return naive.visible_sectors(agent, [item for item in items if item.kind == "patch"])


def compute_neighbours(part: Any, agent: Any, items: Any, naive: Any) -> Any:
    return naive.visible_sectors(agent, agent.other_agents)


def compute_last_action(part: Any, agent: Any, items: Any, naive: Any) -> Any:
    """Return which action was last. `agent.arrays` is empty at birth and persists during life."""
    is_newborn = not agent.arrays
    agent.arrays["alive"] = True
    return [not is_newborn and agent.action == action for action in range(3)]


def compute_touch(part: Any, agent: Any, items: Any, naive: Any) -> Any:
    previous_position = agent.arrays.get("previous_position")
    agent.arrays["previous_position"] = (agent.x, agent.y)
    return [previous_position == (agent.x, agent.y)]


def compute_compass(part: Any, agent: Any, items: Any, naive: Any) -> Any:
    quarter = int((agent.heading + 45) % 360 // 90)
    return [quarter == number for number in range(4)]


def compute_food_rays(part: Any, agent: Any, items: Any, naive: Any) -> Any:
    food = [item for item in items if item.kind == FOOD]
    rays = zip(part.sine[: part.n_inputs], part.cosine[: part.n_inputs], strict=True)
    degrees = [math.degrees(math.atan2(sine, cosine)) for sine, cosine in rays]
    return _compute_rays(degrees, part.item_radius, agent, food, naive)


def compute_rays(part: Any, agent: Any, items: Any, naive: Any) -> Any:
    targets = [item for item in items if item.kind == naive.kinds[part.number]]
    return _compute_rays(RAY_DEGREES, part.item_radius, agent, targets, naive)


def _compute_rays(degrees: Any, item_radius: float, agent: Any, items: Any, naive: Any) -> Any:
    """Return one input per ray: 1 - distance of the first item on the ray / visual radius."""
    visual_radius = float(naive.visual_radius)

    def ray_input(ray_degrees: float) -> float:
        nearest = visual_radius
        for item in items:
            distance = naive.distance(agent, item)
            angle = math.radians(naive.bearing(agent, item) - ray_degrees)
            is_on_line = abs(distance * math.sin(angle)) <= item_radius
            if is_on_line and (math.cos(angle) >= 0 or distance <= item_radius):
                nearest = min(nearest, distance)
        return 1 - nearest / visual_radius

    return [ray_input(ray_degrees) for ray_degrees in degrees]


def compute_nearest(part: Any, agent: Any, items: Any, naive: Any) -> Any:
    visible_items = [
        item
        for item in items
        if item.kind == naive.kinds[part.number]
        and naive.distance(agent, item) <= naive.visual_radius
    ]
    if not visible_items:
        return [0, 1]
    nearest = min(visible_items, key=lambda item: naive.distance(agent, item))
    return [
        naive.bearing(agent, nearest) / 360,
        naive.distance(agent, nearest) / naive.visual_radius,
    ]


def compute_smell(part: Any, agent: Any, items: Any, naive: Any) -> Any:
    smells = []
    for side in (-90, 90):
        nostril = copy(agent)
        nostril.heading = agent.heading + side
        naive.advance(nostril, float(part.nostril_distance))
        relative_distances = [
            naive.distance(nostril, item) / float(part.reach)
            for item in items
            if item.kind == naive.kinds[part.number]
        ]
        strength = sum((1 - distance**2) ** 2 for distance in relative_distances if distance < 1)
        smells.append(strength / (1 + strength))
    return smells


def compute_energy_sense(part: Any, agent: Any, items: Any, naive: Any) -> Any:
    gained_energy = max(0.0, agent.gained_in_life)
    return [gained_energy / (gained_energy + float(part.half_saturation))]


def compute_sight(part: Any, agent: Any, items: Any, naive: Any) -> Any:
    return naive.visible_sectors(agent, [item for item in items if item.kind == FOOD])


def compute_species_in_sight(part: Any, agent: Any, items: Any, naive: Any) -> Any:
    # A check of a part has one species.
    return [False] * N_SECTORS


def compute_species_nearness(part: Any, agent: Any, items: Any, naive: Any) -> Any:
    # A check of a part has one species.
    return [0.0] * N_SECTORS
