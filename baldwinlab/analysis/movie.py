"""Movies of traces (.mp4 or .gif), which show the map, its food, and agents with trails."""

from __future__ import annotations

import errno
import math
import os
import shutil
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from PIL import Image

from baldwinlab.analysis.agent_symbols import blend, list_symbols
from baldwinlab.analysis.palette import MOVIE_COLORS, resolve_color
from baldwinlab.analysis.scene import Scene, SceneRenderer
from baldwinlab.analysis.traces import read_appearance
from baldwinlab.core.deferred import xr
from baldwinlab.core.errors import BaldwinLabError
from baldwinlab.core.extras import missing_extra_error
from baldwinlab.core.file_writing import write_atomically
from baldwinlab.core.files import REPLAY_MARK, name_file_in_errors

FRAMES_PER_SECOND = 25
MAX_GIF_COLORS = 256
MILLISECONDS_PER_SECOND = 1000
# Free disk space, in bytes, below which a failure means that the disk is full.
FULL_DISK_BYTES = 2**20
# Longest duration of a movie, in seconds. A movie of a longer lifetime skips steps.
MAX_SECONDS = 20
# Space between two scenes, in pixels.
SCENE_GAP = 4


class MovieError(BaldwinLabError):
    """A movie that cannot be written."""


def write_movie(trace: xr.Dataset, width: float, height: float, path: Path) -> None:
    """Write a movie of one lifetime.

    `path`: a .gif file, or an .mp4 file, which needs the extra `video`.
    """
    write_scenes([Scene(trace, width, height)], path)


def write_scenes(
    scenes: Sequence[Scene],
    path: Path,
    report_progress: Callable[[float], object] = lambda share: None,
) -> None:
    """Write a movie of several lifetimes next to each other, in step.

    `path`: a .gif file, or an .mp4 file, which needs the extra `video`. `report_progress`: a
    function that is called with the finished share of the movie, 0 to 1.
    """
    n_steps = max(scene.trace.sizes["step"] for scene in scenes)
    stride = max(1, math.ceil(n_steps / (MAX_SECONDS * FRAMES_PER_SECOND)))
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
        loop=0,
        comment=REPLAY_MARK.encode(),
    )


def _make_gif_palette(scenes: Sequence[Scene]) -> Image.Image:
    """Return a palette of all drawn colors, and of their blends with the background."""
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
        macro_block_size=2,
        ffmpeg_log_level="quiet",
    )
    writer.send(None)
    writer.send(np.ascontiguousarray(first_frame))
    for frame in frames:
        writer.send(np.ascontiguousarray(frame))
    writer.close()
    _require_complete(path)


def _require_complete(path: Path) -> None:
    """Raise OSError if the movie has no index, which ffmpeg writes last and without an error."""
    if b"moov" not in path.read_bytes():
        is_disk_full = shutil.disk_usage(path.parent).free < FULL_DISK_BYTES
        error_number = errno.ENOSPC if is_disk_full else errno.EIO
        raise OSError(error_number, os.strerror(error_number), str(path))
