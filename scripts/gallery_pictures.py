"""Makes the pictures of the gallery's pages in docs/ anew: `python -m scripts.gallery_pictures`. It runs what they show."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

import baldwinlab as bl
from baldwinlab import figures, papers
from baldwinlab.report.content import recorded_shares

PICTURES = Path(__file__).parents[1] / "docs" / "pictures"


def main() -> None:
    paper = papers.load("hinton-nowlan-1987")
    experiments = paper.experiments()
    with TemporaryDirectory() as folder:
        bl.run(experiments, runs=paper.about.runs, out=Path(folder) / "study")
        study = bl.open_study(Path(folder) / "study")
        shares = figures.shares(study, recorded_shares({one.name: one for one in experiments}))
        figures.save(shares, Path(folder), "hinton-nowlan")
        (PICTURES / "hinton-nowlan.png").write_bytes((Path(folder) / "hinton-nowlan.png").read_bytes())


if __name__ == "__main__":
    main()
