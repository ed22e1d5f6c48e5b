"""A study as one HTML file that needs nothing else: claims, figures, summaries, and everything needed to make it again."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any

import xarray as xr

from baldwinlab.analysis.claims import ClaimResult, describe_claims_too_few
from baldwinlab.analysis.report import content
from baldwinlab.analysis.report.figures import EXPLAINING, SUMMING_UP, Looks, embed, pictures
from baldwinlab.analysis.report.phrases import measures
from baldwinlab.analysis.report.sections import InShort, Section, finished, render, write_page
from baldwinlab.analysis.statistics.contrasts import Contrasts
from baldwinlab.analysis.statistics.summary import summarize_conditions
from baldwinlab.core.files import write_atomically
from baldwinlab.papers import Paper

__all__ = [
    "InShort",
    "Section",
    "draw_report",
    "emergence_generations",
    "render",
    "write_page",
    "write_report",
]

PANELS = 6


def emergence_generations(generations: int) -> list[int]:
    """The generations at which emergence is shown: up to six, the first, the last, and each of the others a few times as late.

    What emerges does so early: of a hundred generations they are 0, 1, 3, 10, 31 and 99.
    """
    if generations <= PANELS:
        return list(range(generations))
    return sorted(
        {0, *(round((generations - 1) ** (number / (PANELS - 2))) for number in range(PANELS - 1))}
    )


def draw_report(
    directory: Path,
    dataset: xr.Dataset,
    results: Sequence[ClaimResult],
    traces: Sequence[xr.Dataset],
    provenance: Mapping[str, Any],
    last: int = 10,
    paper: Paper | None = None,
    looks: Looks = MappingProxyType({}),
    contrasts: Contrasts | None = None,
    reproduced: bool = False,
) -> dict[str, Any]:
    """Collect the contents of a report, and write its figures to `directory`/figures as SVG and PNG.

    Parameters
    ----------
    dataset
        Dataset with the dimensions (condition, run, generation, agent).
    results
        The decided claims of `paper`.
    traces
        Lifetimes of one population at `emergence_generations`, or none.
    provenance
        Facts shown as far as they are there: seed, versions, platform, seconds, agent_steps, workers, compile_seconds.
    last
        The number of generations over which a run is averaged, counted from its last one.
    paper
        The paper whose claims are decided. Without one, the report mentions no paper.
    looks
        The looks of the conditions of foragers whose parts are installed.
    contrasts
        The comparisons of the conditions.
    reproduced
        Whether `paper` made the study.

    Raises
    ------
    OSError
        A figure cannot be written.
    """
    texts = content.experiment_texts(dataset)
    conditions = content.experiments(texts)
    differing = content.differing(results)
    shown = [
        embed(picture, directory / "figures")
        for picture in pictures(dataset, results, traces, conditions, last, paper, looks)
    ]
    return {
        "paper": paper,
        "reproduced": reproduced,
        "contrasts": contrasts if contrasts and contrasts.rows else None,
        "too_few": describe_claims_too_few(results),
        "overview": content.overview(dataset, conditions, provenance, paper),
        "verdict_counts": content.verdict_counts(results),
        "results": results,
        "of_paper": any(result.claim.of_paper for result in results),
        "figures": shown,
        "explaining": EXPLAINING,
        "summing_up": SUMMING_UP,
        "measures": measures("food_eaten" in dataset),
        "last": last,
        "pairs": any(
            finding.comparison.paired for result in results for finding in result.findings
        ),
        "survival": any(
            finding.comparison.rule == "survives_longer"
            for result in results
            for finding in result.findings
        ),
        "own_measures": any(finding.meaning for result in results for finding in result.findings),
        "differing": differing,
        "open_choices": content.open_choices(differing, conditions),
        "departures": content.departures(dataset, conditions, paper) if paper else [],
        "summary": summarize_conditions(dataset, last),
        "experiments": texts,
        "provenance": provenance,
        "timing": content.timing(provenance),
    }


def write_report(
    directory: Path,
    drawn: Mapping[str, Any],
    out: Path,
    sections: Sequence[Section] = (),
    in_short: InShort | None = None,
) -> Path:
    """Write what was `drawn` of the study in `directory` to `out`, with `sections` after the claims; gives `out`.

    At its head stands what is said `in_short`.

    The file appears whole or not at all. Raises OSError.
    """
    page = render("report/report.html", sections=sections, in_short=in_short, **drawn)
    return write_atomically(out, finished(page, out, directory / "figures").encode())
