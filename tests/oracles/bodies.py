"""Oracles in plain Python: bodies and walls."""

from __future__ import annotations

from typing import Any


def move_grid(part: Any, agent: Any, naive: Any) -> None:
    agent.action = agent.outputs.index(max(agent.outputs))
    agent.heading = 90 * agent.action
    naive.advance(agent, 2)


def move_continuous(part: Any, agent: Any, naive: Any) -> None:
    left, right = agent.outputs
    agent.action = int(right > left)
    agent.heading += 9 * round((left - right) * float(part.max_turn) / 9)
    naive.advance(agent, left + right)


def move_walker(part: Any, agent: Any, naive: Any) -> None:
    """Move a walker, or a body `stay`, which has a fourth action."""
    agent.action = agent.outputs.index(max(agent.outputs))
    degrees = (-9, 0, 9, 0)[agent.action]
    distance = (1, 2, 1, 0)[agent.action]
    agent.heading += degrees
    naive.advance(agent, distance)


def compute_walls(part: Any, x: Any, y: Any, dx: Any, dy: Any) -> Any:
    """Return the result of each hook.

    A line from (x, y) to (x + dx, y + dy) crosses a wall, except in two cases: the line is
    completely on one side of the wall, or all corners of the wall are on one side of the line.
    """
    walls = [[float(edge) for edge in wall] for wall in part.edges]

    def crosses(left: float, right: float, upper: float, lower: float) -> bool:
        is_left_or_right = max(x, x + dx) < left or min(x, x + dx) > right
        is_above_or_below = max(y, y + dy) < upper or min(y, y + dy) > lower
        sides = [dx * (b - y) - dy * (a - x) for a in (left, right) for b in (upper, lower)]
        return not (is_left_or_right or is_above_or_below) and min(sides) <= 0 <= max(sides)

    is_inside = any(
        left <= x <= right and upper <= y <= lower
        for left, right, upper, lower in walls[: part.count]
    )
    return {
        "blocks_placement": is_inside,
        "blocks_movement": is_inside,
        "blocks_sight": any(crosses(*wall) for wall in walls),
    }
