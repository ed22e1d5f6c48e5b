"""Draw the pictures of papers: `python -m scripts.gallery_pictures [PAPER ...]`.

The script runs each paper, and draws its picture for docs/ and a small one, `card.png`, for its
folder. If a paper takes too long, its card is cut from a picture in docs/.
"""

from __future__ import annotations

import io
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

import xarray as xr
from matplotlib.figure import Figure
from PIL import Image

import baldwinlab as bl
from baldwinlab import papers
from baldwinlab.analysis import figures
from baldwinlab.analysis.claim_samples import Samples
from baldwinlab.analysis.report import content
from baldwinlab.papers.paper import CARD_FILE

PICTURES: Final = Path(__file__).parents[1] / "docs" / "pictures"
# Pixels of a card.
WIDTH = 640
HEIGHT = 320
# Numbers of colors of a card. The first one that gives a small file is used.
COLORS: Final = (128, 64, 32)
# Bytes.
MAX_SIZE: Final = 30_000


def _shares(dataset: xr.Dataset, experiments: Sequence[Any]) -> Figure:
    conditions = {experiment.name: experiment for experiment in experiments}
    return figures.draw_shares(content.compute_shares(dataset, conditions))


def _curves(dataset: xr.Dataset, experiments: Sequence[Any]) -> Figure:
    return figures.draw_fitness_curves(dataset)


def _measures_of(name: str) -> Callable[[xr.Dataset, Sequence[Any]], Figure]:
    paper = papers.load(name)
    return lambda study, experiments: figures.draw_measures(
        study,
        [figures.MeasureValues(*measure) for measure in Samples(study, 1, paper).model_measures()],
    )


def _survival(dataset: xr.Dataset, experiments: Sequence[Any]) -> Figure:
    return figures.draw_survival(dataset)


DRAWN: Final[dict[str, Callable[[xr.Dataset, Sequence[Any]], Figure]]] = {
    "hinton-nowlan-1987": _shares,
    "keesing-stork-1991": _measures_of("keesing-stork-1991"),
    "todd-miller-1991": _measures_of("todd-miller-1991"),
    "ackley-littman-1991": _survival,
    "nolfi-parisi-1993": _curves,
    "nolfi-elman-parisi-1994": _curves,
    "mayley-1996": _shares,
    "floreano-urzelai-2000": _shares,
    "stanley-miikkulainen-2002": _curves,
    "suzuki-arita-2004": _shares,
    "paenke-2007": _measures_of("paenke-2007"),
    "soltoggio-2008": _curves,
    "le-2018": _shares,
}
# The panel on the card; by default the first one.
PANEL: Final = {"mayley-1996": 1, "nolfi-parisi-1993": 1, "nolfi-elman-parisi-1994": 1}
# The picture, and the left, upper, right and lower edge in it.
CUT: Final = {
    "le-2019": ("emergence.png", (22, 58, 947, 510)),
    "worlds-and-minds": ("worlds-and-minds.png", (292, 816, 988, 1136)),
}


def main() -> None:
    for name in sys.argv[1:] or [*DRAWN, *CUT]:
        paper = papers.load(name)
        if name in CUT:
            picture, edges = CUT[name]
            (paper.folder / CARD_FILE).write_bytes(
                _small(Image.open(PICTURES / picture).crop(edges))
            )
            continue
        experiments = paper.experiments()
        with TemporaryDirectory() as folder:
            bl.run(experiments, runs=paper.metadata.runs, out=Path(folder) / "study")
            figure = DRAWN[name](bl.open_runs(Path(folder) / "study"), experiments)
            figures.save_figure(figure, Path(folder), name)
            (PICTURES / f"{name}.png").write_bytes((Path(folder) / f"{name}.png").read_bytes())
        (paper.folder / CARD_FILE).write_bytes(_card(figure, PANEL.get(name, 0)))


def _card(figure: Figure, panel: int) -> bytes:
    """Return one panel of a figure, without text."""
    shown = figure.axes[panel]
    for axes in [*figure.axes]:
        if axes is not shown:
            axes.remove()
    for legend in [*figure.legends]:
        legend.remove()
    shown.set(title="", xlabel="", ylabel="")
    shown.set_title("", loc="left")
    shown.tick_params(labelbottom=False, labelleft=False)
    figure.set_layout_engine("none")
    figure.set_size_inches(WIDTH / 200, HEIGHT / 200)
    shown.set_position((0.03, 0.05, 0.94, 0.9))
    drawn = io.BytesIO()
    figure.savefig(drawn, dpi=200)
    return _small(Image.open(drawn))


def _small(picture: Image.Image) -> bytes:
    """Return a picture in the size of a card, with few colors."""
    resized = picture.convert("RGB").resize((WIDTH, HEIGHT), Image.Resampling.LANCZOS)
    for colors in COLORS:
        file = io.BytesIO()
        resized.quantize(colors).save(file, "png", optimize=True)
        if file.tell() <= MAX_SIZE:
            break
    return file.getvalue()


if __name__ == "__main__":
    main()
