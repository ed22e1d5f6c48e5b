"""Movies (.mp4 or .gif) of traces: a map with its items, and agents with their trails.

The command `replay`, the lab and the steered worlds write movies and images with this module.
"""

from __future__ import annotations

import errno
import math
import os
import shutil
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from baldwinlab.analysis.appearance import (
    MAX_STEP_LENGTH,
    AgentSymbol,
    blend,
    draw_agent,
    draw_shape,
    list_symbol_numbers,
    list_symbols,
    read_appearance,
)
from baldwinlab.analysis.palette import MOVIE_COLORS, resolve_color
from baldwinlab.core.deferred import xr
from baldwinlab.core.errors import BaldwinLabError
from baldwinlab.core.extras import missing_extra_error
from baldwinlab.core.file_writing import write_atomically
from baldwinlab.core.files import REPLAY_MARK, name_file_in_errors

# Length of the longer side of a map, in pixels.
MAX_SIDE_PIXELS = 640
# Factor by which an image is drawn larger and then reduced, for smooth edges.
OVERSAMPLING = 2
# Length of a trail, and of the highlight of a meal, in time steps.
TRAIL_STEPS = 60
FLASH_STEPS = 24
# Space above a map for its caption, in pixels.
CAPTION_HEIGHT = 44
# Legend of species: top, height of a row, space on the left, and radius of a symbol, in pixels.
LEGEND_TOP = 41
LEGEND_ROW_HEIGHT = 22
LEGEND_INDENT = 8
LEGEND_RADIUS = 6
FONT = ImageFont.load_default(14)
# Half the side of an item, length of an agent, and radius of the highlight of a meal, in map units.
HALF_ITEM_SIDE = 5
AGENT_LENGTH = 8
FLASH_RADIUS = 13
FRAMES_PER_SECOND = 25
MAX_GIF_COLORS = 256
MILLISECONDS_PER_SECOND = 1000
# Free disk space, in bytes, below which a failure means that the disk is full.
FULL_DISK_BYTES = 2**20
# Longest duration of a movie, in seconds. A movie of a longer lifetime skips steps.
MAX_SECONDS = 20
# Space between two scenes, in pixels.
SCENE_GAP = 4


class Scene(NamedTuple):
    """A trace and the size of its map."""

    trace: xr.Dataset  # A lifetime, from `replay`.
    # The size of the map, in map units.
    width: float
    height: float
    first_step: int = 0  # Index of the first step of the trace in the lifetime.
    # Number of steps of the lifetime. None: the trace is the complete lifetime.
    n_steps: int | None = None


