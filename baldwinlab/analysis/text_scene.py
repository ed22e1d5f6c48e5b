"""A lifetime as text: map, items, agents and meals of a step, for terminals."""

from __future__ import annotations

from itertools import groupby
from typing import Final, NamedTuple

import numpy as np
from rich.text import Text

from baldwinlab.analysis.agent_symbols import list_symbol_numbers, list_symbols
from baldwinlab.analysis.palette import resolve_color
from baldwinlab.analysis.scene import FLASH_STEPS, Scene
from baldwinlab.analysis.traces import read_appearance
from baldwinlab.core.sparkline import draw_sparkline

# Agents by heading, clockwise from the right, in steps of 45 degrees.
ARROWS: Final = "→↘↓↙←↖↑↗"
ITEM: Final = "▪"
MEAL: Final = "✶"
REGION: Final = "·"
OBSTACLE: Final = "█"
# A character is about twice as high as it is wide.
HEIGHT_BY_WIDTH: Final = 2.0
# Lines of the frame besides the rows of the map.
FURTHER_LINES: Final = 6
MIN_ROWS: Final = 6
MEAL_STYLE: Final = "bold green"


class Cell(NamedTuple):
    """A character of the map."""

    character: str
    style: str


EMPTY: Final = Cell(" ", "")


class TextScene:
    """A lifetime as text, step by step.

    Parameters
    ----------
    scene
        The lifetime and the size of its map.
    width, height
        The space for a frame, in characters.
    """

    def __init__(self, scene: Scene, width: int, height: int) -> None:
        trace = scene.trace
        self.n_steps = trace.sizes["step"]
        self.title = (
            f"{trace.attrs['condition']}, run {trace.attrs['run']}, "
            f"generation {trace.attrs['generation']}"
        )
        self._appearance = read_appearance(trace)
        # Items per agent eaten up to each step, [step, agent].
        self._eaten = trace["eaten"].values.cumsum(axis=0)
        self._is_alive = np.isfinite(trace["x"].values)
        rows = max(MIN_ROWS, height - FURTHER_LINES)
        rows = min(rows, int((width - 2) * scene.height / scene.width / HEIGHT_BY_WIDTH))
        columns = int(rows * HEIGHT_BY_WIDTH * scene.width / scene.height)
        self._shape = (rows, columns)
        self._map_size = (scene.width, scene.height)
        # [step, agent] and [step, item]
        self._agent_cells = self._locate(trace["x"].values, trace["y"].values)
        self._item_cells = self._locate(trace["item_x"].values, trace["item_y"].values)
        directions = np.nan_to_num(trace["heading"].values / 45).round().astype(int)
        self._directions = directions % len(ARROWS)
        symbols = list_symbols(trace)
        self._colors = [symbols[number].fill for number in list_symbol_numbers(trace)]
        self._background = self._draw_background()

    def _locate(
        self, x: np.ndarray, y: np.ndarray
    ) -> tuple[np.ndarray[tuple[int, ...]], np.ndarray[tuple[int, ...]]]:
        """Return the rows and columns of positions."""
        rows, columns = self._shape
        width, height = self._map_size
        row = np.nan_to_num(y * rows / height).astype(int).clip(0, rows - 1)
        column = np.nan_to_num(x * columns / width).astype(int).clip(0, columns - 1)
        return row, column

    def _draw_background(self) -> list[list[Cell]]:
        """Return the cells of the regions of items and of the obstacles."""
        rows, columns = self._shape
        cells = [[EMPTY] * columns for _ in range(rows)]
        for mark in self._appearance["marks"]:
            is_region = mark["kind"] == "rectangle"
            if not (is_region or mark["solid"]):
                continue
            corners = (
                (mark["x"], mark["x"] + mark["width"]),
                (mark["y"], mark["y"] + mark["height"]),
            )
            (top, bottom), (left, right) = self._locate(np.array(corners[0]), np.array(corners[1]))
            style = resolve_color(mark["color"])
            cell = Cell(OBSTACLE, style) if mark["solid"] else Cell(REGION, f"dim {style}")
            for row in range(top, bottom + 1):
                cells[row][left : right + 1] = [cell] * (right + 1 - left)
        return cells

    def draw(self, step: int) -> Text:
        """Return the frame of a step.

        Parameters
        ----------
        step
            Number of the step, from 0.
        """
        cells = [list(row) for row in self._background]
        self._place_items(cells, step)
        self._place_agents(cells, step)
        columns = self._shape[1]
        lines = [Text(self.title, style="bold"), Text(f"┌{'─' * columns}┐", style="dim")]
        for row in cells:
            line = Text("│", style="dim")
            for style, group in groupby(row, key=lambda cell: cell.style):
                line.append("".join(cell.character for cell in group), style or "none")
            lines.append(line.append("│"))
        lines.append(Text(f"└{'─' * columns}┘", style="dim"))
        lines += [Text(self.describe(step)), self._draw_time_line(step)]
        return Text("\n").join(lines)

    def _place_items(self, cells: list[list[Cell]], step: int) -> None:
        rows, columns = self._item_cells
        start = 0
        # Items of a kind are next to each other, in the order of the kinds.
        for kind in self._appearance["item_kinds"]:
            cell = Cell(ITEM, resolve_color(kind["color"]))
            for item in range(start, start + kind["number"]):
                cells[rows[step, item]][columns[step, item]] = cell
            start += kind["number"]

    def _place_agents(self, cells: list[list[Cell]], step: int) -> None:
        """Place living agents: dim before the first meal, and a star for some steps after each."""
        eaten = self._eaten[step]
        eaten_before = self._eaten[step - FLASH_STEPS] if step >= FLASH_STEPS else 0
        is_eating = eaten > eaten_before
        rows, columns = self._agent_cells
        # An agent that eats is drawn over the others.
        for agent in sorted(
            np.flatnonzero(self._is_alive[step]), key=lambda agent: is_eating[agent]
        ):
            arrow = ARROWS[self._directions[step, agent]]
            style = f"bold {self._colors[agent]}" if eaten[agent] else f"dim {self._colors[agent]}"
            cell = Cell(MEAL, MEAL_STYLE) if is_eating[agent] else Cell(arrow, style)
            cells[rows[step, agent]][columns[step, agent]] = cell

    def describe(self, step: int) -> str:
        """Return the step, the number of eaten items, and the agents that ate and live.

        Parameters
        ----------
        step
            Number of the step, from 0.
        """
        eaten = self._eaten[step]
        n_alive = int(self._is_alive[step].sum())
        alive = "" if n_alive == len(eaten) else f", {n_alive} alive"
        return (
            f"step {step + 1:,} of {self.n_steps:,}: {int(eaten.sum()):,} eaten, "
            f"{int((eaten > 0).sum())} of {len(eaten)} agents ate{alive}"
        )

    def _draw_time_line(self, step: int) -> Text:
        """Return the meals of the lifetime over time. The part after the step is dim."""
        meals = np.diff(self._eaten.sum(axis=1), prepend=0)
        curve = draw_sparkline(meals.tolist(), self._shape[1])
        n_past = round(len(curve) * (step + 1) / self.n_steps)
        return Text.assemble((curve[:n_past], "green"), (curve[n_past:], "dim"))
