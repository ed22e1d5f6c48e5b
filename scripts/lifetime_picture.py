"""Make `docs/pictures/lifetimes.gif`: agents that learn next to agents that do not, on map B."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

from PIL import Image, ImageSequence

import baldwinlab as bl
from baldwinlab.analysis.movie import Scene, write_scenes

PICTURE: Final = Path(__file__).parents[1] / "docs" / "pictures" / "lifetimes.gif"
PRESETS: Final = ("evo+self-taught/B", "evo/B")
GENERATION: Final = 99
WIDTH: Final = 880  # pixels
EVERY: Final = 5  # of the frames of a movie, one is shown
DURATION: Final = 100  # milliseconds per frame


def main() -> None:
    with TemporaryDirectory() as folder:
        movie = Path(folder) / "movie.gif"
        write_scenes([lifetime(preset) for preset in PRESETS], movie)
        with Image.open(movie) as frames:
            images = [
                reduced(frame.convert("RGB"))
                for number, frame in enumerate(ImageSequence.Iterator(frames))
                if number % EVERY == 0
            ]
    palette = images[-1].quantize(64, dither=Image.Dither.NONE)
    first, *rest = (image.quantize(palette=palette, dither=Image.Dither.NONE) for image in images)
    first.save(PICTURE, save_all=True, append_images=rest, duration=DURATION, loop=0, optimize=True)


def lifetime(preset: str) -> Scene:
    """Simulate the last generation of one run."""
    experiment = bl.load(preset)
    trace = bl.replay(experiment, seed=0, run=0, generation=GENERATION)
    return Scene(trace, experiment.world.width, experiment.world.height)


def reduced(image: Image.Image) -> Image.Image:
    return image.resize(
        (WIDTH, round(image.height * WIDTH / image.width)), Image.Resampling.LANCZOS
    )


if __name__ == "__main__":
    main()