class SceneRenderer:
    """Renderer of a scene, step by step, with the symbols of the lab."""

    def __init__(self, scene: Scene) -> None:
        self.trace = scene.trace
        self.first_step = scene.first_step
        self.n_steps = scene.n_steps or self.trace.sizes["step"]
        self.appearance = read_appearance(self.trace)
        # [step, agent]: positions in map units, NaN after death, and headings in degrees.
        self.x = self.trace.x.values
        self.y = self.trace.y.values
        self.heading = self.trace.heading.values
        # The number of items eaten up to each step, [step, agent].
        self.eaten = self.trace.eaten.values.cumsum(axis=0)
        # [step, item], in map units.
        self.item_x = self.trace.item_x.values
        self.item_y = self.trace.item_y.values
        # Pixels of the oversampled image per map unit.
        self.scale = MAX_SIDE_PIXELS * OVERSAMPLING / max(scene.width, scene.height)
        # (width, height) in pixels of the video, which needs even numbers.
        self.size = tuple(
            2 * round(side * self.scale / OVERSAMPLING / 2) for side in (scene.width, scene.height)
        )
        self.symbols = list_symbols(self.trace)
        # [agent]
        self.symbol_numbers = list_symbol_numbers(self.trace)
        # [step, agent]. Dead agents have no position.
        self.is_alive = np.isfinite(self.x)
        self.legend = self._arrange_legend()
        n_rows = max((row for row, _, _ in self.legend), default=-1) + 1
        self.map_top = CAPTION_HEIGHT + n_rows * LEGEND_ROW_HEIGHT
        self.background = self._draw_background()

    def frame(self, step: int) -> Image.Image:
        """Draw a step, or the last step if the scene is shorter."""
        last_step = self.trace.sizes["step"] - 1
        step = min(step, last_step)
        image = self.background.copy()
        draw = ImageDraw.Draw(image)
        self._draw_trails(draw, step)
        self._draw_items(draw, step)
        self._draw_agents(draw, step)
        width, height = self.size
        frame = Image.new("RGB", (width, height + self.map_top), MOVIE_COLORS["background"])
        frame.paste(image.reduce(OVERSAMPLING), (0, self.map_top))
        draw = ImageDraw.Draw(frame)
        self._draw_caption(draw, step)
        self._draw_legend(draw, step)
        return frame

    def _draw_background(self) -> Image.Image:
        """Draw the immobile marks: regions of items, the birth disc and obstacles."""
        width, height = self.size
        size = (width * OVERSAMPLING, height * OVERSAMPLING)
        image = Image.new("RGB", size, MOVIE_COLORS["background"])
        draw = ImageDraw.Draw(image)
        for mark in self.appearance["marks"]:
            left = mark["x"] * self.scale
            top = mark["y"] * self.scale
            right = left + mark["width"] * self.scale
            bottom = top + mark["height"] * self.scale
            box = (left, top, right, bottom)
            color = resolve_color(mark["color"])
            is_disc = mark["kind"] == "disc"
            draw_shape = draw.ellipse if is_disc else draw.rectangle
            if mark["solid"]:
                draw_shape(box, fill=color)
            else:
                fill = None if is_disc else blend(color, 0.1)  # A pale region of items.
                draw_shape(box, fill=fill, outline=blend(color, 0.5), width=OVERSAMPLING)
        return image

    def _draw_items(self, draw: ImageDraw.ImageDraw, step: int) -> None:
        xs = self.item_x[step] * self.scale
        ys = self.item_y[step] * self.scale
        half_side = HALF_ITEM_SIDE * self.scale
        # Items of a kind are next to each other, in the order of the kinds.
        start = 0
        for kind in self.appearance["item_kinds"]:
            end = start + kind["number"]
            for x, y in zip(xs[start:end], ys[start:end], strict=True):
                box = (x - half_side, y - half_side, x + half_side, y + half_side)
                draw.rectangle(box, fill=resolve_color(kind["color"]))
            start = end

    def _draw_trails(self, draw: ImageDraw.ImageDraw, step: int) -> None:
        steps = slice(max(0, step - TRAIL_STEPS), step + 1)
        xs = self.x[steps]
        ys = self.y[steps]
        distances = np.abs(np.diff(xs, axis=0)) + np.abs(np.diff(ys, axis=0))
        # A distance from or to a dead agent is NaN. A newborn in its place begins another trail.
        is_break = ~(distances <= MAX_STEP_LENGTH)
        for agent in range(self.trace.sizes["agent"]):
            starts = np.flatnonzero(is_break[:, agent]) + 1
            points = np.stack([xs[:, agent], ys[:, agent]], axis=1) * self.scale
            color = self._symbol(agent).trail
            # No line runs across the map.
            for path in np.split(points, starts):
                if len(path) > 1:
                    line = [(float(x), float(y)) for x, y in path]
                    draw.line(line, fill=color, width=OVERSAMPLING)

    def _draw_agents(self, draw: ImageDraw.ImageDraw, step: int) -> None:
        """Draw living agents, filled after the first meal, with a flash at each meal."""
        eaten = self.eaten[step]
        eaten_before_flash = self.eaten[step - FLASH_STEPS] if step >= FLASH_STEPS else 0
        is_eating = eaten > eaten_before_flash
        length = AGENT_LENGTH * self.scale
        radius = FLASH_RADIUS * self.scale
        for agent in np.flatnonzero(self.is_alive[step]).tolist():
            x = float(self.x[step, agent]) * self.scale
            y = float(self.y[step, agent]) * self.scale
            if is_eating[agent]:
                draw.ellipse(
                    (x - radius, y - radius, x + radius, y + radius), fill=MOVIE_COLORS["meal"]
                )
            symbol = self._symbol(agent)
            heading = math.radians(float(self.heading[step, agent]))
            fill = symbol.fill if eaten[agent] else MOVIE_COLORS["hungry"]
            draw_agent(draw, symbol, (x, y), heading, length, fill, OVERSAMPLING)

    def _symbol(self, agent: int) -> AgentSymbol:
        return self.symbols[self.symbol_numbers[agent]]

    def _arrange_legend(self) -> list[tuple[int, float, AgentSymbol]]:
        """Return (row, left edge in pixels, symbol) of each species; empty for one species."""
        entries = []
        row = 0
        left: float = LEGEND_INDENT
        for species_index, symbol in enumerate(self.symbols if "species" in self.trace else ()):
            n_agents = self.symbol_numbers.count(species_index)
            # The text is longest while all agents are alive.
            text = self._legend_text(symbol, n_agents, n_agents)
            width = 4 * LEGEND_RADIUS + FONT.getlength(text) + 2 * LEGEND_INDENT
            if left > LEGEND_INDENT and left + width > self.size[0]:
                row += 1
                left = LEGEND_INDENT
            entries.append((row, left, symbol))
            left += width
        return entries

    def _legend_text(self, symbol: AgentSymbol, n_alive: int, n_agents: int) -> str:
        is_mortal = "alive" in self.trace
        return f"{symbol.name}: {n_alive} of {n_agents} alive" if is_mortal else symbol.name

    def _draw_legend(self, draw: ImageDraw.ImageDraw, step: int) -> None:
        """Draw shape, name and number of living agents of each species."""
        numbers = np.array(self.symbol_numbers)
        for species_index, (row, left, symbol) in enumerate(self.legend):
            n_alive = int(self.is_alive[step][numbers == species_index].sum())
            text = self._legend_text(symbol, n_alive, int((numbers == species_index).sum()))
            top = LEGEND_TOP + row * LEGEND_ROW_HEIGHT
            center = (left + LEGEND_RADIUS, top + LEGEND_ROW_HEIGHT / 2)
            draw_shape(draw, symbol, center, LEGEND_RADIUS, symbol.fill, 1)
            draw.text((left + 3 * LEGEND_RADIUS, top + 3), text, MOVIE_COLORS["text"], FONT)

    def _draw_caption(self, draw: ImageDraw.ImageDraw, step: int) -> None:
        """Draw the title, the step, the number of eaten items, and a progress bar."""
        eaten = self.eaten[step]
        number = self.first_step + step
        width = self.size[0]
        title = f"{self.trace.attrs['condition']}, generation {self.trace.attrs['generation']}"
        progress = (
            f"step {number:,} of {self.n_steps:,}: {eaten.sum():,} eaten, "
            f"{(eaten > 0).sum()} of {len(eaten)} agents ate"
        )
        draw.text((8, 4), title, MOVIE_COLORS["text"], FONT)
        draw.text((8, 22), progress, MOVIE_COLORS["text"], FONT)
        top = self.map_top - 3
        bottom = self.map_top - 1
        finished_width = width * min(1, (number + 1) / self.n_steps)
        draw.rectangle((0, top, width, bottom), fill=MOVIE_COLORS["line"])
        draw.rectangle((0, top, finished_width, bottom), fill=MOVIE_COLORS["agent"])


