"""Makes the pictures of the gallery's pages in docs/ anew: `python -m scripts.gallery_pictures`. It runs what they show."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

import xarray as xr
from matplotlib.figure import Figure

import baldwinlab as bl
from baldwinlab import figures, papers
from baldwinlab.papers.verdicts import compared
from baldwinlab.report.content import recorded_shares

PICTURES: Final = Path(__file__).parents[1] / "docs" / "pictures"


def _shares(study: xr.Dataset, experiments: Sequence[Any]) -> Figure:
    return figures.shares(study, recorded_shares({one.name: one for one in experiments}))


def _curves(study: xr.Dataset, experiments: Sequence[Any]) -> Figure:
    return figures.fitness_curves(study)


def _measures_of(name: str) -> Callable[[xr.Dataset, Sequence[Any]], Figure]:
    paper = papers.load(name)
    return lambda study, experiments: figures.measures(study, [figures.Measured(*one) for one in compared(study, paper)])


DRAWN: Final[dict[str, Callable[[xr.Dataset, Sequence[Any]], Figure]]] = {
    "hinton-nowlan-1987": _shares,
    "nolfi-parisi-1993": _curves,
    "nolfi-elman-parisi-1994": _curves,
    "mayley-1996": _shares,
    "paenke-2007": _measures_of("paenke-2007"),
    "stanley-miikkulainen-2002": _curves,
}


def main() -> None:
    for name, draw in DRAWN.items():
        paper = papers.load(name)
        experiments = paper.experiments()
        with TemporaryDirectory() as folder:
            bl.run(experiments, runs=paper.about.runs, out=Path(folder) / "study")
            figures.save(draw(bl.open_study(Path(folder) / "study"), experiments), Path(folder), name)
            (PICTURES / f"{name}.png").write_bytes((Path(folder) / f"{name}.png").read_bytes())


if __name__ == "__main__":
    main()
