"""Write the results of what-guides.md: `python -m scripts.guidance_page FOLDER`.

FOLDER is the folder of `baldwinlab reproduce what-guides`. No simulation runs.
"""

from __future__ import annotations

import shutil
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from baldwinlab.analysis.report.tables import Table
from baldwinlab.api.cells import CellsRequest
from baldwinlab.api.guidance.publish import (
    GuidanceResults,
    list_tables,
    publish_guidance,
    read_results,
)
from scripts.pages import EXPLANATION, PICTURES, tabulate, write_results

PAGE: Final = EXPLANATION / "what-guides.md"
# The NK landscapes of the table: all K, with these trials and agents.
SHOWN_CELLS: Final = "-trials-30-size-100"
# Pictures with their alternative texts.
FIGURES: Final = {
    "effects": "Effects of learning, noise and time on NK landscapes by K, trials, agents and "
    "common generations",
    "chain": "Effect of learning with rare mutations, and the prediction of the Markov chain",
    "models": "Relative effects of learning, noise and time in the other models",
}


def make_results(results: GuidanceResults) -> str:
    """Return the verdicts, the figures and the tables of the page as Markdown."""
    verdicts = [
        [f"{claim.id}: {claim.claim}", evaluation.verdict, evaluation.numbers, evaluation.runs]
        for claim, evaluation in results.predictions
    ]
    landscapes, _, models = results.list_parts()
    return "\n".join(
        [
            f"The study has the seed {results.seed}. The SHA-256 of its design is "
            f"`{results.digest}`.",
            "",
            *tabulate(["prediction", "verdict", "estimates with 95 % intervals", "runs"], verdicts),
            "",
            *(f"![{text}](../pictures/what-guides-{name}.png)\n" for name, text in FIGURES.items()),
            *(
                line
                for table in list_tables(results, landscapes)
                for line in show_table(table, SHOWN_CELLS)
            ),
            *(line for table in list_tables(results, models) for line in show_table(table)),
        ]
    )


def show_table(table: Table, suffix: str = "") -> Iterator[str]:
    """Yield the caption and the rows of the cells whose names end with a suffix."""
    yield f"{table.caption}:"
    yield ""
    rows = [[name, *effects] for name, (effects,) in table.groups if name.endswith(suffix)]
    yield from tabulate(["cell", *[*table.columns][1:]], rows)
    yield ""


if __name__ == "__main__":
    folder = Path(sys.argv[1])
    request = CellsRequest(folder)
    publish_guidance(request)
    write_results(PAGE, make_results(read_results(request)).rstrip())
    for name in FIGURES:
        shutil.copy(folder / "figures" / f"{name}.png", PICTURES / f"what-guides-{name}.png")