class MovieError(BaldwinLabError):
    """A movie that cannot be written."""


def write_scenes(
    scenes: Sequence[Scene],
    path: Path,
    report_progress: Callable[[float], object] = lambda share: None,
) -> None:
    """Write a movie of one or several lifetimes next to each other, which show the same step.

    `path`: a .gif file, or an .mp4 file, which needs the extra `video`. `report_progress`: a
    function that is called with the finished fraction of the movie, 0 to 1.
    """
    n_steps = max(scene.trace.sizes["step"] for scene in scenes)
    stride = max(1, math.ceil(n_steps / (MAX_SECONDS * FRAMES_PER_SECOND)))  # In steps.
    frames = _draw_frames(scenes, range(0, n_steps, stride), report_progress)
    with TemporaryDirectory() as folder:
        draft = Path(folder) / path.name
        with name_file_in_errors(draft):
            if path.suffix == ".gif":
                _write_gif(frames, draft, _make_gif_palette(scenes))
            else:
                _write_mp4(frames, draft)
        write_atomically(path, draft.read_bytes())


def _draw_frames(
    scenes: Sequence[Scene], steps: range, report_progress: Callable[[float], object]
) -> Iterator[Image.Image]:
    renderers = [SceneRenderer(scene) for scene in scenes]
    for n_finished, step in enumerate(steps, 1):
        yield _join_images([renderer.frame(step) for renderer in renderers])
        report_progress(n_finished / len(steps))


def _join_images(images: Sequence[Image.Image]) -> Image.Image:
    """Return images next to each other."""
    n_gaps = len(images) - 1
    width = sum(image.width for image in images) + SCENE_GAP * n_gaps
    height = max(image.height for image in images)
    joined = Image.new("RGB", (width, height), MOVIE_COLORS["line"])
    left = 0
    for image in images:
        joined.paste(MOVIE_COLORS["background"], (left, 0, left + image.width, height))
        joined.paste(image, (left, 0))
        left += image.width + SCENE_GAP
    return joined


def _write_gif(frames: Iterator[Image.Image], path: Path, palette: Image.Image) -> None:
    reduced = (frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames)
    next(reduced).save(
        path,
        save_all=True,
        append_images=reduced,
        duration=MILLISECONDS_PER_SECOND // FRAMES_PER_SECOND,
        loop=0,  # Repeat without end.
        comment=REPLAY_MARK.encode(),
    )


def _make_gif_palette(scenes: Sequence[Scene]) -> Image.Image:
    """Return a palette of all drawn colors, and of blends of each color with the background."""
    appearances = [read_appearance(scene.trace) for scene in scenes]
    part_colors = [
        resolve_color(item["color"])
        for appearance in appearances
        for item in (*appearance["item_kinds"], *appearance["marks"])
    ]
    species_colors = [
        color
        for scene in scenes
        for symbol in list_symbols(scene.trace)
        for color in (symbol.fill, symbol.outline, symbol.trail)
    ]
    all_colors = [*MOVIE_COLORS.values(), *part_colors, *species_colors]
    colors = list(dict.fromkeys(all_colors))[:MAX_GIF_COLORS]
    n_shades = MAX_GIF_COLORS // len(colors)
    # The last shade of a color is the color itself.
    shades = [(shade_index + 1) / n_shades for shade_index in range(n_shades)]
    blends = [blend(color, share) for color in colors for share in shades]
    image = Image.new("P", (1, 1))
    image.putpalette([level for color in blends for level in color])
    return image


def _write_mp4(frames: Iterator[Image.Image], path: Path) -> None:
    try:
        import imageio_ffmpeg
    except ImportError:
        reason = missing_extra_error("video", "writing .mp4")
        raise MovieError(f"{reason}; .gif and .png need no extra") from None
    first_frame = next(frames)
    writer = imageio_ffmpeg.write_frames(
        str(path),
        first_frame.size,
        output_params=["-metadata", f"comment={REPLAY_MARK}"],
        fps=FRAMES_PER_SECOND,
        macro_block_size=2,  # Sides are even numbers of pixels.
        ffmpeg_log_level="quiet",
    )
    writer.send(None)  # Starts the generator.
    writer.send(np.ascontiguousarray(first_frame))
    for frame in frames:
        writer.send(np.ascontiguousarray(frame))
    writer.close()
    _require_complete(path)


def _require_complete(path: Path) -> None:
    """Raise OSError without the index `moov`. ffmpeg writes the index last and reports no error."""
    if b"moov" not in path.read_bytes():
        is_disk_full = shutil.disk_usage(path.parent).free < FULL_DISK_BYTES
        error_number = errno.ENOSPC if is_disk_full else errno.EIO
        raise OSError(error_number, os.strerror(error_number), str(path))
